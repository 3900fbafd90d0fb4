"""Does the platform get anywhere? If not, it is said why, within a stated time."""

from __future__ import annotations

import math

import numpy as np

from services.messages import Array

STUCK = 3.0
"""Commanded to move and not moving for this long, it is stuck [s]."""
HELD = 3.0
"""Held by limits though the task wants to move for this long, its way is blocked [s]."""
NOWHERE = 20.0
"""On the way and no further than ``_PLACE`` for this long, its way is blocked [s]."""
_PLACE = 0.25  # [m]
_CREEP = 0.02  # further than this it does move, whatever the estimate's velocity says [m]
_SLOW = 0.03  # [m/s, rad/s]
_SHARE = 0.15  # of what is commanded, that counts as moving


class Progress:
    """Watches what is wanted, commanded and measured, step by step."""

    def __init__(self) -> None:
        self._stuck = self._held = self._nowhere = -math.inf
        self._newest = -math.inf
        self._place, self._gains = np.zeros(2), 0.0
        self._stood = np.zeros(2)

    def check(
        self,
        now: float,
        wanted: Array,
        allowed: Array,
        command: Array,
        velocity: Array,
        place: Array,
        going: bool,
    ) -> str:
        """Why it gets nowhere, empty if it does.

        Args:
            now: robot time [s].
            wanted: (3,) by the task, V_OB_B.
            allowed: (3,) what the limits leave of all that is wanted.
            command: (3,) that the platform was given at the last step.
            velocity: (3,) measured, V_OB_B.
            place: (2,) in O [m].
            going: the task is on its way somewhere.

        Returns:
            Begins with ``stuck``, ``held`` or ``no progress``.
        """
        if now - self._newest > 0.5:
            self._stuck = self._held = self._nowhere = now
            self._place = place.copy()
        self._newest = now
        told, moves, asked = _size(command), _size(velocity), _size(wanted)
        crept = float(np.hypot(*(place - self._stood))) > _CREEP
        if told < _SLOW or moves > max(_SHARE * told, 0.005) or crept:
            self._stuck, self._stood = now, place.copy()
        # what it slides sideways along a limit is no way towards where it wants to go
        gains = float(allowed @ wanted) / asked if asked > _SLOW else 0.0
        self._gains += 0.1 * (gains - self._gains)  # a noisy scan opens a limit now and then
        if asked < _SLOW or self._gains > max(_SLOW, 0.1 * asked):
            self._held = now
        if not going or asked < _SLOW or np.hypot(*(place - self._place)) > _PLACE:
            self._nowhere, self._place = now, place.copy()
        if now - self._stuck > STUCK:
            return f"stuck: told {told:.2f}, moves {moves:.2f}"
        if now - self._held > HELD:
            return f"held for {now - self._held:.0f} s"
        if now - self._nowhere > NOWHERE:
            return f"no progress for {NOWHERE:.0f} s"
        return ""


def _size(twist: Array) -> float:
    """Of a velocity, m/s and rad/s alike."""
    return math.hypot(float(twist[0]), float(twist[1])) + 0.3 * abs(float(twist[2]))
