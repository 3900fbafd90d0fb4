"""A recording through the observer, against its reference, and down to its noise."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from deploy.robot import MobileBase
from observer.bench.world import simulate
from observer.commands import STILL, CommandHistory
from observer.observer import make_observer
from observer.recordings.drive import SILENCE
from observer.recordings.innovations import innovations, measurements
from observer.recordings.likelihood import Likelihood
from observer.recordings.part import cut, liveliest
from observer.recordings.recording import Recording, Samples
from observer.recordings.run import Track, collect, odometry_track, replay, span
from observer.recordings.score import align, score
from observer.recordings.tune import Tuning, tune
from services.messages import Array
from services.replays.run import observer_for
from tests.observer.recordings_help import recorded


def sway(t: float) -> tuple[float, float, float]:
    """A command that excites all three axes."""
    return (
        0.25 * math.sin(1.9 * t),
        0.25 * math.sin(1.3 * t + 1.0),
        0.3 * math.sin(1.0 * t + 2.0),
    )


@pytest.fixture(scope="module")
def swaying() -> Recording:
    """Twelve seconds of sway."""
    return recorded(simulate(sway, 5, 12.0))


def moved(t: Array, angle: float, shift: tuple[float, float]) -> Array:
    """A pose on an eight (n, 3), in a frame that is turned and shifted."""
    x, y = 2.0 * np.sin(0.5 * t), np.sin(t)
    c, s = math.cos(angle), math.sin(angle)
    heading = np.arctan2(np.gradient(y, t), np.gradient(x, t)) + angle
    return np.column_stack([c * x - s * y + shift[0], s * x + c * y + shift[1], heading])


# --- score ----------------------------------------------------------------------------------


def test_alignment_finds_the_frame_of_the_reference() -> None:
    """A track that differs by a rigid motion alone has no error."""
    t = np.arange(0.0, 12.0, 0.01)
    track = Track(t, moved(t, 0.0, (0.0, 0.0)))
    reference = Samples(t, t, moved(t, 2.1, (5.0, -3.0)))
    found = score(track, reference)
    assert found.alignment.angle == pytest.approx(2.1)
    assert found.position_max < 1e-12
    assert found.heading_rms < 1e-12
    assert all(r.position < 1e-12 and r.heading < 1e-12 for r in found.relative)


def test_a_platform_that_stands_is_not_turned() -> None:
    """Noise of millimetres says nothing of where its frame points."""
    rng = np.random.default_rng(2)
    a, b = 1e-3 * rng.standard_normal((2, 50, 2))
    assert align(a, b + 3.0).angle == 0.0
    assert align(100.0 * a, b + 3.0).angle == 0.0


def test_no_other_alignment_is_nearer() -> None:
    """The mean square distance grows with any further turn or shift."""
    rng = np.random.default_rng(1)
    a, b = rng.standard_normal((2, 50, 2))
    best = align(a, b)

    def distance(turn: float, shift: tuple[float, float]) -> float:
        other = replace(best, angle=best.angle + turn, shift=best.shift + shift)
        return float(np.sum((other.apply(a) - b) ** 2))

    least = distance(0.0, (0.0, 0.0))
    for turn, shift in ((0.01, (0, 0)), (-0.01, (0, 0)), (0, (0.01, 0)), (0, (0, -0.01))):
        assert distance(turn, shift) > least


def test_relative_error_forgets_what_went_wrong_before() -> None:
    """A heading that jumps once spoils the absolute error, not the motion seconds later."""
    t = np.arange(0.0, 40.0, 0.05)
    straight = np.column_stack([0.5 * t, np.zeros_like(t), np.zeros_like(t)])
    bent = straight.copy()
    late = t > 20.0
    bent[late, :2] = [10.0, 0.0] + 0.5 * (t[late, None] - 20.0) * [math.cos(0.3), math.sin(0.3)]
    bent[late, 2] = 0.3
    found = score(Track(t, bent), Samples(t, t, straight))
    assert found.position_rms > 0.4
    second = found.relative[0]
    assert second.span == 1.0
    assert second.heading == pytest.approx(0.3 * math.sqrt(1.0 / 39.0), rel=0.1)
    assert second.position < 0.03


def test_a_reference_of_positions_has_no_heading() -> None:
    """GPS knows no heading: none is scored. What the track does not cover is left out."""
    t = np.arange(0.0, 12.0, 0.01)
    pose = moved(t, 0.0, (0.0, 0.0))
    hole = (t < 4.0) | (t > 8.0)
    found = score(Track(t[hole], pose[hole]), Samples(t, t, pose[:, :2]))
    assert math.isnan(found.heading_rms)
    assert found.instants == pytest.approx(800, abs=3)
    with pytest.raises(ValueError, match="at least 2"):
        score(Track(t[:1], pose[:1]), Samples(t, t, pose))


# --- run ------------------------------------------------------------------------------------


def test_the_observer_hears_a_measurement_when_it_arrived(swaying: Recording) -> None:
    """Hold shows it: at every tick the newest pose that had arrived, and none that had not."""
    o = swaying.odometry
    assert o is not None
    held = collect(replay(swaying, make_observer("hold", swaying.base)))
    newest = np.searchsorted(o.arrival, held.t + 1e-9, side="right") - 1
    np.testing.assert_allclose(held.pose[:, :2], o.values[newest, :2], atol=1e-12)
    assert held.t[-1] == pytest.approx(span(swaying)[1], abs=0.002)


def test_fusing_beats_holding(swaying: Recording) -> None:
    """On a recording as on the robot: tenths of a millimetre instead of millimetres."""
    assert swaying.reference is not None
    rms = {}
    for kind in ("ekf", "hold"):
        run = collect(replay(swaying, make_observer(kind, swaying.base)))
        rms[kind] = score(run.used, swaying.reference).position_rms
        assert (run.t >= run.t[0]).all() and run.covariance.shape == (len(run), 6, 6)
    assert rms["ekf"] < 0.7e-3
    assert rms["hold"] > 5e-3


def test_wheel_speeds_alone_give_a_track_from_zero(swaying: Recording) -> None:
    """Without poses the filter starts at zero and sums up; the reference is met all the same."""
    o = swaying.odometry
    assert o is not None and swaying.reference is not None
    dt = np.diff(o.t)
    step = np.diff(o.values, axis=0) / dt[:, None]
    middle = 0.5 * (o.values[1:, 2] + o.values[:-1, 2])
    c, s = np.cos(middle), np.sin(middle)
    v = np.column_stack([c * step[:, 0] + s * step[:, 1], c * step[:, 1] - s * step[:, 0]])
    speeds = Samples(o.t[1:] - 0.5 * dt, o.arrival[1:], np.column_stack([v, step[:, 2]]))
    only = replace(swaying, odometry=None, speeds=speeds)
    assert odometry_track(only) is None
    run = collect(replay(only, make_observer("ekf", only.base)))
    assert np.hypot(*run.pose[0, :2]) < 0.02
    track = Track(run.t, run.pose)  # never certain of its position: not valid, yet a track
    assert score(track, swaying.reference).position_rms < 0.02


def test_a_recording_that_says_nothing_is_refused(swaying: Recording) -> None:
    """Neither silence nor a tick of zero ends in an endless loop or a traceback of numpy's."""
    silent = replace(swaying, odometry=None, imu=None, commands=None)
    with pytest.raises(ValueError, match="no sensor says anything"):
        list(replay(silent, make_observer("ekf", silent.base)))
    with pytest.raises(ValueError, match="must be positive"):
        list(replay(swaying, make_observer("ekf", swaying.base), tick=0.0))
    deaf = replace(swaying, odometry=None)
    with pytest.raises(ValueError, match="never started"):
        collect(replay(deaf, make_observer("ekf", deaf.base)))


# --- innovations ----------------------------------------------------------------------------


def test_innovations_are_those_of_the_running_observer(swaying: Recording) -> None:
    """In the order of stamps or of arrival: the same innovation for the same odometry."""
    found = innovations(measurements(swaying), swaying.base)["odometry"]
    o = swaying.odometry
    assert o is not None
    # when the odometry of stamp t arrives, 20 ms late, IMU data newer than t are redone after it
    run = collect(replay(swaying, make_observer("ekf", swaying.base)))
    at = np.searchsorted(run.t, o.arrival[1:] - 1e-9)
    np.testing.assert_allclose(run.odometry_innovation[at], found.value, atol=1e-12)
    np.testing.assert_allclose(run.odometry_nis[at], found.nis, rtol=1e-9)


# --- tune -----------------------------------------------------------------------------------


def louder(base: MobileBase, gyro: float, accel: float) -> MobileBase:
    """The base with other IMU noise."""
    imu = base.imu
    noise = {"gyro_noise": gyro * imu.gyro_noise, "accel_noise": accel * imu.accel_noise}
    return base.model_copy(update={"imu": imu.model_copy(update=noise)})


@pytest.fixture(scope="module")
def tuned() -> tuple[MobileBase, Tuning]:
    """What was simulated, and what tuning made of it when told IMU noise three times wrong."""
    world = simulate(sway, 11, 9.0)
    recording = replace(recorded(world), base=louder(world.truth, gyro=0.3, accel=3.0))
    return world.truth, tune(recording, seconds=8.0)


def test_tuning_recovers_the_noise_of_the_imu(tuned: tuple[MobileBase, Tuning]) -> None:
    """Told three times too little and too much, it comes within 15 % of what was simulated."""
    true, found = tuned
    assert found.base.imu.gyro_noise == pytest.approx(true.imu.gyro_noise, rel=0.15)
    assert found.base.imu.accel_noise == pytest.approx(true.imu.accel_noise, rel=0.15)
    assert found.log_likelihood[1] > found.log_likelihood[0] + 100.0
    assert found.nis["imu"][1] == pytest.approx(3.0, abs=0.3)


def test_tuning_recovers_the_drive(tuned: tuple[MobileBase, Tuning]) -> None:
    """Lag and disturbance are told by the same data."""
    true, found = tuned
    assert found.base.platform.lag == pytest.approx(true.platform.lag, rel=0.15)
    for mine, theirs in zip(
        found.base.platform.disturbance, true.platform.disturbance, strict=True
    ):
        assert mine == pytest.approx(theirs, rel=0.35)


def test_what_rounding_hides_is_left_as_described(tuned: tuple[MobileBase, Tuning]) -> None:
    """Noise of odometry far below its step cannot be told, and is not made up."""
    true, found = tuned
    hidden = [t for t in found.tuned if t.parameter.name.startswith("odometry.noise")]
    assert [t.told for t in hidden] == [False, False]
    assert all(t.after == t.before for t in hidden)
    assert found.base.odometry == true.odometry


def test_a_lag_that_is_hardly_told_is_left(
    swaying: Recording, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Noise may be raised on weak evidence, the lag may not."""

    def hardly(function: Likelihood, _: Array | None = None) -> tuple[Array, Array]:
        return function.origin + 5.0, np.full(len(function.origin), 2.0)

    monkeypatch.setattr("observer.recordings.tune._largest", hardly)
    found = tune(swaying, seconds=5.0)
    assert [t.parameter.name for t in found.tuned if not t.told] == ["platform.lag"]
    assert found.base.platform.lag == swaying.base.platform.lag


def test_tuning_uses_the_liveliest_part(swaying: Recording) -> None:
    """A stretch at rest is passed over."""
    o = swaying.odometry
    assert o is not None
    still = o.values.copy()
    still[o.t < 6.0] = still[0]
    calm = replace(swaying, odometry=replace(o, values=still))
    start, end = liveliest(calm, 5.0)
    assert 5.0 <= start <= 7.0
    assert end - start == pytest.approx(5.0)
    assert liveliest(calm, 100.0)[0] == o.t[0]
    part = cut(calm, start, end)
    assert part.imu is not None and part.imu.t.min() >= start and part.imu.t.max() < end


def test_too_little_to_tune_by_is_refused(swaying: Recording) -> None:
    """Seconds without end, or hardly any data: said, not tried."""
    with pytest.raises(ValueError, match="5 s at least"):
        tune(swaying, seconds=1.0)
    sparse = cut(replace(swaying, imu=None, commands=None), 0.0, 2.0)
    with pytest.raises(ValueError, match="noise takes"):
        tune(sparse)


# --- details --------------------------------------------------------------------------------


def test_commands_cease_for_the_drive_when_they_do_for_the_observer() -> None:
    """One watchdog: where the filter takes the drive to stop, the fit of the drive does."""
    history = CommandHistory()
    history.insert(0.0, (1.0, 0.0, 0.0))
    assert history.at(SILENCE - 1e-6) != STILL
    assert history.at(SILENCE) == STILL


def test_a_part_leaves_out_sensors_that_were_silent_in_it(swaying: Recording) -> None:
    """Fewer than two samples are none."""
    part = cut(swaying, 2.0, 2.02)
    assert part.odometry is None
    assert part.imu is not None and len(part.imu) > 1


def test_a_slow_sensor_is_not_called_silent() -> None:
    """An IMU of 10 Hz that comes 0.15 s late is as usual; when it ceases, that is said."""
    world = recorded(simulate(sway, 5, 8.0))
    assert world.imu is not None
    keep = (np.arange(len(world.imu)) % 20 == 0) & (world.imu.t < 6.0)
    slow = Samples(world.imu.t[keep], world.imu.t[keep] + 0.15, world.imu.values[keep])
    late = replace(world, imu=slow)
    run = collect(replay(late, observer_for("ekf", late), 0.01))
    silent = np.array(["imu silent" in text for text in run.reason])
    assert slow.period > 0.05
    assert not silent[(run.t > 1.0) & (run.t < 6.0)].any()
    assert silent[run.t > 7.0].all()
