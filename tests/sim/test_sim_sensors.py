"""What the sensors say of the truth."""

from __future__ import annotations

import math

import numpy as np
import pytest

from deploy.robot import load_robot
from sim.draws import BLOCK, normal_rows
from sim.effects import NONE
from sim.scenario import Sensors
from sim.sensors import ImuSensor
from tests.sim.sim_loop import SILENT_SENSORS, Recording, drive, scenario

QUIET_FORCE = {"load_cell": {"force_noise": 0.0, "moment_noise": 0.0}}


def still(_: float) -> tuple[float, float, float]:
    """Stay."""
    return 0.0, 0.0, 0.0


def curve(t: float) -> tuple[float, float, float]:
    """Drive ahead and turn."""
    return 0.3 * math.sin(3.0 * t), 0.1, 0.4 * math.sin(2.0 * t)


@pytest.fixture(scope="module")
def driven() -> Recording:
    """A curve with perfect sensors."""
    return drive(scenario(), 2.0, curve)


# --- odometry -------------------------------------------------------------------------------


def test_odometry_is_quantised_late_and_true_at_its_stamp(driven: Recording) -> None:
    """1 mm and 0.1 deg, 20 ms late, 20 times a second, of the pose at the stamp."""
    step = np.array([0.001, 0.001, math.radians(0.1)])
    stamps = np.array([m.t for _, m in driven.odometry])
    np.testing.assert_allclose(np.diff(stamps), 0.05, atol=1e-9)
    for arrived, message in driven.odometry:
        assert arrived - message.t == pytest.approx(0.020, abs=1e-9)
        counts = message.pose / step
        np.testing.assert_allclose(counts, np.round(counts), atol=1e-6)
        true = driven.pose[round(1000 * message.t)]
        assert (np.abs(message.pose - true) <= 0.5 * step + 1e-9).all()


def test_dropout_silences_one_sensor_for_its_time() -> None:
    """Nothing sampled during a dropout ever arrives; the other sensor goes on."""
    out = {"kind": "dropout", "t": 0.3, "duration": 0.4, "sensor": "odometry"}
    run = drive(scenario(out), 1.0, still)
    stamps = np.array([m.t for _, m in run.odometry])
    assert not ((stamps >= 0.3) & (stamps < 0.7)).any()
    assert (stamps >= 0.7).any() and (stamps < 0.3).any()
    assert np.diff([m.t for _, m in run.imu]).max() < 0.0101


@pytest.mark.parametrize(("sensor", "own"), [("odometry", 0.020), ("imu", 0.010)])
def test_delay_makes_samples_late_and_leaves_their_stamps(sensor: str, own: float) -> None:
    """Arrival is later by the extra delay; what the stamp says stays true."""
    late = {"kind": "delay", "t": 0.5, "duration": 10, "sensor": sensor, "extra": 0.1}
    run, plain = drive(scenario(late), 1.0, curve), drive(scenario(), 1.0, curve)
    mine, theirs = getattr(run, sensor), getattr(plain, sensor)
    half = 0.005 if sensor == "imu" else 0.0  # an IMU stamps the middle of its period
    for arrived, message in mine:
        extra = 0.1 if message.t + half >= 0.5 - 1e-9 else 0.0
        assert arrived - message.t == pytest.approx(own + extra, abs=0.0011)
    for (_, a), (_, b) in zip(mine, theirs, strict=False):
        assert a.t == b.t


def test_noise_factor_scales_the_noise() -> None:
    """Ten times the noise on the IMU, and only while it acts."""
    noise = {"kind": "noise", "t": 1.0, "duration": 10, "sensor": "imu", "factor": 10.0}
    run = drive(scenario(noise, sensors={}), 3.0, still)
    t = np.array([m.t for _, m in run.imu])
    gyro = np.array([m.gyro for _, m in run.imu])
    before, during = gyro[t < 0.99].std(axis=0), gyro[t > 1.0].std(axis=0)
    np.testing.assert_allclose(during / before, 10.0, rtol=0.3)
    assert before.mean() == pytest.approx(0.000873, rel=0.2)


@pytest.mark.parametrize(
    ("sensor", "axis", "field", "index"), [("gyro", None, "gyro", 2), ("accel", "y", "accel", 1)]
)
def test_bias_jumps_and_stays(sensor: str, axis: str | None, field: str, index: int) -> None:
    """A bias shifts its axis by its value from its time on, and no other axis."""
    bias = {"kind": "bias", "t": 0.5, "sensor": sensor, "value": 0.2, "axis": axis}
    run = drive(scenario(bias), 1.0, still)
    t = np.array([m.t for _, m in run.imu])
    read = np.array([getattr(m, field) for _, m in run.imu])
    change = read[t > 0.5].mean(axis=0) - read[t < 0.49].mean(axis=0)
    expected = np.zeros(3)
    expected[index] = 0.2
    np.testing.assert_allclose(change, expected, atol=2e-3)


def test_wheels_of_the_wrong_size_count_a_longer_way_and_another_turn() -> None:
    """Each increment is scaled in the platform's frame: the counted path bends and stretches."""
    fine = {"resolution": (0.0, 0.0, 0.0), "delay": 0.0}
    sensors = {**SILENT_SENSORS, "odometry": {**fine, "scale": (1.10, 0.95)}}
    run = drive(scenario(sensors=sensors, platform_start=(0.3, -0.2, 0.5)), 2.0, curve)
    counted = np.array([m.pose for _, m in run.odometry])
    at = [round(1000 * m.t) for _, m in run.odometry]
    true, velocity = run.pose, run.velocity
    np.testing.assert_allclose(counted[:, 2] - 0.5, 0.95 * (true[at, 2] - 0.5), atol=1e-9)
    assert np.abs(true[:, 2] - 0.5).max() > 0.2
    # the same path by integrating the true speed, as the wheels see it, along the counted heading
    heading = 0.5 + 0.95 * (true[:, 2] - 0.5)
    c, s = np.cos(heading - true[:, 2]), np.sin(heading - true[:, 2])
    speed = 1.10 * np.stack(
        [c * velocity[:, 0] - s * velocity[:, 1], s * velocity[:, 0] + c * velocity[:, 1]], axis=1
    )
    way = np.array([0.3, -0.2]) + np.concatenate([np.zeros((1, 2)), 1e-3 * np.cumsum(speed, 0)])
    np.testing.assert_allclose(counted[:, :2], way[at], atol=2e-3)


def test_a_wrong_scale_does_not_make_the_wheels_feel_slip() -> None:
    """What slips is not counted, whatever the scale."""
    slip = {"kind": "slip", "t": 0.3, "duration": 0.3, "distance": 0.05}
    sensors = {**SILENT_SENSORS, "odometry": {"scale": (2.0, 2.0)}}
    run = drive(scenario(slip, sensors=sensors), 1.0, still)
    assert run.pose[-1, 0] > 0.045
    assert np.abs(np.array([m.pose[:2] for _, m in run.odometry])).max() < 0.01


# --- inertial sensor ------------------------------------------------------------------------


def test_imu_stamp_is_the_middle_of_its_period(driven: Recording) -> None:
    """A reading is the mean over 10 ms; it is stamped in their middle and is 10 ms late there."""
    for arrived, message in driven.imu[1:]:
        end = round(1000 * (message.t + 0.005))
        turned = driven.pose[end, 2] - driven.pose[end - 10, 2]
        assert message.gyro[2] == pytest.approx(turned / 0.01, abs=1e-9)
        assert arrived - message.t == pytest.approx(0.010, abs=0.0011)


def test_accelerometer_integrates_to_the_velocity_change(driven: Recording) -> None:
    """Readings, turned into the world and freed of the lever arm, add up to the velocity."""
    px, py = driven.simulator.physics.robot.imu.position[:2]
    messages = [m for _, m in driven.imu[1:]]
    total = np.zeros(2)
    for m in messages:
        heading = driven.pose[round(1000 * m.t), 2]
        c, s = math.cos(heading), math.sin(heading)
        total += 0.01 * np.array([c * m.accel[0] - s * m.accel[1], s * m.accel[0] + c * m.accel[1]])
    first, last = (
        round(1000 * (m.t + d)) for m, d in ((messages[0], -0.005), (messages[-1], 0.005))
    )

    def of_sensor(tick: int) -> np.ndarray:
        """Velocity of the sensor in W."""
        vx, vy, w = driven.velocity[tick]
        c, s = math.cos(driven.pose[tick, 2]), math.sin(driven.pose[tick, 2])
        return np.array([vx - w * (s * px + c * py), vy + w * (c * px - s * py)])

    change = of_sensor(last) - of_sensor(first)
    np.testing.assert_allclose(total, change, atol=1e-3)
    assert np.abs(np.diff(driven.velocity[:, 0])).sum() > 0.3


def test_accelerometer_reads_gravity_and_the_bump() -> None:
    """At rest it reads g upwards; a bump's vertical acceleration is on top."""
    bump = {"kind": "bump", "t": 0.5, "duration": 0.3, "amplitude": 3.0, "frequency": 10.0}
    run = drive(scenario(bump), 1.0, still)
    t = np.array([m.t for _, m in run.imu])
    up = np.array([m.accel[2] for _, m in run.imu])
    calm = (t < 0.49) | (t > 0.81)
    np.testing.assert_allclose(up[calm], 9.81, atol=1e-9)
    # a mean over a tenth of the vibration's period keeps 98 % of it
    assert up.max() - 9.81 == pytest.approx(3.0, rel=0.1)


def test_gravity_leaks_along_a_tilted_floor_and_turns_with_the_heading() -> None:
    """Uphill the accelerometer reads more; the leak is fixed in W, and the platform stays put."""
    tilt, (rx, ry) = (0.02, -0.01), (9.81 * math.sin(0.02), -9.81 * math.sin(0.01))
    for heading in (0.0, 2.0):
        made = scenario(floor_tilt=tilt, platform_start=(0.0, 0.0, heading))
        run = drive(made, 0.3, still)
        read = np.array([m.accel for _, m in run.imu])
        c, s = math.cos(heading), math.sin(heading)
        expected = [c * rx + s * ry, -s * rx + c * ry]
        np.testing.assert_allclose(read[:, :2], np.tile(expected, (len(read), 1)), atol=1e-9)
        np.testing.assert_allclose(np.linalg.norm(read, axis=1), 9.81, atol=1e-9)
        np.testing.assert_allclose(run.pose[-1], [0.0, 0.0, heading], atol=1e-9)


def test_a_sensor_mounted_on_its_side_reads_along_its_own_axes() -> None:
    """With x of the sensor up, gravity is on its x and the turn is on its gyro's x."""
    robot = load_robot("xr4000_puma560")
    upright = {"rotation": (0.0, -math.pi / 2, 0.0), "gyro_bias": 0.0, "accel_bias": 0.0}
    turned = robot.model_copy(update={"imu": robot.imu.model_copy(update=upright)})
    sensor = ImuSensor(turned, Sensors(), 0.0, np.random.default_rng(0))
    read = []
    for tick in range(50):
        now = 0.001 * tick
        pose, velocity = np.array([0.0, 0.0, 0.5 * now]), np.array([0.0, 0.0, 0.5])
        read += sensor.step(now, pose, velocity, np.zeros(3), NONE)
    np.testing.assert_allclose(read[-1].gyro, [0.5, 0.0, 0.0], atol=1e-9)
    assert read[-1].accel[0] == pytest.approx(9.81)


# --- arm ------------------------------------------------------------------------------------


def test_encoders_are_quantised_and_rates_are_their_difference() -> None:
    """Positions are multiples of the resolution; rates are differences over 1 ms."""
    run = drive(scenario(), 0.2, still, torque=lambda _: np.zeros(6))
    q = np.array([m.q for m in run.arm])
    counts = q / 2.5e-5
    np.testing.assert_allclose(counts, np.round(counts), atol=1e-6)
    qd = np.array([m.qd for m in run.arm])
    np.testing.assert_allclose(qd[1:], np.diff(q, axis=0) / 0.001, atol=1e-9)
    assert np.abs(qd).max() > 0.1


def test_brakes_hold_an_arm_without_a_master() -> None:
    """Without a command for 20 ms the joints stand, against gravity and a push."""
    push = {"kind": "push", "t": 0.2, "duration": 0.3, "force": 100.0, "on": "link3"}
    never = drive(scenario(push), 0.6, still)
    q = np.array([m.q for m in never.arm])
    assert np.abs(q - q[0]).max() < 1e-4

    def dies(t: float) -> np.ndarray | None:
        return np.zeros(6) if t < 0.15 else None

    left = drive(scenario(), 0.6, still, torque=dies)
    q = np.array([m.q for m in left.arm])
    assert np.abs(q[170] - q[0]).max() > 0.01  # it fell as long as a zero command was fresh
    assert np.abs(q[-1] - q[300]).max() < 1e-4
    assert np.abs(q[300] - q[170]).max() < 0.05


def test_motors_clamp_the_torque() -> None:
    """What is applied stays within the description, and the arm state says so."""
    run = drive(scenario(), 0.02, still, torque=lambda _: 1000.0 * np.ones(6))
    limit = np.array(run.simulator.physics.robot.arm.torque_limit)
    np.testing.assert_allclose(run.arm[-1].tau, limit)


# --- determinism ----------------------------------------------------------------------------


def fingerprint(seed: int) -> list[bytes]:
    """Everything a disturbed run says, bit by bit."""
    made = scenario(
        {"kind": "push", "t": 0.1, "force": 200.0},
        {"kind": "bump", "t": 0.2, "yaw": 1.0},
        sensors={"odometry": {"noise": (1e-3, 1e-3, 1e-3), "dropout": 0.2}},
        exact=False,
    )
    run = drive(made, 0.5, curve, seed=seed)
    out = [x.pose.tobytes() + x.q.tobytes() + x.velocity.tobytes() for x in run.truth]
    out += [m.pose.tobytes() for _, m in run.odometry]
    out += [m.gyro.tobytes() + m.accel.tobytes() for _, m in run.imu]
    return out + [m.q.tobytes() + m.wrench.tobytes() for m in run.arm]


def test_seed_decides_every_bit() -> None:
    """Equal seeds say the same to the last bit; another seed says something else everywhere."""
    assert fingerprint(4) == fingerprint(4)
    a, b = fingerprint(4), fingerprint(5)
    assert sum(x == y for x, y in zip(a, b, strict=False)) < 0.1 * len(a)


def test_noise_drawn_in_blocks_is_noise_drawn_call_by_call() -> None:
    """To the last bit, over the ends of blocks."""
    spread = np.array([0.5, 0.0, 3.0])
    rows, rng = normal_rows(np.random.default_rng(4), spread), np.random.default_rng(4)
    for _ in range(2 * BLOCK + 1):
        np.testing.assert_array_equal(next(rows), spread * rng.standard_normal(3))
