"""The benchmark: worlds obey their options, figures mean what they say, knowledge pays."""

from __future__ import annotations

import json
import math
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from observer.belief import IMU, ODOMETRY
from observer.bench.estimators import ESTIMATORS
from observer.bench.exact import exact_options
from observer.bench.figures import (
    SHIFTS,
    best_shift,
    detections,
    pieces,
    power_above,
    relative_error,
    shift_costs,
)
from observer.bench.goals import Goal, check, field
from observer.bench.manoeuvres import docking, drive, still, sway, turns
from observer.bench.motions import MOTIONS
from observer.bench.play import Track
from observer.bench.rows import UNITS, Key, rows
from observer.bench.score import Score, judge
from observer.bench.smoother import forward, smoothed
from observer.bench.world import DT, ROBOT, World, simulate
from observer.metrics import nees, rms
from observer.observer_options import make_filter
from services.bench.observer import Job, run_job
from services.bench.observer_plots import COLOURS
from services.cli.main import app
from services.messages import BaseCommand, Imu, Odometry

runner = CliRunner()


def of(kind: type, world: World) -> list[tuple[float, Odometry | Imu | BaseCommand]]:
    """Messages of a kind with their arrival."""
    return [(t, m) for t, m in world.arrivals if isinstance(m, kind)]


def stacked(kind: type, name: str, world: World) -> np.ndarray:
    """A field of all messages of a kind, (n, 3)."""
    return np.array([getattr(m, name) for _, m in of(kind, world)])


# -- the world ------------------------------------------------------------------------------------


@pytest.mark.parametrize("command", [sway, drive, docking, turns])
def test_truth_is_consistent_in_itself(command) -> None:  # type: ignore[no-untyped-def]
    """Velocity is the derivative of pose and acceleration that of velocity, in every manoeuvre."""
    w = simulate(command, 3, 14.0, brakes=0.2)
    moved, mean = np.diff(w.pose, axis=0) / DT, 0.5 * (w.velocity[1:] + w.velocity[:-1])
    assert np.abs(moved - mean).max() < 1e-5
    change = np.diff(w.velocity, axis=0) / DT
    assert np.abs(change - w.acceleration[:-1]).max() < 5e-3
    assert np.abs(w.velocity).max() > 0.2


def test_odometry_is_the_reference_rounded() -> None:
    """Half a step at most between what odometry says and the reference, slip included."""
    w = simulate(sway, 4, 6.0, heading=0.4, slips=((2.0, 0.2, 0.03, -0.04),))
    at = np.rint([m.t / DT for _, m in of(Odometry, w)]).astype(int)
    off = np.abs(stacked(Odometry, "pose", w) - w.reference[at])
    assert (off <= 0.5 * np.array(ROBOT.odometry.resolution) + 1e-9).all()
    assert off.max(axis=0) == pytest.approx(0.5 * np.array(ROBOT.odometry.resolution), rel=0.1)
    np.testing.assert_allclose((w.reference - w.pose)[-1], [0.03, -0.04, 0.0], atol=1e-12)
    assert not w.judged(0.0)[2500] and w.judged(0.0)[1400] and w.judged(0.0)[5100]


def test_delays_stamps_and_rates() -> None:
    """Every message arrives its delay after it was sampled, at its rate; a wrong stamp is wrong."""
    w = simulate(sway, 5, 4.0, odometry_rate=5.0, odometry_delay=0.1, imu_delay=0.03)
    assert {round(t - m.t, 9) for t, m in of(Odometry, w)} == {0.1}
    assert {round(t - m.t, 9) for t, m in of(Imu, w)} == {0.03}
    assert len(of(Odometry, w)) == 21 and len(of(Imu, w)) == 401
    assert (w.robot.odometry.delay, w.robot.odometry.rate, w.robot.imu.delay) == (0.1, 5.0, 0.03)
    late = simulate(sway, 5, 4.0, stamp_error=0.002)
    assert {round(t - m.t, 9) for t, m in of(Odometry, late)} == {0.018}


def test_tilt_turns_with_heading() -> None:
    """A tilted floor takes gravity from the accelerometer, fixed in O."""
    g = np.array([0.05, -0.08])
    level, tilted = (simulate(turns, 6, 8.0, tilt=tilt) for tilt in ((0.0, 0.0), tuple(g)))
    less = stacked(Imu, "accel", level) - stacked(Imu, "accel", tilted)
    heading = level.pose[::10, 2]
    c, s = np.cos(heading), np.sin(heading)
    expected = np.stack([c * g[0] + s * g[1], -s * g[0] + c * g[1], 0 * c], axis=1)
    np.testing.assert_allclose(less, expected, atol=1e-12)
    assert np.ptp(heading) > math.radians(90)
    assert np.array_equal(level.pose, tilted.pose)


def test_scale_stretches_and_bends_odometry() -> None:
    """Wheels that read 2 % too much turn and 1 % too much way, step by step."""
    w = simulate(turns, 7, 9.0, scale=(1.01, 1.02), disturbance=0.0)
    assert (w.truth.odometry.scale, w.robot.odometry.scale) == ((1.01, 1.02), (1.0, 1.0))
    at = np.rint([m.t / DT for _, m in of(Odometry, w)]).astype(int)
    read, true = stacked(Odometry, "pose", w), w.pose[at]
    turned = np.unwrap(read[:, 2])[-1] - read[0, 2]
    assert turned == pytest.approx(1.02 * (true[-1, 2] - true[0, 2]), abs=2e-3)
    early = at < 2000  # straight ahead
    way = np.linalg.norm((read[early][-1] - read[0])[:2])
    assert way == pytest.approx(1.01 * np.linalg.norm((true[early][-1] - true[0])[:2]), abs=1.5e-3)
    # after the turn the wrong heading leads astray: the error is not along the way any more
    off = read[-1, :2] - read[0, :2] - 1.01 * (true[-1, :2] - true[0, :2])
    assert np.linalg.norm(off) > 5e-3


def test_mounting_turns_what_the_imu_reads() -> None:
    """Turned back by R_BI, an inclined sensor reads what a straight one does, but for its bias."""
    mount = (0.1, -0.2, 0.7)
    straight, inclined = (
        simulate(sway, 8, 3.0, noise=0.0, imu_rotation=r) for r in ((0.0, 0.0, 0.0), mount)
    )
    (r, p, y) = mount
    about_x = np.array([[1, 0, 0], [0, math.cos(r), -math.sin(r)], [0, math.sin(r), math.cos(r)]])
    about_y = np.array([[math.cos(p), 0, math.sin(p)], [0, 1, 0], [-math.sin(p), 0, math.cos(p)]])
    about_z = np.array([[math.cos(y), -math.sin(y), 0], [math.sin(y), math.cos(y), 0], [0, 0, 1]])
    R_BI = about_z @ about_y @ about_x
    for name in ("gyro", "accel"):
        a, b = stacked(Imu, name, straight), stacked(Imu, name, inclined)
        np.testing.assert_allclose((b - b[0]) @ R_BI.T, a - a[0], atol=1e-12)
    assert abs(stacked(Imu, "accel", inclined)[0, 0]) > 1.0  # gravity leaks


def test_the_drive_acts_later() -> None:
    """An unknown dead time shifts the whole motion."""
    soon = simulate(drive, 9, 4.0, disturbance=0.0)
    late = simulate(drive, 9, 4.0, disturbance=0.0, command_delay=0.03)
    speed, after = (np.hypot(*w.velocity[:, :2].T) for w in (soon, late))
    np.testing.assert_allclose(after[30:], speed[:-30], atol=1e-6)
    assert late.truth.platform.command_delay == pytest.approx(0.03)


def test_truth_knows_its_parameters() -> None:
    """Lag and noise are drawn in their ranges, and are what the platform and its IMU show."""
    w = simulate(still, 10, 20.0, stuck=True)
    assert 0.9 <= w.truth.platform.lag / ROBOT.platform.lag <= 1.1
    noise = np.std(stacked(Imu, "gyro", w)[:, 2])
    assert noise == pytest.approx(w.truth.imu.gyro_noise, rel=0.05)
    assert 1.0 <= w.truth.imu.accel_noise / ROBOT.imu.accel_noise <= 1.5

    def step(t: float) -> tuple[float, float, float]:
        return 0.1, 0.0, 0.0

    r = simulate(step, 11, 2.0, disturbance=0.0, lag=1.2)
    at = int(np.searchsorted(np.hypot(*r.velocity[:, :2].T), 0.1 * (1.0 - math.exp(-1.0))))
    assert at * DT == pytest.approx(0.001 + 1.2 * ROBOT.platform.lag, abs=0.002)


def test_brakes_hold() -> None:
    """Docked, the platform comes to rest without a jolt and stays."""
    w = simulate(docking, 12, 16.0, brakes=0.2)
    assert np.abs(w.velocity[-1000:]).max() < 1e-9
    assert np.ptp(w.pose[-1000:], axis=0).max() < 1e-9
    assert np.abs(w.acceleration[5000:, :2]).max() < 0.6
    assert np.abs(simulate(docking, 12, 16.0).velocity[-1000:]).max() > 1e-4


@pytest.mark.parametrize("name", MOTIONS)
def test_worlds_are_functions_of_their_seed(name: str) -> None:
    """Same seed, same world; another seed, another one. What befalls it is there."""
    a, b, c = (MOTIONS[name].world(seed, 10.0, 12.0) for seed in (5, 5, 6))
    assert np.array_equal(a.pose, b.pose) and a.conditions == b.conditions
    assert not np.array_equal(a.pose, c.pose)
    how = a.conditions
    assert bool(how.pushes) == (name == "push") and bool(how.slips) == (name == "slip")
    assert (how.odometry_gap[0] < 12.0) == (name == "dropout")
    assert (how.tilt != (0.0, 0.0)) == (name == "tilt")


# -- figures --------------------------------------------------------------------------------------


def wave(shift: float = 0.0) -> np.ndarray:
    """Positions on two sines, every millisecond, ``shift`` samples late."""
    t = (np.arange(4000) - shift) * DT
    return np.stack([0.3 * np.sin(t), 0.1 * np.cos(2.0 * t)], axis=1)


@pytest.mark.parametrize("shift", [0.0, 12.3, 44.6, -7.0])
def test_latency_is_the_shift(shift: float) -> None:
    """A path that is late by so many samples, not whole ones, is found to be late by just that."""
    every = np.ones(4000, dtype=bool)
    costs = shift_costs(wave(shift), wave(), np.arange(4000), every)
    assert best_shift(costs) == pytest.approx(shift, abs=0.01)


def test_latency_beyond_what_is_tried() -> None:
    """No answer rather than a wrong one."""
    costs = shift_costs(wave(300.0), wave(), np.arange(4000), np.ones(4000, dtype=bool))
    assert best_shift(costs) is None and len(costs) == len(SHIFTS)


def test_relative_error() -> None:
    """Blind to a turned and moved frame; sees drift over its duration, and only that."""
    t = np.arange(3000) * DT
    path = np.column_stack([wave()[:3000], 0.4 * np.sin(t)])
    c, s = math.cos(0.7), math.sin(0.7)
    elsewhere = path.copy()
    elsewhere[:, 0] = c * path[:, 0] - s * path[:, 1] + 5.0
    elsewhere[:, 1] = s * path[:, 0] + c * path[:, 1] - 2.0
    elsewhere[:, 2] += 0.7
    assert relative_error(elsewhere, path, 500).max() < 1e-12
    drifting = path.copy()
    drifting[:, 0] += 0.004 * t  # 4 mm/s
    np.testing.assert_allclose(relative_error(drifting, path, 500), 0.002, rtol=1e-9)
    assert len(relative_error(drifting, path, 500)) == 2500


def test_power_above_the_cutoff() -> None:
    """A sine has half its squared amplitude as power, above the cutoff and nowhere below."""
    t = np.arange(8192) * DT
    error = np.stack([2.0 * np.sin(2 * np.pi * 50.0 * t), 2.0 * np.sin(2 * np.pi * 5.0 * t)], 1)
    power = power_above(error, 1.0 / DT)
    assert power is not None
    assert power[0] == pytest.approx(2.0, rel=0.02) and power[1] < 1e-3
    assert power_above(error[:500], 1.0 / DT) is None


def test_detections_and_pieces() -> None:
    """A flag in time belongs to its cause; one without a cause is a false alarm."""
    t = np.arange(1000) * 0.01
    flag = ((t >= 2.1) & (t < 2.6)) | ((t >= 5.0) & (t < 5.2)) | ((t >= 8.9) & (t < 9.0))
    delays, alone = detections(flag, t, (2.0, 7.0), within=1.0)
    assert delays == [pytest.approx(0.1), math.inf]
    np.testing.assert_allclose(t[alone], [5.0, 8.9])
    mask = np.array([True, True, False, True, False])
    assert pieces(mask) == [slice(0, 2), slice(3, 4)]


def off_by(world: World, error: np.ndarray, sigma: float = 1e-3) -> Track:
    """A track that is the truth plus an error (n, 3)."""
    n = len(world.t)
    covariance = np.broadcast_to(sigma**2 * np.eye(3), (n, 3, 3))
    none = np.full(n, math.nan)
    slip = np.zeros(n, dtype=np.bool_)
    pose = world.reference + error
    return Track(np.arange(n), 1, pose, world.velocity, covariance, slip, none, none, none)


def row_of(track: Track, world: World) -> dict:
    """The row that one run makes."""
    return rows({Key("sway", 20.0, "exact"): judge(track, world, True)}, 1)[0]


def test_a_run_is_judged() -> None:
    """An error that comes in a step before a push and goes in one where the push ends to count."""
    world = simulate(sway, 13, 12.0, pushes=(7.0,))
    error = np.zeros((len(world.t), 3))
    error[:4000] = 1.0  # before judging starts
    error[6000:7500, 0] = 3e-3
    error[6000:7500, 1] = -4e-3
    row = row_of(off_by(world, error), world)
    assert row["max_mm"] == pytest.approx(5.0) and row["max_deg"] == 0.0
    assert row["rms_mm"] == pytest.approx(5.0 * math.sqrt(1500 / 7001))
    assert row["max_step_mm_per_ms"] == pytest.approx(5.0)
    assert row["nees"] == pytest.approx(25.0 * 1500 / 7001)
    assert row["in_push_rms_mm"] == pytest.approx(5.0)
    assert row["relative_500ms_mm"] == pytest.approx(5.0 * math.sqrt(1000 / 6501), rel=1e-3)
    assert row["fast_mm2_s2"] == pytest.approx(0.0, abs=1e-12)
    assert row["nees_in_band"] == pytest.approx(0.0)
    assert row["false_alarms_per_10min"] == 0.0 and row["flagged_within_200ms"] is None
    assert row["ratio_to_exact"] == 1.0


def test_a_gap_is_judged() -> None:
    """Error at the end of a gap against 3 sigma, the step on return, and what stays after it."""
    world = simulate(sway, 14, 12.0, odometry_gap=(7.0, 8.0))
    back = 8.0 + ROBOT.odometry.delay
    error = np.zeros((len(world.t), 3))
    error[:, 1] = 1e-3
    t = world.t
    error[(t >= 7.0) & (t < back), 1] = 3.1e-3
    error[t >= back, 1] = 1.5e-3
    row = row_of(off_by(world, error), world)
    assert row["gap_inside_3_sigma"] == 0.0 and row["gap_end_mm"] == pytest.approx(3.1)
    assert row["gap_after_over_before"] == pytest.approx(1.5)
    assert row["gap_step_mm_per_ms"] == pytest.approx(1.6)
    assert row_of(off_by(world, error, 1.1e-3), world)["gap_inside_3_sigma"] == 1.0


def test_slip_alarms_are_counted() -> None:
    """What is flagged in time, how soon, and what is flagged without cause."""
    world = simulate(sway, 15, 14.0, slips=((7.0, 0.1, 0.05, 0.0),))
    track = off_by(world, np.zeros((len(world.t), 3)))
    t = world.t
    track.slip[(t >= 7.12) & (t < 7.6)] = True
    track.slip[(t >= 12.0) & (t < 12.5)] = True
    row = row_of(track, world)
    assert row["flagged_within_200ms"] == 1.0
    assert row["detection_ms_median"] == pytest.approx(120.0)
    watched = 9.001 - 3.5  # from 5 s on, without 0.5 s before and 3 s after the slip
    assert row["false_alarms_per_10min"] == pytest.approx(600.0 / watched, rel=1e-3)


def test_scores_add_up() -> None:
    """Two runs together: sums of squares, the larger peak, all values."""
    a = Score({"squares": np.array([1.0, 2.0, 3.0])}, {"mm": 1.0}, {"x": [1.0]})
    a.merge(Score({"squares": np.array([1.0, 1.0, 1.0])}, {"mm": 4.0}, {"x": [2.0], "y": [0.0]}))
    assert a.sums["squares"].tolist() == [2.0, 3.0, 4.0]
    assert a.peaks == {"mm": 4.0} and a.values == {"x": [1.0, 2.0], "y": [0.0]}


# -- estimators -----------------------------------------------------------------------------------


@cache
def followed(name: str, seed: int, motion: str) -> tuple[Track, World]:
    """What an estimator says of one world of 10 s."""
    world = MOTIONS[motion].world(seed, 20.0, 10.0)
    return ESTIMATORS[name].follow(world), world


def error_of(name: str, seed: int, motion: str = "sway") -> tuple[np.ndarray, np.ndarray]:
    """Error and covariance after 5 s."""
    track, world = followed(name, seed, motion)
    mask = world.judged(5.0)[track.index]
    return (track.pose - world.reference[track.index])[mask], track.covariance[mask]


def joint(name: str) -> np.ndarray:
    """Errors of a few worlds together."""
    return np.concatenate([error_of(name, seed)[0] for seed in range(4)])


def test_knowledge_helps() -> None:
    """Smoother < exact < Taylor < hold: each knows more than the next."""
    exact, taylor = joint("exact"), joint("taylor1")
    assert rms(joint("smoother")[:, :2]) < 0.7 * rms(exact[:, :2])
    assert rms(joint("smoother")[:, 2]) < rms(exact[:, 2])
    assert rms(exact[:, :2]) < 0.5 * rms(taylor[:, :2])
    assert rms(exact[:, 2]) < 0.2 * rms(taylor[:, 2])
    assert rms(taylor[:, :2]) < 0.3 * rms(joint("hold")[:, :2])


def test_exact_and_smoother_tell_the_truth_about_themselves() -> None:
    """Their NEES is near its expectation in motion: the models are the world's."""
    for name in ("exact", "smoother"):
        values = [float(np.mean(nees(*error_of(name, seed)))) for seed in range(4)]
        assert 2.0 < np.mean(values) < 4.2, name


def test_the_exact_filter_expects_what_it_sees() -> None:
    """In motion the mean NIS of both sensors is 3; at standstill, of which it knows nothing, the
    repeated rounding makes it far surer than it may be: no mode and no floor hides that.
    """
    total = Score()
    for seed in range(4):
        total.merge(judge(*followed("exact", seed, "sway"), detects=False))
    row = rows({Key("sway", 20.0, "exact"): total}, 4)[0]
    assert row["imu_nis"] == pytest.approx(3.0, abs=0.15)
    assert row["odometry_nis"] == pytest.approx(3.0, abs=0.4)
    error, covariance = error_of("exact", 0, "standing")
    assert np.mean(nees(error, covariance)) > 5.0
    assert np.std(error[:, 0]) > 5e-5


def test_the_exact_filter_is_the_smoothers() -> None:
    """The product's filter with exact options and the smoother's own algebra agree."""
    world = simulate(sway, 21, 3.0, imu_gap=(0.0, 0.015))  # what comes before odometry is refused
    steps = forward(world)
    f = make_filter(world.truth, exact_options(world))
    for _, m in world.arrivals:
        if isinstance(m, BaseCommand):
            f.command(m.t + DT, m.velocity)
        elif isinstance(m, Odometry):
            f.add(ODOMETRY, m.t, m.pose, 9.0)
        else:
            f.add(IMU, m.t, (m.gyro[2], m.accel[0], m.accel[1]), 9.0)
        f.settle()
    assert f.belief.t == steps.t[-1]
    np.testing.assert_allclose(f.belief.x, steps.x[-1], atol=1e-7)
    np.testing.assert_allclose(f.belief.P, steps.P[-1], atol=1e-9)


def test_exact_needs_its_parameters() -> None:
    """A scale, a mounting and a tilt that it is told of cost it next to nothing."""
    plain = rms(error_of("exact", 3)[0][:, :2])
    for how in ({"scale": (1.01, 1.01)}, {"imu_rotation": (0.0, 0.1, 0.5)}, {"tilt": (0.05, 0.05)}):
        world = simulate(sway, 3, 10.0, **how)
        for track in (ESTIMATORS["exact"].follow(world), smoothed(world)):
            mask = world.judged(5.0)[track.index]
            off = (track.pose - world.reference[track.index])[mask]
            assert rms(off[:, :2]) < 1.5 * plain, how


# -- rows, goals, command -------------------------------------------------------------------------


def test_rows_have_every_field_and_goals_read_them() -> None:
    """A run of every motion fills the row; what is not defined is None."""
    made = {}
    for motion, names in (
        ("push", ("ekf", "single", "exact")),
        ("slip", ("ekf", "exact")),
        ("dropout", ("ekf",)),
    ):
        made.update(run_job(Job(motion, 20.0, 4, names, 10.0)))
    table = rows(made, 1)
    assert all(set(row) == {"motion", "odometry_hz", "estimator", "runs", *UNITS} for row in table)
    known = {(row["motion"], row["estimator"]): row for row in table}
    ekf = known["push", "ekf"]
    for name in ("rms_mm", "max_step_mm_per_ms", "nees", "latency_ms", "odometry_nis", "imu_nis"):
        assert math.isfinite(ekf[name]), name
    assert ekf["in_push_rms_mm"] < known["push", "single"]["in_push_rms_mm"]
    assert ekf["step_us_median"] <= ekf["step_us_p99"]
    assert known["slip", "ekf"]["flagged_within_200ms"] == 1.0
    assert known["slip", "exact"]["flagged_within_200ms"] is None
    assert known["dropout", "ekf"]["gap_step_mm_per_ms"] < 0.1
    verdicts = {v.goal.text: v for v in check(table)}
    assert verdicts["slip flagged within 0.2 s"].met is True
    assert verdicts["position error over exact"].met is None


def test_goals_are_met_or_missed() -> None:
    """The worst row decides; bands come from the row; other estimators do not matter."""
    row = {"odometry_hz": 20.0, "estimator": "ekf", "nees_band": [2.54, 3.50]}
    table = [
        {**row, "motion": "sway", "rms_mm": 1.0, "nees": 3.0},
        {**row, "motion": "drive", "rms_mm": 3.0, "nees": 2.5},
        {**row, "motion": "drive", "rms_mm": 9.0, "nees": 9.0, "estimator": "hold"},
    ]
    goals = (
        Goal("a", (), field("rms_mm"), 3.0),
        Goal("b", (), field("rms_mm"), 2.0),
        Goal("c", ("sway",), field("rms_mm"), 2.0, low=0.5),
        Goal("d", (), field("nees"), band=True),
        Goal("e", ("push",), field("rms_mm"), 2.0),
    )
    a, b, c, d, e = check(table, goals)
    assert (a.met, b.met, c.met, d.met, e.met) == (True, False, True, False, None)
    assert (b.value, b.where, b.missed, b.rows) == (3.0, "drive 20 Hz", ("drive 20 Hz",), 2)
    assert d.value == 2.5 and d.bounds == (2.54, 3.50)


def test_every_estimator_has_a_colour() -> None:
    """Pictures can show whoever is compared."""
    assert set(COLOURS) == set(ESTIMATORS)


def test_command(tmp_path: Path) -> None:
    """One small benchmark from the command line: JSON for scripts, and pictures."""
    words = ["bench", "observer", "--runs", "1", "--motion", "standing", "--odometry-hz", "10"]
    words += ["--estimator", "hold", "--json", "--plots", str(tmp_path)]
    result = runner.invoke(app, words)
    assert result.exit_code == 0, result.output
    table = json.loads(result.stdout)
    assert [row["estimator"] for row in table] == ["hold", "exact"]
    assert table[0]["rms_mm"] > 0 and table[0]["max_step_mm_per_ms"] == 0.0
    assert table[1]["nees_band"] == pytest.approx([0.22, 9.35], abs=0.2)
    assert {p.name for p in tmp_path.iterdir()} >= {"observer_rms.png", "observer_nees.png"}


@pytest.mark.parametrize(
    ("option", "value", "known"),
    [("--motion", "moon", "docking"), ("--estimator", "kalman", "taylor2")],
)
def test_unknown_names(option: str, value: str, known: str) -> None:
    """A name that does not exist is answered with those that do."""
    result = runner.invoke(app, ["bench", "observer", option, value])
    assert result.exit_code == 2
    assert known in result.stderr and value in result.stderr
