"""When the platform stands: every reason has its own way out."""

from __future__ import annotations

from base.platform import Platform
from base.safe_states import platform_states
from deploy.robot import Robot
from deploy.task import BaseTask


def going(robot: Robot) -> Platform:
    """A platform with a goal 1 m ahead."""
    return Platform(robot, BaseTask(behaviour="drive_to", goal=(1.0, 0.0, 0.0)))


def test_a_person_and_an_arm_that_fails_are_told_apart(robot: Robot) -> None:
    """An arm that works again ends the waiting, and never a person's stop."""
    platform = going(robot)
    platform.mind_arm("the arm is silent", False)
    assert platform.states.state == "waiting_for_arm"
    platform.mind_arm("", False)  # idle: it has not been seen to work
    assert platform.states.state == "waiting_for_arm"
    platform.mind_arm("", True)
    assert platform.states.state == "under_way"
    platform.mind_arm("the arm is silent", False)
    platform.stop()
    platform.mind_arm("", True)
    assert platform.states.state == "stopped"
    platform.resume()
    assert platform.states.state == "under_way"


def test_a_person_may_drive_although_the_arm_is_idle_after_a_failure(robot: Robot) -> None:
    """Nothing else than a failure makes it wait again."""
    platform = going(robot)
    platform.mind_arm("the arm is in safe_hold", False)
    platform.resume()
    platform.mind_arm("", False)
    assert platform.states.state == "under_way"


def test_an_arm_that_comes_back_does_not_set_a_stuck_platform_off(robot: Robot) -> None:
    """Only a person, or another task, does."""
    platform = going(robot)
    platform.states.fire("Stuck", "told to move and does not")
    platform.mind_arm("the arm is silent", False)
    platform.mind_arm("", True)
    assert platform.states.state == "blocked"
    platform.states.fire("Arm_failed", "it says")  # whoever says so
    assert platform.states.state == "blocked"
    platform.resume()
    assert platform.states.state == "under_way"


def test_a_stop_keeps_a_new_task_for_later(robot: Robot) -> None:
    """And the reason of the stop."""
    platform = going(robot)
    platform.stop("looks odd")
    platform.set_goal(0.5, 0.0, 0.0)
    assert (platform.states.state, platform.stopped) == ("stopped", "looks odd")


def test_a_stop_is_reached_from_every_state() -> None:
    """ABORT is the stop."""
    for event in ("", "Lost", "Arm_failed", "Stuck"):
        states = platform_states()
        if event:
            states.fire(event, "why")
        states.abort("asked")
        assert (states.state, states.reason) == ("stopped", "asked")
