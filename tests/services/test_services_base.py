"""The base service: it minds the arm."""

from __future__ import annotations

import numpy as np
import pytest

from services.base_service import ARM_SILENT, BaseService
from services.messages import ArmStatus, BaseCommand, Estimate, Scan
from services.service import Inbox
from services.topics import ARM_STATUS, ESTIMATE, SCAN
from sim.scenario import load_scenario


def nothing_seen(t: float) -> Scan:
    """A scan of an empty floor."""
    return Scan(t=t, start=-3.1, increment=0.1, ranges=np.full(63, 8.0), farthest=8.0)


class Bench:
    """A base service with a perfect, standing estimate and an arm in a chosen state."""

    def __init__(self, restarted: bool = False) -> None:
        self.service = BaseService(load_scenario("whiteboard_moving"), restarted)
        self.inbox = Inbox(self.service.inputs)
        self.now = 2.0

    def run(self, arm: str | None, steps: int = 10) -> float:
        """Step with an arm in this state, None for a silent one; the last speed asked for [m/s]."""
        speed = 0.0
        for _ in range(steps):
            self.now += self.service.period
            zero = np.zeros(3)
            estimate = Estimate(
                t=self.now,
                pose=zero,
                velocity=zero,
                acceleration=zero,
                covariance=1e-8 * np.eye(6),
                gyro_bias=0.0,
                accel_bias=np.zeros(2),
                odometry_innovation=zero,
                imu_innovation=zero,
                odometry_nis=0.0,
                imu_nis=0.0,
                odometry_age=0.0,
                imu_age=0.0,
                command_age=0.0,
            )
            self.inbox.offer(ESTIMATE, estimate)
            self.inbox.offer(SCAN, nothing_seen(self.now))
            if arm is not None:
                self.inbox.offer(ARM_STATUS, ArmStatus(t=self.now, state=arm))
            for _, message in self.service.step(self.now, self.inbox):
                if isinstance(message, BaseCommand):
                    speed = float(np.hypot(*message.velocity[:2]))
        return speed


@pytest.mark.parametrize("failed", ["safe_hold", "protective_stop"])
def test_the_platform_stands_while_the_arm_makes_up_for_nothing(failed: str) -> None:
    """It stops when the arm fails, stays while the arm is idle, goes on once it works."""
    bench = Bench()
    assert bench.run("running", 40) > 0.05
    assert bench.run(failed, 14) == 0.0
    assert bench.run("idle", 10) == 0.0
    assert bench.run("resuming", 40) > 0.05


def test_a_silent_arm_stops_the_platform() -> None:
    """An arm that was heard and is silent for longer than its limit is taken for dead."""
    bench = Bench()
    assert bench.run("running", 40) > 0.05
    assert bench.run(None, 14) == 0.0
    assert bench.service.state()[1] == "the arm is silent"
    assert ARM_SILENT <= 0.05


def test_an_arm_that_was_never_heard_is_no_reason_to_stand() -> None:
    """The platform runs without an arm process."""
    assert Bench().run(None, 40) > 0.05


def test_only_a_person_lets_a_restarted_platform_drive() -> None:
    """Neither the arm's failure nor its recovery ends the stop of a restart."""
    bench = Bench(restarted=True)
    assert bench.run("running", 20) == 0.0
    assert bench.run("safe_hold", 5) == 0.0
    assert bench.run("running", 20) == 0.0
    assert bench.service.prepare("resume", {})().accepted
    assert bench.run("running", 40) > 0.05
