"""The platform-motion observer as a service."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from deploy.robot import MobileBase, load_robot
from deploy.task import BoardPose
from observer.baselines import TruthReference
from observer.board_frame import BoardFrame
from observer.object_watch import watch_of
from observer.observer import make_observer
from services.service import Inbox, Outbox, Reply
from services.topics import (
    ARM_STATE,
    BASE_COMMAND,
    BOARD,
    ESTIMATE,
    IMU,
    OBJECT,
    ODOMETRY,
    TRUTH,
    VISION,
    Topic,
)


class ObserverService:
    """The platform-motion observer."""

    name = "observer"
    period = 0.002
    verbs: tuple[str, ...] = ()

    def __init__(
        self, kind: str, robot: str, board: BoardPose | None = None, box: bool = False
    ) -> None:
        # not every task wants its board moved under the arm by what a camera sees
        self._board = None if board is None else BoardFrame((board.x, board.y, board.yaw))
        self._observer = make_observer(kind, load_robot(robot, MobileBase))
        # truth is for reference runs alone: no other kind so much as subscribes to it
        self._truth = self._observer if isinstance(self._observer, TruthReference) else None
        self.inputs: tuple[Topic, ...] = (ODOMETRY, IMU, BASE_COMMAND)
        self._watch = watch_of(robot, box)
        if self._board is not None or self._watch is not None:
            self.inputs += (VISION,)
        if self._watch is not None:
            self.inputs += (ARM_STATE,)
        if self._truth is not None:
            self.inputs += (TRUTH,)
        self._state = ("starting", "")

    def step(self, now: float, inbox: Inbox) -> Outbox:
        """Fuse what arrived, publish the estimate at ``now``, and where the board is if seen."""
        if self._truth is not None:
            for truth in inbox.new(TRUTH):
                self._truth.tell(truth.t, truth.pose, truth.velocity, truth.acceleration)
        estimate = self._observer.step(
            now, inbox.new(ODOMETRY), inbox.new(IMU), inbox.new(BASE_COMMAND)
        )
        self._state = ("valid" if estimate.valid else "invalid", estimate.reason)
        out: Outbox = [(ESTIMATE, estimate)]
        sightings = inbox.new(VISION) if self._board or self._watch else []
        if self._board is not None:
            board = self._board.step(estimate, sightings)
            out += [] if board is None else [(BOARD, board)]
        if self._watch is not None:
            seen = self._watch.step(estimate, sightings, inbox.latest(ARM_STATE))
            out += [] if seen is None else [(OBJECT, seen)]
        return out

    def prepare(self, verb: str, args: dict[str, Any]) -> Callable[[], Reply]:
        """The observer answers no requests."""
        raise ValueError(f"the observer does not answer {verb!r}")

    def state(self) -> tuple[str, str]:
        """Whether the newest estimate is valid, and why not."""
        return self._state
