"""Goals that the arm's program has for the platform."""

from __future__ import annotations

import numpy as np

from base.arm_goal import ArmGoal
from base.platform import Platform
from deploy.robot import load_robot
from deploy.task import BaseTask
from services.messages import ArmStatus


def heeding() -> tuple[Platform, ArmGoal]:
    """A platform that holds still, and who makes it heed."""
    platform = Platform(load_robot("xr4000_puma560"), BaseTask())
    return platform, ArmGoal(platform)


def wants(number: int, x: float = 1.0) -> ArmStatus:
    """A status with a goal."""
    return ArmStatus(t=1.0, goal_number=number, goal=np.array([x, 0.0, 0.0]))


def test_a_goal_is_obeyed_once_and_a_person_may_replace_it() -> None:
    """The same goal, said again 50 times a second, does not undo what a person asked for."""
    platform, goals = heeding()
    goals.heed(None)
    goals.heed(wants(1))
    assert platform.doing == "driving"
    platform.set_behaviour("hold_still")
    goals.heed(wants(1))
    assert platform.doing == "holding"
    goals.heed(wants(2))
    assert platform.doing == "driving"


def test_a_goal_that_is_taken_back_stops_the_platform() -> None:
    """Paused or stopped on the way, the program's goal is no goal any more."""
    platform, goals = heeding()
    goals.heed(wants(1))
    goals.heed(wants(0))
    assert platform.doing == "holding"


def test_a_goal_no_platform_can_reach_is_refused_with_the_reason() -> None:
    """The task it had goes on."""
    platform, goals = heeding()
    goals.heed(wants(1, x=1e4))
    assert platform.doing == "holding"
    assert "refused" in goals.refused


def test_a_goal_after_more_than_a_turn_is_the_same_goal() -> None:
    """The program's headings go on counting; the platform's tasks do not."""
    platform, goals = heeding()
    goals.heed(ArmStatus(t=1.0, goal_number=1, goal=np.array([1.0, 0.0, 7.0])))
    assert platform.doing == "driving" and not goals.refused
