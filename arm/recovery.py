"""Motions that belong to no program: let go of the board, and come back to it."""

from __future__ import annotations

import numpy as np

from arm.control import LowPass, Orientation, Position
from arm.nodes.node import TOOL_ON_BOARD, Array, Context, Step
from arm.nodes.profile import Profile

AWAY = 0.06
"""How far the tool moves back from what it touched [m]."""
AWAY_SPEED = 0.25
"""[m/s]; faster than the platform can roll towards the board while it stops."""
AWAY_ACCELERATION = 0.6
"""[m/s^2]; the contact is gone after about 0.1 s."""
AWAY_GAIN = 8.0
"""The last part of the way is left behind at this rate [1/s] ..."""
AWAY_REST = 1e-4
"""... until so much of it remains [m]."""
STATION_SPEED = 0.1
"""[m/s]"""
RETURN_SPEED = 0.08
"""[m/s]"""
CLEARANCE = 0.02
"""Distance from the board at which a return waits before it touches [m]."""
TOUCH = 1.0
"""Filtered force that means the pen is back on the board [N]."""
TOUCH_SPEED = 0.02
"""[m/s]"""
SEARCH = 0.03
"""How far beyond where the board was the pen looks for it [m]."""
REACHED = 1e-3
"""A way is over when the tip is this near [m] ..."""
REACH_TIME = 1.0
"""... or this long after it should be [s]."""


class Retreat:
    """Moves the tool back along its own axis, then holds the joints still.

    It trusts no platform estimate: what is left of the platform's velocity is taken out by the
    caller's compensation, which fades.
    """

    pressing = False

    def __init__(self, distance: float) -> None:
        self._distance = distance

    def enter(self, context: Context) -> None:
        """Start from rest.

        The ramp is the retreat's own: fading in from what was done before would take longer
        than the way itself, and end in the wrong direction.
        """
        self._gone = 0.0
        self._speed = 0.0
        self._position = Position(np.eye(3), gain=0.0)
        orientation = Orientation(context.kinematics.R, gain=0.0)
        self._objective = orientation.subject_to(self._position)

    def update(self, context: Context) -> Step:
        """The objective is None once the tool is away."""
        left = self._distance - self._gone
        if left < AWAY_REST:
            return Step(None, context.tip, np.zeros(3))
        self._speed = min(self._speed + AWAY_ACCELERATION * context.dt, AWAY_SPEED)
        self._speed = min(self._speed, AWAY_GAIN * left)
        self._gone += self._speed * context.dt
        self._position.track(np.zeros(3), -self._speed * context.kinematics.R[:, 2])
        return Step(self._objective, context.tip, np.zeros(3))


class Station:
    """Keeps the tip where it is over the board, some way off it, whatever the platform does.

    Args:
        distance: how far to move away from the board first [m].
    """

    pressing = False

    def __init__(self, distance: float) -> None:
        self._distance = distance

    def enter(self, context: Context) -> None:
        """Plan the way off the board."""
        self._start = context.tip
        self._profile = Profile(self._distance, STATION_SPEED, 0.5)
        self._position = Position(np.eye(3))
        orientation = Orientation(context.R_OS @ TOOL_ON_BOARD)
        self._objective = orientation.subject_to(self._position)

    def update(self, context: Context) -> Step:
        """Off the board, then still."""
        s, v = self._profile.step(context.dt)
        desired = self._start + np.array([0.0, 0.0, s])
        velocity = np.array([0.0, 0.0, v])
        self._position.track(context.p_OS + context.R_OS @ desired, context.R_OS @ velocity)
        return Step(self._objective, desired, velocity)


class Return:
    """Brings the tip back to where a program was interrupted.

    Args:
        desired: tip position asked for when it was interrupted, p_ST_S [m].
        pressing: the pen was on the board, so touch it again.
    """

    pressing = False

    def __init__(self, desired: Array, pressing: bool) -> None:
        self._goal = desired.copy()
        self._pressing = pressing

    def enter(self, context: Context) -> None:
        """Plan a straight way, ending clear of the board if the pen is to touch it after."""
        self._start = context.tip
        end = self._goal.copy()
        if self._pressing:
            end[2] = self._goal[2] + CLEARANCE  # from where the board was felt, not believed
        way = end - self._start
        length = float(np.linalg.norm(way))
        self._end = end
        self._direction = way / length if length > 0 else np.zeros(3)
        self._profile = Profile(length, RETURN_SPEED, 0.3)
        self._position = Position(np.eye(3))
        orientation = Orientation(context.R_OS @ TOOL_ON_BOARD)
        self._objective = orientation.subject_to(self._position)
        self._filter = LowPass(20.0)
        self._waited = 0.0

    def update(self, context: Context) -> Step:
        """``Finished`` when the tip is back, and on the board if it was; else ``Out_of_Reach``."""
        force = self._filter.step(context.force, context.dt)
        event = None
        if not self._profile.done:
            s, v = self._profile.step(context.dt)
            desired, velocity = self._start + s * self._direction, v * self._direction
        elif not self._pressing:
            desired, velocity = self._goal, np.zeros(3)
            self._waited += context.dt
            near = float(np.linalg.norm(context.tip - self._goal)) < REACHED
            if near or self._waited > REACH_TIME:
                event = "Finished"
        else:
            velocity = np.array([0.0, 0.0, -TOUCH_SPEED])
            self._end = desired = self._end + velocity * context.dt
            if force > TOUCH:
                event = "Finished"
            elif desired[2] < self._goal[2] - SEARCH:
                event = "Out_of_Reach"
        self._position.track(context.p_OS + context.R_OS @ desired, context.R_OS @ velocity)
        return Step(self._objective, desired, velocity, event, filtered=force)
