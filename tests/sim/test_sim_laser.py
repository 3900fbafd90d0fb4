"""Laser and bumpers: what they say of the obstacles."""

from __future__ import annotations

import math

import numpy as np
import pytest

from deploy.robot import load_robot
from services.messages import Bumper, Scan
from sim.bumpers import BumperSensor
from sim.disturbance import disturbance_from
from sim.effects import NONE, Effects, effects_at
from sim.laser import LaserSensor
from sim.obstacle_specs import Mover, Obstacle, Pillar, Wall
from sim.obstacles import Obstacles
from sim.scenario import Scenario
from sim.simulator import Simulator

ROBOT = load_robot("xr4000_puma560")
assert ROBOT.laser is not None and ROBOT.bumper is not None
LASER, BUMPER = ROBOT.laser, ROBOT.bumper
WALL = Wall(start=(2.05, -9.0), end=(2.05, 9.0))
TICK = 0.001


def scans(
    *obstacles: Obstacle, seconds: float = 1.0, effects: Effects = NONE, **options: float
) -> list[tuple[float, Scan]]:
    """Scans of a standing platform at the origin, with their times of arrival."""
    rng = np.random.default_rng(4)
    dropout, factor = options.pop("dropout", 0.0), options.pop("factor", 1.0)
    laser = LASER.model_copy(update=options)
    sensor = LaserSensor(laser, Obstacles(obstacles), dropout, factor, rng)
    ticks = range(round(seconds / TICK))
    return [(k * TICK, s) for k in ticks for s in sensor.step(k * TICK, np.zeros(3), effects)]


def test_a_scan_goes_all_round_and_no_beam_is_there_twice() -> None:
    """360 beams of a degree, from behind counter-clockwise; ``farthest`` where nothing is."""
    _, scan = scans()[0]
    assert len(scan.ranges) == 360 and scan.start == pytest.approx(-math.pi)
    assert (scan.ranges == LASER.farthest).all()
    _, half = scans(field_of_view=math.pi)[0]
    assert len(half.ranges) == 181 and half.start == pytest.approx(-math.pi / 2)


def test_ranges_have_the_stated_noise_about_the_truth_to_the_millimetre() -> None:
    """On a wall seen at every angle."""
    errors = []
    for _, scan in scans(WALL, seconds=10.0):
        bearings = scan.start + scan.increment * np.arange(len(scan.ranges))
        ahead = np.abs(bearings) < 1.2
        errors.append(scan.ranges[ahead] - 2.0 / np.cos(bearings[ahead]))
        np.testing.assert_allclose(scan.ranges * 1000, np.round(scan.ranges * 1000), atol=1e-6)
    assert np.mean(errors) == pytest.approx(0.0, abs=5e-4)
    assert np.std(errors) == pytest.approx(LASER.noise, rel=0.03)


def test_a_scan_is_of_its_stamp_and_late() -> None:
    """10 Hz, 30 ms late; a mover is where it was at the stamp."""
    mover = Mover(points=((1.0, 0.0), (5.0, 0.0)), speed=1.0, radius=0.2)
    heard = scans(mover, seconds=2.0, noise=0.0)
    stamps = [scan.t for _, scan in heard]
    np.testing.assert_allclose(np.diff(stamps), 0.1, atol=1e-9)
    for arrival, scan in heard:
        assert arrival - scan.t == pytest.approx(LASER.delay, abs=1e-9)
        assert scan.ranges[180] == pytest.approx(0.8 + scan.t, abs=1e-3)


@pytest.mark.parametrize("kind", ["dropout", "delay", "noise", "blinded"])
def test_disturbances_reach_the_laser(kind: str) -> None:
    """Silence, lateness, noise; blinded it says 0 in every beam."""
    options = {"delay": {"extra": 0.2}, "noise": {"factor": 5.0}}.get(kind, {})
    made = disturbance_from(kind, {"sensor": "laser", "duration": 60.0, **options}, 0.0)
    heard = scans(WALL, effects=effects_at(0.0, [made]), seconds=4.0)
    if kind == "dropout":
        assert not heard
    elif kind == "delay":
        assert heard[0][0] - heard[0][1].t == pytest.approx(LASER.delay + 0.2)
    elif kind == "noise":
        spread = np.std([scan.ranges[180] for _, scan in heard])
        assert spread == pytest.approx(5 * LASER.noise, rel=0.35)
    else:
        assert all((scan.ranges == 0.0).all() for _, scan in heard)


def test_a_share_of_scans_is_lost() -> None:
    """As the scenario says."""
    assert 20 < len(scans(seconds=10.0, dropout=0.5)) < 80


@pytest.mark.parametrize("bearing", [0.0, 2.0, -1.3, math.pi])
@pytest.mark.parametrize("heading", [0.0, 1.0])
def test_the_part_of_the_ring_that_touches_is_pressed(bearing: float, heading: float) -> None:
    """Within half a part of where the pillar is, in B; none with a gap of a centimetre."""
    for gap, pressed in ((0.001, 1), (0.01, 0)):
        away = ROBOT.chassis.radius + 0.2 + gap
        at = bearing + heading
        pillar = Pillar(x=away * math.cos(at), y=away * math.sin(at), radius=0.2)
        rng = np.random.default_rng(0)
        sensor = BumperSensor(BUMPER, ROBOT.chassis.radius, Obstacles([pillar]), 0.0, rng)
        said = sensor.step(0.0, np.array([0.0, 0.0, heading]), NONE)[0].pressed
        assert len(said) == pressed
        for one in said:
            off = math.remainder(one - bearing, 2 * math.pi)
            assert abs(off) <= math.pi / BUMPER.parts + 1e-9


def test_the_robot_publishes_them_at_their_rates_and_not_when_it_has_none() -> None:
    """10 Hz and 50 Hz; a scenario can take a sensor away."""
    counts = {}
    for enabled in (True, False):
        sensors = {name: {"enabled": enabled} for name in ("laser", "bumper")}
        simulator = Simulator(Scenario(sensors=sensors), 1)
        said = [m for k in range(1000) for m in simulator.step(k * TICK, None, None)]
        counts[enabled] = [sum(isinstance(m, t) for m in said) for t in (Scan, Bumper)]
    assert counts == {True: [10, 50], False: [0, 0]}
