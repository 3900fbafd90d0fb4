"""Which behaviour does a task, and what this platform cannot be asked for.

A new task gets its keys in ``deploy/task.py`` and a line in ``Tasks.behaviour``.
"""

from __future__ import annotations

import math
from pathlib import Path as File
from typing import Any

import numpy as np
from pydantic import ValidationError

from base.approach import Approach
from base.behaviour import Behaviour
from base.dock import Dock
from base.drive_to import DriveTo
from base.find_way import FindWay
from base.follow_path import FollowPath
from base.hold_still import HoldStill
from base.keep_in_reach import KeepInReach
from base.nodes.build import load_program
from base.paths import Path, build
from base.picture import Picture
from base.planar import rotate
from base.position import Position
from base.program import RunProgram
from base.turn_drive_turn import TurnDriveTurn
from deploy.robot import Chassis
from deploy.robot import Platform as Drive
from deploy.task import BaseTask

LOOK = 0.05
"""A path's speed is looked at so often [s] ..."""
ROUND = 60.0
"""... and for so long, of one that has no end [s]."""


class Tasks:
    """Makes behaviours for one platform.

    Args:
        drive: description, for limits and lag.
        chassis: description, for the kind of drive and the radius.
        reach: of the arm [m].
        period: between commands [s].
        picture: of the laser, None without one.
        beside: folder that relative paths of programs start from.
    """

    def __init__(
        self,
        drive: Drive,
        chassis: Chassis,
        reach: float,
        period: float,
        picture: Picture | None,
        beside: File | None,
    ) -> None:
        self._drive, self._reach = drive, reach
        self._differential = chassis.drive == "differential"
        self._radius = chassis.radius
        # a command acts after the drive's dead time, and until the next one
        self._ahead = drive.command_delay + period / 2
        self._picture = picture
        self._beside = beside

    def behaviour(self, task: BaseTask) -> Behaviour:
        """What does a task; nothing of it has begun.

        Raises:
            ValueError: the task asks for more than this platform can do.
        """
        if task.behaviour == "program":
            return self._program(task)
        if task.behaviour in ("find_way", "dock") and self._picture is None:
            raise ValueError(f"behaviour {task.behaviour!r} needs a laser; this robot has none")
        if self._differential and task.behaviour in ("dock", "position", "find_way"):
            raise ValueError(f"behaviour {task.behaviour!r} needs a holonomic platform")
        if task.behaviour == "dock" and self._picture is not None:
            assert task.distance is not None
            return Dock(task.distance, math.radians(task.bearing_deg), self._picture)
        if task.behaviour == "position":
            return Position(np.array(task.goal))
        if task.behaviour == "find_way" and self._picture is not None:
            return FindWay(np.array(task.goal), self._picture, self._radius)
        if task.behaviour == "drive_to" and self._differential:
            return TurnDriveTurn(np.array(task.goal), self._pace())
        if task.behaviour == "drive_to":
            return DriveTo(np.array(task.goal))
        if task.behaviour == "follow_path":
            return self._path(task)
        if task.behaviour == "keep_in_reach":
            return KeepInReach(self._reach, self._drive.lag, self._ahead)
        return HoldStill()

    def _program(self, task: BaseTask) -> RunProgram:
        given = {"goal": task.goal, "object": task.object}
        return RunProgram(
            load_program(task.program, self._beside),
            self._differential,
            self._pace(),
            {k: np.array(v) for k, v in given.items() if v is not None},
            self._picture,
        )

    def _path(self, task: BaseTask) -> FollowPath:
        assert task.path is not None
        path = build(task.path)
        self._refuse_too_fast(path)
        origin = None if task.origin is None else np.array(task.origin)
        return FollowPath(path, self._drive.lag, self._ahead, origin)

    def _pace(self) -> Approach:
        """How fast a goal is approached."""
        speed, _, turn = self._drive.speed_limit
        gain = 2.0 if self._differential else 1.2
        return Approach(speed=min(0.5, speed), turn=min(0.8, turn), gain=gain)

    def _refuse_too_fast(self, path: Path) -> None:
        horizon = path.duration if math.isfinite(path.duration) else ROUND
        times = np.linspace(0.0, horizon, 1 + math.ceil(horizon / LOOK))
        body = [rotate(-path.pose(s)[2], path.velocity(s)) for s in times]
        peak = np.max(np.abs(body), axis=0)
        for what, asked, limit in zip(
            ("vx", "vy", "yaw rate"), peak, self._drive.speed_limit, strict=True
        ):
            if asked > limit + 1e-9:
                raise ValueError(f"the path's {what} reaches {asked:.2f}; the limit is {limit:g}")


def parse(behaviour: str, **options: Any) -> BaseTask:
    """A task from what a person typed.

    Args:
        behaviour: as in the scenario's ``[task.base]`` table.
        **options: the other keys of that table.

    Raises:
        ValueError: unknown name or option, or one out of range; the text says what is allowed.
    """
    try:
        return BaseTask.model_validate({"behaviour": behaviour, **options})
    except ValidationError as error:
        findings = [
            f"{'.'.join(map(str, e['loc'])) or behaviour}: {e['msg']}" for e in error.errors()
        ]
        allowed = ", ".join(BaseTask.model_fields)
        raise ValueError(f"{'; '.join(findings)}. Keys: {allowed}") from None
