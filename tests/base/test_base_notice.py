"""The platform says that it is about to move before it does, and moves at once out of the way."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from base.behaviour import Vote
from base.notice import WARNING, Notice
from base.platform import Platform
from deploy.robot import Robot
from deploy.task import BaseTask

STANDING, WISH = np.zeros(3), {"drive_to": Vote(np.array([0.2, 0.0, 0.0]))}


def test_a_standing_platform_warns_for_half_a_second_before_it_moves(
    robot: Robot, plant: Any
) -> None:
    """``starting`` in every status before the first command, at least for ``WARNING``."""
    platform = Platform(robot, BaseTask(behaviour="drive_to", goal=(1.0, 0.0, 0.0)), warn=True)
    run = plant.run(platform, 2.0)
    first = next(i for i, c in enumerate(run.commands) if np.abs(c).max() > 0)
    assert {s.state for s in run.status[:first]} == {"starting"}
    assert run.status[first].t - run.status[0].t == pytest.approx(WARNING)


def test_a_task_with_a_start_moves_at_its_start(robot: Robot, plant: Any) -> None:
    """The warning comes before ``start_at``, which is kept."""
    task = BaseTask(behaviour="drive_to", goal=(1.0, 0.0, 0.0), start_at=1.0)
    run = plant.run(Platform(robot, task, warn=True), 2.0)
    first = next(i for i, c in enumerate(run.commands) if np.abs(c).max() > 0)
    assert run.status[first].t == pytest.approx(1.0)
    assert {s.state for s in run.status if 0.5 <= s.t < 1.0} == {"starting"}


def test_giving_way_is_not_held_back() -> None:
    """Half a second is too late for somebody who walks into the platform."""
    notice = Notice()
    assert notice.holds(0.0, WISH, STANDING)
    away = {**WISH, "give_way": Vote(np.array([-0.5, 0.0, 0.0]), weight=30.0)}
    assert not notice.holds(0.1, away, STANDING)


def test_a_short_halt_needs_no_new_warning() -> None:
    """One that takes longer than people wait does."""
    notice = Notice()
    assert not notice.holds(0.0, WISH, np.array([0.1, 0.0, 0.0]))
    assert not notice.holds(0.5, WISH, STANDING)
    assert notice.holds(3.0, WISH, STANDING)
