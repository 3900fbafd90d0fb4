"""The platform comes along with the arm's work, and never uses up the arm's reach."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from base.behaviour import Senses, Vote
from base.fusion import collect, optimum
from base.keep_in_reach import FLOOR, OFFSET, RELATIVE, KeepInReach
from deploy.robot import Robot
from services.messages import ArmStatus, Array

REACH = 0.85
LIMIT = np.array([1.2, 1.2, 1.2])
SOUTH = np.array([0.0, -0.12, 0.0])


def status(
    t: float, tool: Array, velocity: Array, reach: float = 0.3, spare: float = 1.0
) -> ArmStatus:
    """An arm at work on a board in front of it."""
    return ArmStatus(
        t=t,
        state="running",
        anchored=True,
        tool=tool,
        tool_velocity=velocity,
        reach_margin=reach,
        speed_margin=spare,
    )


def asked(behaviour: KeepInReach, plant: Any, arm: ArmStatus | None) -> Vote:
    """Its vote now."""
    return behaviour.vote(plant.now, Senses(plant.estimate(plant.now), arm))


def test_it_comes_along_with_the_tool(plant: Any) -> None:
    """3 m beside a tool that moves at 0.12 m/s: never more than 80 mm behind, in the end 10 mm."""
    behaviour = KeepInReach(REACH, lag=0.15, ahead=0.025)
    off = []
    for n in range(25 * 20):
        t = n * 0.05
        tool = np.array([OFFSET[0], 0.0, 1.3]) + SOUTH * t
        vote = asked(behaviour, plant, status(plant.now, tool, SOUTH))
        mean, bound, limits = collect([vote], LIMIT)
        plant.command = optimum(mean, bound, limits)
        for _ in range(50):
            plant.body = plant.body + (plant.command - plant.body) * 0.001 / plant.lag
            plant.pose = plant.pose + plant.body * 0.001
            plant.tick += 1
        off.append(plant.pose[1] - tool[1] - SOUTH[1] * 0.05)
    assert np.abs(off).max() < 0.08
    assert abs(off[-1]) < 0.01
    assert plant.pose[1] == pytest.approx(-3.0, abs=0.05)


@pytest.mark.parametrize("reach", [FLOOR * REACH, 0.12])
def test_away_from_the_tool_only_as_fast_as_reach_allows(plant: Any, reach: float) -> None:
    """Whatever another behaviour wants; at the floor not at all, and towards the tool freely."""
    behaviour = KeepInReach(REACH, lag=0.15, ahead=0.025)
    tool = np.array([OFFSET[0] + 0.1, 0.0, 1.3])  # 0.1 m too far ahead
    vote = asked(behaviour, plant, status(0.0, tool, np.zeros(3), reach=reach))
    for other, allowed in ((-0.5, -(reach - FLOOR * REACH) / 0.7), (0.2, 0.2)):
        push = Vote(np.array([other, 0.0, 0.0]), weight=1e3)
        mean, bound, limits = collect([vote, push], LIMIT)
        assert optimum(mean, bound, limits)[0] == pytest.approx(allowed, abs=2e-3)


def test_a_busy_arm_is_carried_about_slowly(plant: Any) -> None:
    """With a quarter of the joints' speed left, at half the speed that an idle one bears."""
    behaviour = KeepInReach(REACH, lag=0.15, ahead=0.025)
    tool = np.array([OFFSET[0], 0.0, 1.3])
    push = Vote(np.array([0.0, 1.0, 0.0]), weight=1e3)
    for spare, share in ((1.0, 1.0), (0.25, 0.5)):
        vote = asked(behaviour, plant, status(0.0, tool, np.zeros(3), spare=spare))
        mean, bound, limits = collect([vote, push], LIMIT)
        assert optimum(mean, bound, limits)[1] == pytest.approx(share * RELATIVE, abs=1e-3)


def test_it_weighs_more_the_less_reach_is_left(plant: Any) -> None:
    """One with plenty, four times that at the floor."""
    behaviour = KeepInReach(REACH, lag=0.15, ahead=0.025)
    tool = np.array([OFFSET[0], 0.0, 1.3])
    weights = [
        asked(behaviour, plant, status(0.0, tool, np.zeros(3), reach=r)).weight
        for r in (0.3, 0.15, FLOOR * REACH)
    ]
    assert weights[0] == 1.0 < weights[1] < weights[2] == 4.0


def test_without_work_on_the_ground_it_wants_nothing(plant: Any, robot: Robot) -> None:
    """No arm, an arm that rides along, an arm that has fallen silent."""
    behaviour = KeepInReach(robot.arm.reach, lag=0.15, ahead=0.025)
    old = status(-0.2, np.ones(3), SOUTH)
    for arm in (None, ArmStatus(t=0.0, state="running"), old):
        vote = asked(behaviour, plant, arm)
        assert vote.weight == 0.0
        assert vote.limits is None
