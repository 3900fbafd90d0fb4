"""Loops keep absolute deadlines, skip and count what they missed, and know how well they did."""

from __future__ import annotations

import threading

import pytest

from services.components import build_service
from services.live.clock import EpochClock, HeardClock
from services.live.loop import Driven, FixedRate, LoopStatistics, heartbeat
from services.live.runner import Grid
from services.service import Arrivals
from services.topics import ARM_STATE


class FakeTime:
    """A clock that only moves when somebody sleeps, or the test says so."""

    def __init__(self) -> None:
        self.now = 100.0
        self.slept: list[float] = []

    def clock(self) -> float:
        """The time."""
        return self.now

    def sleep(self, duration: float) -> None:
        """Passes the time."""
        self.slept.append(duration)
        self.now += duration


def _loop(time: FakeTime, spin: float = 0.0) -> FixedRate:
    return FixedRate(0.01, spin, time.clock, time.sleep)


def test_deadlines_are_absolute() -> None:
    """Work of varying length does not make the loop drift."""
    time = FakeTime()
    loop = _loop(time)
    starts = []
    for work in (0.001, 0.009, 0.004, 0.0, 0.002):
        starts.append(loop.wait())
        time.now += work
    assert starts == pytest.approx([100.0, 100.01, 100.02, 100.03, 100.04])
    assert loop.statistics.overruns == 0


def test_missed_ticks_are_skipped_and_counted() -> None:
    """After a long tick the loop goes on at the next deadline; it does not catch up in a burst."""
    time = FakeTime()
    loop = _loop(time)
    loop.wait()
    time.now += 0.035
    starts = [loop.wait() for _ in range(3)]
    assert starts == pytest.approx([100.035, 100.04, 100.05])
    assert loop.statistics.overruns == 2
    assert loop.statistics.progress == 4


def test_a_slightly_late_tick_is_not_an_overrun() -> None:
    """A tick that overlaps the next deadline runs late; none is lost."""
    time = FakeTime()
    loop = _loop(time)
    loop.wait()
    time.now += 0.013
    loop.wait()
    assert loop.statistics.overruns == 0
    _, lateness = loop.statistics.report()
    assert lateness["max"] == pytest.approx(0.003)


def test_spinning_sleeps_less() -> None:
    """With spinning the sleep ends before the deadline and the rest is waited actively."""
    time = FakeTime()
    reads = iter(range(10_000))
    loop = FixedRate(0.01, 0.001, lambda: time.now + next(reads) * 1e-6, time.sleep)
    loop.wait()
    start = loop.wait()
    assert sum(time.slept) == pytest.approx(0.009, abs=1e-4)
    assert start >= 100.01


def test_statistics_report_and_start_anew() -> None:
    """Mean, spread and percentiles are of the ticks since the last report; counts are of all."""
    statistics = LoopStatistics(0.001)
    start = 0.0
    for number in range(101):
        start += 0.003 if number == 50 else 0.001
        statistics.tick(start, number * 1e-6, missed=2 if number == 50 else 0)
    period, lateness = statistics.report()
    assert period["target"] == 0.001
    assert period["mean"] == pytest.approx(0.102 / 100)
    assert period["max"] == pytest.approx(0.003)
    assert lateness == pytest.approx({"p50": 50e-6, "p99": 99e-6, "max": 100e-6, "over_1ms": 0.0})
    assert (statistics.progress, statistics.overruns) == (101, 2)
    assert statistics.report() == ({"target": 0.001}, {})
    statistics.tick(start + 0.001, 0.0)
    assert statistics.report()[0]["mean"] == pytest.approx(0.001)


def test_heartbeat_leaves_out_what_was_never_heard() -> None:
    """An age that is infinite would make the heartbeat itself a bad message."""
    ages = {"robot/imu": 0.01, "robot/odometry": float("inf")}
    health = heartbeat(LoopStatistics(0.001), "arm", ("idle", ""), -1.0, 7, ages, {}, {})
    assert health.ages == {"robot/imu": 0.01}
    assert health.t == 0.0


def test_a_driven_loop_ticks_with_and_without_arrivals() -> None:
    """An arrival is a tick at once; silence is a tick at the period."""
    arrived = threading.Event()
    loop = Driven(0.01, arrived, lambda: 0.0)
    loop.wait()
    arrived.set()
    loop.wait()
    assert not arrived.is_set()
    loop.wait()
    assert loop.statistics.progress == 3


@pytest.mark.parametrize("scenario", ["whiteboard", "move_to_grasp", "pick_bottle"])
def test_an_arm_is_driven_by_its_state_at_the_rate_of_its_robot(scenario: str) -> None:
    """Else a slow robot's loop would report overruns that did not happen."""
    arm, sim = (build_service(name, scenario, 0, live=True) for name in ("arm", "sim"))
    assert arm.driven_by == Arrivals(ARM_STATE, sim.period)  # type: ignore[attr-defined]


def test_the_world_makes_up_for_missed_ticks_within_reason() -> None:
    """Every multiple of the period is stepped once; after a long stall time slips instead."""
    slipped: list[float] = []
    grid = Grid(0.001, slipped.append)
    assert grid.due(5.0001) == pytest.approx([5.0])
    assert grid.due(5.0004) == []
    assert grid.due(5.0021) == pytest.approx([5.001, 5.002])
    assert slipped == []
    late = grid.due(5.1)
    assert late == pytest.approx([5.002 + 0.001 * n for n in range(1, Grid.CATCH_UP + 1)])
    assert slipped == pytest.approx([5.1 - late[-1]])


def test_robot_time_is_of_the_fastest_message_and_never_goes_back() -> None:
    """Late sensors do not pull the clock back; silence lets it run on."""
    time = FakeTime()
    clock = HeardClock(time.clock)
    assert clock.now() is None
    clock.hear(5.0, at=100.0)
    assert clock.now() == pytest.approx(5.0)
    clock.hear(4.98, at=100.0)
    assert clock.now() == pytest.approx(5.0)
    time.now += 2.0
    assert clock.now() == pytest.approx(7.0)
    clock.hear(6.9, at=time.now)
    assert clock.now() == pytest.approx(7.0)
    time.now += 1.5
    clock.hear(8.3, at=time.now)  # two windows later the robot's clock is known to be slower
    assert clock.now() == pytest.approx(8.4)
    time.now += 1.5
    clock.hear(8.3, at=time.now)
    assert clock.now() == pytest.approx(9.8)
    time.now += 1.5
    clock.hear(8.3, at=time.now)
    assert clock.now() == pytest.approx(9.8)


def test_the_robot_s_clock_goes_on_across_a_restart() -> None:
    """A second clock with the same epoch continues where the first was."""
    time = FakeTime()
    first = EpochClock(90.0, time.clock).now()
    time.now += 1.0
    assert EpochClock(90.0, time.clock).now() == pytest.approx(first + 1.0)
