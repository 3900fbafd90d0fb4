"""What the page shows, before it is drawn: errors, ink, restarts, windows of time."""

from __future__ import annotations

import numpy as np
import pytest

from services.console.feed import Feed, between, inverse, moved
from services.console.ink import Ink
from services.console.track import RATE, SPAN, Track
from services.console.words import services
from services.messages import ArmStatus, Estimate, Health, Truth
from services.topics import ARM_STATUS, ESTIMATE, HEALTH, TRUTH


def estimate(t: float, pose: np.ndarray) -> Estimate:
    """Of a standing platform, odometry off by 2 mm at 1 mm of deviation."""
    zero = np.zeros(3)
    return Estimate(
        t=t,
        pose=pose,
        velocity=zero,
        acceleration=zero,
        covariance=np.eye(6) * 1e-6,
        gyro_bias=0.0,
        accel_bias=np.zeros(2),
        odometry_innovation=np.array([2e-3, 0.0, 0.0]),
        odometry_nis=1.0,
        imu_innovation=zero,
        imu_nis=1.0,
        odometry_age=0.0,
        imu_age=0.0,
        command_age=0.0,
        odometry_deviation=np.array([1e-3, 1e-3, 1e-3]),
    )


def truth(
    t: float, pose: np.ndarray, tip: np.ndarray | None = None, contact: bool = False
) -> Truth:
    """Of a platform that drives ahead at 1 m/s."""
    zero = np.zeros(3)
    velocity = np.array([1.0, 0.0, 0.0])
    q = np.zeros(6)
    return Truth(t, pose, velocity, zero, q, q, zero if tip is None else tip, 0.0, contact)


@pytest.mark.parametrize("truth_first", [True, False])
def test_the_error_is_that_of_one_instant(truth_first: bool) -> None:
    """At 1 m/s an estimate right to 1 mm is off by 1 mm, whichever of the two is heard first."""
    feed = Feed()
    said = [(TRUTH, truth(t, np.array([t, 0.0, 0.0]))) for t in np.arange(0.0, 0.5, 0.005).tolist()]
    believed = [
        (ESTIMATE, estimate(t, np.array([t + 1e-3, 0.0, 0.0])))
        for t in np.arange(0.002, 0.498, 0.04).tolist()
    ]
    # as a bus that is emptied topic by topic gives them, some tens of milliseconds at once
    for start in np.arange(0.0, 0.5, 0.05):
        for series in (said, believed) if truth_first else (believed, said):
            for topic, message in series:
                if start <= message.t < start + 0.05:
                    feed.hear(topic, message, message.t)
    _, x, y, *_ = feed.tracks["error"].window(0.0, 1.0)
    assert len(x) > 5
    assert np.allclose(x, 1.0, atol=1e-6) and np.allclose(y, 0.0)
    assert np.allclose(feed.error, [1e-3, 0.0, 0.0])


def test_innovations_are_in_deviations_and_nothing_where_there_are_none() -> None:
    """2 mm of innovation at 1 mm is 2; without a deviation there is no line, not infinity."""
    feed = Feed()
    feed.hear(ESTIMATE, estimate(1.0, np.zeros(3)), 1.0)
    assert feed.tracks["odometry"].window(0.0, 2.0)[1] == pytest.approx([2.0])
    assert np.isnan(feed.tracks["imu"].window(0.0, 2.0)[1]).all()


def test_restarts_are_those_the_service_tells_of() -> None:
    """Also of a page that began to listen after them."""
    feed = Feed()
    feed.hear(HEALTH["arm"], Health(t=1.0, service="arm", state="idle", restarts=2), 1.0)
    (row,) = [line for line in services(feed, 1.0).splitlines() if line.startswith("| arm |")]
    assert row.endswith("| 2 |")


def test_another_run_begins_with_an_empty_board_and_empty_plots() -> None:
    """Robot time that goes back by more than a second is another robot, or the same one anew."""
    feed = Feed()
    for i in range(100):
        feed.hear(TRUTH, truth(10 + i * 0.005, np.zeros(3), np.array([i * 2e-3, 0, 0]), True), 0.0)
    assert feed.ink.length == pytest.approx(0.198)
    feed.hear(TRUTH, truth(0.1, np.zeros(3)), 0.0)
    assert feed.ink.length == 0.0 and feed.t == 0.1


def test_ink_is_where_the_pen_touched_and_nowhere_else() -> None:
    """Two strokes of 100 mm with a gap: 200 mm, and what was not heard is not made up."""
    feed = Feed()
    t = 0.0
    for y, contact in ((0.0, True), (0.05, False), (0.1, True)):
        for x in np.linspace(0.0, 0.1, 51):
            t += 0.005
            feed.hear(TRUTH, truth(t, np.zeros(3), np.array([x, y, 0.0]), contact), t)
    assert feed.ink.length == pytest.approx(0.2, rel=0.02)
    segments = np.array([s for piece in feed.ink.pieces for s in piece])
    assert np.allclose(segments[:, 0, 1], segments[:, 1, 1])


def test_ink_that_is_drawn_over_and_over_stays_what_it_is() -> None:
    """The same circle for a day, never quite the same: no gap in it, and an end to what is kept."""
    ink, rng = Ink(), np.random.default_rng(0)

    def rounds(count: int) -> int:
        """So many more, each lifted off after; how many segments there are then."""
        for _ in range(count):
            for angle in np.linspace(0.0, 2 * np.pi, 290) + rng.uniform(0.0, 0.02):
                off = rng.normal(0.0, 5e-5, 2)
                tip = [*(0.05 * np.array([np.cos(angle), np.sin(angle)]) + off), 0.0]
                ink.touch(np.array(tip), True)
            ink.touch(np.zeros(3), False)
        return sum(map(len, ink.pieces))

    first = rounds(1)
    assert ink.length == pytest.approx(2 * np.pi * 0.05, rel=0.01)
    many = rounds(60)
    assert many < 8 * first
    assert rounds(60) < 1.1 * many


def test_without_truth_ink_is_where_the_arm_says_it_draws() -> None:
    """A robot that is no simulation has a board, too."""
    feed = Feed()
    for i in range(50):
        status = ArmStatus(t=0.02 * i, stroke=1, force=1.5, reference=np.array([2e-3 * i, 0, 0]))
        feed.hear(ARM_STATUS, status, 0.0)
    assert feed.ink.length == pytest.approx(0.098)


def test_events_are_changes_not_repetitions() -> None:
    """A hundred statuses of one node are one event."""
    feed = Feed()
    for i in range(100):
        node = "Line1" if i < 60 else "Retract1"
        status = ArmStatus(t=0.02 * i, state="running", node=node, transitions=int(i >= 60))
        feed.hear(ARM_STATUS, status, 0.0)
    assert [text for _, text in feed.events] == [
        "arm running, node Line1",
        "arm running, node Retract1",
    ]


def test_a_track_keeps_a_minute_and_a_window_and_thins() -> None:
    """Of 1 kHz it keeps 30 Hz; 60 s back there is still a window of 15 s; memory does not grow."""
    track = Track(1)
    for i in range(100_000):
        track.add(i / 1000, (i / 1000,))
    time, value = track.window(100.0 - 60.0 - 15.0, 100.0 - 60.0)
    assert time[0] == pytest.approx(25.0, abs=0.1) and time[-1] == pytest.approx(40.0, abs=0.1)
    assert np.array_equal(time, value) and (np.diff(time) > 0).all()
    assert len(time) == pytest.approx(15 * RATE, rel=0.05)
    assert track._rows.shape == (round(SPAN * RATE), 2)


def test_frames_are_turned_there_and_back() -> None:
    """A goal clicked in the world is the same place in odometry's frame."""
    rng = np.random.default_rng(3)
    for _ in range(20):
        a, b = rng.normal(size=3), rng.normal(size=3)
        assert np.allclose(moved(between(a, b), b), a)
        assert np.allclose(moved(inverse(a), moved(a, b)), b)
