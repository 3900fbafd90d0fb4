"""What a log tells of its robot: a skid-steer one with all oddities, and simpler ones."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from observer.bench.manoeuvres import sway
from observer.bench.world import simulate
from observer.recordings.diagnosis import Diagnosis, diagnose
from observer.recordings.frames import in_B, level, matrix_of, rpy_of
from observer.recordings.load import load_recording
from observer.recordings.log import Log
from observer.recordings.prepare import prepare
from observer.recordings.recording import Recording, Samples
from observer.recordings.resolution import resolution
from observer.recordings.rest import rough
from observer.recordings.verdicts import verdicts
from tests.observer.recordings_files import imu_columns, in_sensor, odometry_columns, write_csv
from tests.observer.recordings_help import recorded
from tests.observer.recordings_motion import BASE, course, logged

DESCRIPTION = """
name = "skid"
time = "t"
[odometry]
file = "odom.csv"
x = "x"
y = "y"
quaternion = ["qz", "qw"]
[speeds]
file = "odom.csv"
vx = "vx"
w = "wz"
[imu]
file = "imu.csv"
gyro = ["gx", "gy", "gz"]
accel = ["ax", "ay", "az"]
[reference]
file = "gps.csv"
latitude = "lat"
longitude = "lon"
sigma = 0.5
"""


@pytest.fixture(scope="module")
def skid(tmp_path_factory: pytest.TempPathFactory) -> tuple[Log, Diagnosis]:
    """Side-mounted IMU at 30 Hz stamped 100 ms late, twist a mean over 1 s, heading 4.5 % short."""
    folder: Path = tmp_path_factory.mktemp("skid")
    rng = np.random.default_rng(0)
    true = course(11, 150.0, yaw=0.25, speed=0.8, turning=0.1, stops=((70.0, 76.0),))
    r = logged(
        true,
        3,
        odometry_rate=10.0,
        imu_rate=30.0,
        delay=-0.1,
        resolution=(0.0, 0.0, 0.0),
        gyro_noise=2.5e-3,
        accel_noise=0.1,
        bias=-4e-4,
    )
    assert r.odometry is not None and r.imu is not None
    # odometry integrates its own, wrong, heading: what the wheels slip is a random walk on top
    t = r.odometry.t
    at = true.at(t + 0.1)
    turned, ahead = np.diff(at[:, 2]) * 0.955, np.hypot(*np.diff(at[:, :2], axis=0).T)
    turned += 6e-4 * rng.standard_normal(len(t) - 1) * (ahead > 1e-4)
    heading = np.concatenate([[0.0], np.cumsum(turned)])
    middle = 0.5 * (heading[1:] + heading[:-1])
    x = np.concatenate([[0.0], np.cumsum(ahead * np.cos(middle))])
    y = np.concatenate([[0.0], np.cumsum(ahead * np.sin(middle))])
    o = odometry_columns(r) | {"x": x, "y": y, "qz": np.sin(heading / 2), "qw": np.cos(heading / 2)}
    del o["yaw"]
    n = 10
    o["wz"], o["vx"] = np.zeros_like(t), np.zeros_like(t)
    o["wz"][n:] = (heading[n:] - heading[:-n]) / (t[n:] - t[:-n])
    way = np.concatenate([[0.0], np.cumsum(ahead)])
    o["vx"][n:] = (way[n:] - way[:-n]) / (t[n:] - t[:-n])
    write_csv(folder / "odom.csv", o)
    i = imu_columns(r)
    # the sensor's x is B's -y, its y is up, its z is B's -x
    axes = ((1, -1.0), (2, 1.0), (0, -1.0))
    gyro, accel = in_sensor(r.imu.values[:, :3], axes), in_sensor(r.imu.values[:, 3:], axes)
    i = {"t": i["t"]} | dict(zip(("gx", "gy", "gz"), gyro.T, strict=True))
    i |= dict(zip(("ax", "ay", "az"), accel.T, strict=True))
    write_csv(folder / "imu.csv", i)
    s = np.arange(0.2, true.t[-1] - 0.2, 0.4)
    p = true.at(s)[:, :2] + 0.5 * rng.standard_normal((len(s), 2))
    lat = 42.0 + np.degrees(p[:, 1] / 6.37e6)
    lon = -71.0 + np.degrees(p[:, 0] / 6.378e6 / math.cos(math.radians(42.0)))
    write_csv(folder / "gps.csv", {"t": s, "lat": lat, "lon": lon})
    (folder / "log.toml").write_text(DESCRIPTION)
    log = load_recording(folder / "log.toml")
    return log, diagnose(log)


def test_skid_steer_mounting(skid: tuple[Log, Diagnosis]) -> None:
    """Up is +y by gravity and forward -z by the accelerometer."""
    found = skid[1].inertial
    assert found is not None
    assert (found.mounting.up, found.mounting.forward) == ("+y", "-z")
    R = np.array([[0.0, 0.0, -1.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    assert pytest.approx(R, abs=0.05) == found.mounting.R_BI


def test_skid_steer_delays_and_scale(skid: tuple[Log, Diagnosis]) -> None:
    """The pose leads by 100 ms; the twist is its mean over 1 s, so 400 ms behind the gyro."""
    found = skid[1]
    assert found.odometry_delay.otherwise(9.0) == pytest.approx(-0.1, abs=5e-3)
    assert found.average_by_pose is not None and found.average_by_gyro is not None
    assert found.average_by_pose.box.otherwise(0.0) == pytest.approx(1.0, abs=0.02)
    assert found.average_by_pose.delay.otherwise(0.0) == pytest.approx(0.5, abs=0.01)
    assert found.average_by_gyro.box.otherwise(0.0) == pytest.approx(1.0, abs=0.1)
    assert found.speeds_delay.otherwise(0.0) == pytest.approx(0.4, abs=0.02)
    assert found.pose is not None and found.pose.scale.otherwise(0.0) == pytest.approx(
        0.955, abs=0.01
    )


def test_skid_steer_trusts_the_gyro(skid: tuple[Log, Diagnosis]) -> None:
    """Judged by GPS, the gyro's heading under odometry's steps beats the pose."""
    found = skid[1]
    assert found.use == "speed" and found.paths is not None
    assert found.paths["gyro heading"] < 0.5 * found.paths["pose"]
    assert found.distance is not None and not found.distance.beyond(1.0, 0.02)
    assert found.gyro_bias.otherwise(9.0) == pytest.approx(-4e-4, abs=5e-4)


def test_skid_steer_in_words(skid: tuple[Log, Diagnosis]) -> None:
    """Every finding is said, the serious ones first."""
    said = [str(v) for v in verdicts(skid[1], skid[0].findings, {"odometry": 9.1, "imu": 3.1})]
    text = "\n".join(said)
    for part in (
        'accelerometer reads gravity on y: mounted on its side; up = "+y"',
        'the IMU looks forward along "-z"',
        "ms ahead of the gyro",
        "speeds are the mean of the pose over the last 1.00 s",
        "times as far as the gyro",
        "odometry's heading is not to be trusted",
        "the IMU gives 30 readings a second",
        "filter over-confident: NIS of odometry 9.1 where 3 is right",
        "filter about as sure as it should be: NIS of imu 3.1 where 3 is right",
    ):
        assert part in text, part
    severities = [v.severity for v in verdicts(skid[1])]
    assert severities == sorted(severities, key=["warning", "note"].index)


def test_skid_steer_made_ready(skid: tuple[Log, Diagnosis]) -> None:
    """IMU in B without bias and on odometry's clock; speeds from steps, half-way between poses."""
    log, found = skid
    ready = prepare(log, found)
    assert ready.odometry is None and ready.speeds is not None and ready.imu is not None
    assert log.odometry is not None and log.imu is not None
    assert ready.imu.t[0] == pytest.approx(log.imu.t[0] - 0.1, abs=5e-3)
    assert np.mean(ready.imu.values[:, 5]) == pytest.approx(9.81, abs=0.02)
    assert np.all(ready.imu.arrival >= ready.imu.t)
    assert ready.base.imu.rotation == (0.0, 0.0, 0.0)
    assert ready.base.odometry.scale[1] == pytest.approx(0.955, abs=0.01)
    assert ready.base.platform.lag >= 1000.0
    moved = np.sum(ready.speeds.values[:, 0]) * ready.speeds.period
    assert moved == pytest.approx(
        np.hypot(*np.diff(log.odometry.values[:, :2], axis=0).T).sum(), 0.02
    )
    # the gyro and the wheels now agree at the same stamps
    w = np.interp(ready.speeds.t, ready.imu.t, ready.imu.values[:, 2])
    assert np.corrcoef(w, ready.speeds.values[:, 2])[0, 1] > 0.98


def test_our_robot_needs_nothing() -> None:
    """A recording of our own: on time, pose used, nothing of its description changes but delays."""
    world = simulate(sway, 1, 21.0)
    r = recorded(world)
    found = diagnose(r)
    assert found.use == "pose" and not found.bias_steps
    assert found.wheels is not None
    assert found.wheels.resolution == pytest.approx((1e-3, 1e-3, math.radians(0.1)), rel=1e-3)
    assert found.drive is not None
    assert found.drive.lag.otherwise(9.0) == pytest.approx(world.truth.platform.lag, abs=0.03)
    ready = prepare(r, found)
    assert ready.odometry is not None and r.odometry is not None
    assert ready.odometry.t == pytest.approx(r.odometry.t, abs=2e-3)
    assert ready.base.platform == r.base.platform and ready.base.imu == r.base.imu
    assert not [v for v in verdicts(found) if v.severity != "note"]


def test_a_found_delay_is_taken_off_the_stamps() -> None:
    """180 ms late: after `prepare` on time to 2 ms, and never before it arrived."""
    r = recorded(simulate(sway, 2, 21.0, stamp_error=0.18))
    ready = prepare(r, diagnose(r))
    assert ready.odometry is not None and r.odometry is not None
    assert ready.odometry.t == pytest.approx(r.odometry.t - 0.18, abs=2e-3)
    assert np.all(ready.odometry.arrival >= ready.odometry.t)
    assert abs(diagnose(ready).odometry_delay.otherwise(9.0)) < 1e-3


@pytest.mark.parametrize("size", [-0.1])
def test_a_bias_that_moves_is_seen_in_motion(size: float) -> None:
    """0.1 deg/s at 41 s, in a robot that never stands: instant and size; nothing where it stays."""
    r = logged(course(3, 55.0), 5)
    assert r.imu is not None
    assert not diagnose(r).bias_steps
    r.imu.values[:, 2] += math.radians(size) * (r.imu.t > 41.0)
    found = diagnose(r)
    (step,) = found.bias_steps
    assert step.at == pytest.approx(41.0, abs=1.0)
    assert step.size.otherwise(9.0) == pytest.approx(math.radians(size), abs=2e-4)
    assert any(f"moved by {size:+.2f} deg/s at 41 s" in v.text for v in verdicts(found))


def test_bias_and_noise_at_rest() -> None:
    """Two stands tell bias and noise, and that the bias moved between them."""
    r = logged(course(8, 60.0, stops=((10.0, 16.0), (40.0, 46.0))), 6, bias=2e-3)
    assert r.imu is not None
    found = diagnose(r)
    assert found.inertial is not None and len(found.inertial.stands) == 2
    assert found.gyro_bias.otherwise(9.0) == pytest.approx(2e-3, abs=2e-4)
    assert found.inertial.gyro_noise.otherwise(9.0) == pytest.approx(9e-4, rel=0.1)
    assert found.inertial.accel_noise.otherwise(9.0) == pytest.approx(0.03, rel=0.1)
    r.imu.values[:, 2] += 3e-3 * (r.imu.t > 30.0)
    (step,) = diagnose(r).bias_steps
    assert step.standing and step.size.otherwise(9.0) == pytest.approx(3e-3, abs=3e-4)


@pytest.mark.parametrize("rpy", [(0.0, 0.0, 0.0), (math.pi, 0.0, 0.5), (1.5, 0.2, -2.0)])
def test_any_mounting_is_found(rpy: tuple[float, float, float]) -> None:
    """Level, upside down, askew: what is read, turned back, is what B feels, to 2 degrees."""
    r = logged(course(9, 30.0, sideways=0.2), 7)
    assert r.imu is not None
    R = Rotation.from_euler("xyz", rpy).as_matrix()
    turned = in_B(r.imu, R.T)
    log = Log(
        name="askew",
        base=BASE,
        odometry=r.odometry,
        imu=turned,
        auto=frozenset({"imu.up", "imu.forward"}),
    )
    found = diagnose(log).inertial
    assert found is not None and found.mounting.forward
    off = Rotation.from_matrix(found.mounting.R_BI @ R.T).magnitude()
    assert math.degrees(off) < 2.0


def test_forward_that_cannot_be_told_is_said() -> None:
    """A robot that turns on the spot: up by gravity, forward unknown, accelerometer not used."""
    r = logged(course(10, 40.0, yaw=0.5, speed=0.0), 8, accel_noise=0.2)
    log = Log(
        name="spot",
        base=BASE,
        odometry=r.odometry,
        imu=r.imu,
        auto=frozenset({"imu.up", "imu.forward", "imu.accel_noise"}),
    )
    found = diagnose(log)
    assert found.inertial is not None and not found.inertial.mounting.forward
    assert any(v.code == "forward" and v.severity == "warning" for v in verdicts(found))
    assert prepare(log, found).base.imu.accel_noise >= 10.0


def test_speeds_alone_will_do() -> None:
    """No pose: the twist's own delay is found and taken off."""
    r = logged(course(12, 40.0), 9)
    assert r.odometry is not None
    o, true = r.odometry, course(12, 40.0)
    t = o.t
    w = np.interp(t, true.t, true.rate)
    values = np.column_stack([np.full_like(t, 0.4), 0 * t, w])
    late = Samples(t + 0.07, t + 0.08, values)
    only = Recording(name="twist", base=BASE, speeds=late, imu=r.imu)
    found = diagnose(only)
    assert found.use == "speed"
    assert found.speeds_delay.otherwise(9.0) == pytest.approx(0.07, abs=1e-3)
    ready = prepare(only, found)
    assert ready.speeds is not None and ready.speeds.t == pytest.approx(t, abs=1e-3)


def test_odometry_alone_will_do() -> None:
    """No IMU: timing and rounding are told, the rest is not made up."""
    r = logged(course(13, 20.0), 9)
    found = diagnose(Recording(name="wheels", base=BASE, odometry=r.odometry))
    assert found.pose is None and found.inertial is None and not found.odometry_delay.told
    assert found.wheels is not None and found.wheels.resolution[0] == pytest.approx(1e-3)
    assert verdicts(found)


def test_gaps_leaps_and_repetitions_are_said() -> None:
    """A pause of 1.2 s, a leap of 0.5 m, every pose twice."""
    r = logged(course(14, 40.0), 10)
    o = r.odometry
    assert o is not None
    keep = ~((o.t > 12.0) & (o.t < 13.2))
    values = o.values.copy()
    values[o.t > 25.0, 0] += 0.5
    values[1::2] = values[::2][: len(values[1::2])]
    odd = Samples(o.t[keep], o.arrival[keep], values[keep])
    text = "\n".join(v.text for v in verdicts(diagnose(Recording("odd", BASE, odometry=odd))))
    assert "odometry pauses once for 1." in text
    assert "odometry leaps by 0.5" in text
    assert "% of poses repeat the one before in full motion" in text


def test_no_recording_is_too_short_or_too_dull() -> None:
    """Few samples, constant ones, sensors that are missing: always a diagnosis, never a fault."""
    whole = logged(course(15, 12.0), 11)
    assert whole.odometry is not None and whole.imu is not None
    rng = np.random.default_rng(4)
    for _ in range(30):
        parts = []
        for sensor in (whole.odometry, whole.imu):
            n = int(rng.choice([0, 1, 5, 11, 60, len(sensor)]))
            values = sensor.values[:n] * rng.choice([0.0, 1.0])
            parts.append(Samples(sensor.t[:n], sensor.arrival[:n], values) if n else None)
        as_speeds = rng.random() < 0.3
        r = Recording("short", BASE, *((None, parts[0]) if as_speeds else (parts[0], None)))
        r = replace(r, imu=parts[1], commands=r.odometry, reference=r.odometry)
        found = diagnose(r)
        assert verdicts(found) is not None and prepare(r, found).base is not None


@pytest.mark.parametrize("step", [1e-3, 0.02, math.radians(0.1)])
def test_the_step_of_rounding_is_told_by_the_values(step: float) -> None:
    """Also where it was written with few digits; none where values are not rounded."""
    rng = np.random.default_rng(1)
    x = np.cumsum(0.01 * rng.standard_normal(600))
    rounded = np.round(x / step) * step
    assert resolution(rounded) == pytest.approx(step, rel=1e-6)
    assert resolution(np.round(rounded, 6)) == pytest.approx(step, rel=1e-3)
    assert resolution(x) == 0.0
    assert resolution(np.zeros(50)) is None


def test_noise_is_told_from_smooth_motion() -> None:
    """Uneven sampling of a fast sine leaves nothing; noise on it comes out."""
    rng = np.random.default_rng(2)
    t = np.cumsum(rng.uniform(0.008, 0.012, 4000))
    x = np.sin(2 * np.pi * t)
    assert rough(t, x) < 1e-4
    assert rough(t, x + rng.normal(0, 0.01, len(t))) == pytest.approx(0.01, rel=0.05)


def test_rotations_by_name_and_by_angle_agree() -> None:
    """Level builds a rotation whose rows are B's axes in the sensor; angles give it back."""
    R = level(np.array([0.1, 9.8, 0.0]), np.array([0.0, 0.0, -1.0]))
    assert pytest.approx(np.eye(3), abs=1e-12) == R @ R.T
    assert np.linalg.det(R) == pytest.approx(1.0)
    assert matrix_of(rpy_of(R)) == pytest.approx(R, abs=1e-12)
