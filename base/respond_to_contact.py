"""Back off from whatever presses a bumper."""

from __future__ import annotations

import math

import numpy as np

from base.behaviour import Senses, Vote
from base.planar import rotate
from services.messages import Array

_OLD = 0.3  # a message of the bumpers that is not acted on [s]
_BACK = 0.06  # backed off by, from where the bumper was let go [m]
_LONGEST = 2.0  # of backing off [s]
_WARY = 3.0  # for which it does not go that way again [s]


class RespondToContact:
    """Outvotes everybody while a bumper is pressed and a little longer; then bars the way there.

    Args:
        speed: of backing off [m/s].
        weight: of its vote, against 1 of those that are not in a hurry.
    """

    name = "respond_to_contact"

    def __init__(self, speed: float = 0.12, weight: float = 100.0) -> None:
        self._speed, self._weight = speed, weight
        self._pressed = -math.inf
        self._began = -math.inf
        self._place = np.zeros(2)
        self._normal: Array = np.zeros((0, 2))
        self._reason = ""

    @property
    def state(self) -> str:
        """``calm``, or ``touched`` until it may go that way again."""
        return "touched" if len(self._normal) else "calm"

    def vote(self, now: float, senses: Senses) -> Vote:
        """Away from the contact, and never towards it; nothing without one."""
        pose, bumper = senses.estimate.pose, senses.bumper
        if bumper is not None and now - bumper.t <= _OLD and len(bumper.pressed):
            if now - self._pressed > _OLD:
                self._began = now
            self._pressed, self._place = now, pose[:2].copy()
            angle = bumper.pressed + pose[2]
            self._normal = np.column_stack([np.cos(angle), np.sin(angle)])
            degrees = ", ".join(f"{math.degrees(b):.0f}" for b in bumper.pressed)
            self._reason = f"touched at {degrees} deg"
        if now - self._pressed > _WARY or not len(self._normal):
            self._normal = np.zeros((0, 2))
            return Vote(np.zeros(3), 0.0)
        limits = np.zeros((len(self._normal), 4))
        limits[:, :2] = [rotate(-pose[2], np.array([*n, 0.0]))[:2] for n in self._normal]
        moved = float(np.hypot(*(pose[:2] - self._place)))
        back = -self._normal.sum(axis=0)
        length = float(np.hypot(back[0], back[1]))
        done = moved > _BACK or now - self._began > _LONGEST or length < 0.1
        if done:  # pressed on all sides, or far enough
            return Vote(np.zeros(3), 0.0, limits=limits, reason=self._reason)
        away = rotate(-pose[2], np.array([*(back * self._speed / length), 0.0]))
        return Vote(away, self._weight, limits=limits, reason=self._reason)
