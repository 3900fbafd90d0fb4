"""Keep in reach: come along with the arm's work, so that it stays where the arm is at ease."""

from __future__ import annotations

import math

import numpy as np

from base.behaviour import Senses, Vote
from base.planar import compose, difference, rotate, shorten
from services.messages import ArmStatus, Array

OFFSET = (0.68, 0.0)
"""Where in B the tool is at ease, p_BT ahead and to the left [m]: joints and reach both have
about as much left as they can have together."""
SETTLING = 0.5
"""Time constant with which the tool's velocity is taken up [s]: a wave is the arm's to draw."""
HORIZON = 0.7
"""Reach must not be used up within this time [s]."""
FLOOR = 0.1
"""Share of the arm's reach that must always be left."""
OUTWARD = 0.02
"""Below this distance from where the tool is at ease no direction leads away from it [m]."""
RELATIVE = 0.25
"""Speed of the platform under the tool that an arm with idle joints makes up for [m/s]."""
TURN = 0.3
"""Likewise, of the heading [rad/s]."""
URGENT = 4.0
"""Weight when reach is down to its floor; 1 when there is plenty."""
SILENCE = 0.1
"""A status of the arm older than this says nothing [s]."""


class KeepInReach:
    """Attracts the platform to where the arm's task is in its comfortable workspace.

    It takes the tool's way from the arm's status: where its reference is on the ground, and where
    it goes. The platform is drawn to the pose from which the tool is at ``offset``, facing what is
    worked on, with the tool's own velocity fed forward through the drive's lag. How fast the
    platform may drift under the tool is bounded by what the arm can still make up for: by the
    joint speed left, and, away from the tool, by the reach left. The arm in turn slows its pace as
    its reach shrinks; so whoever is held up is waited for.

    Without work on the ground, or with a silent arm, it wants nothing.

    Args:
        reach: of the arm [m].
        lag: of the drive's response to a command [s].
        ahead: how much later than ``now`` a command acts on average [s].
        offset: where in B the tool is at ease [m].
        gain: of the attraction [1/s].
        push_back: share of the push from the arm's own motion that is countered. Zero, because
            all of it, some 50 ms late, shakes the heading more (docs/long_line.md).
    """

    name = "keep_in_reach"

    def __init__(
        self,
        reach: float,
        lag: float,
        ahead: float,
        offset: tuple[float, float] = OFFSET,
        gain: float = 0.8,
        push_back: float = 0.0,
    ) -> None:
        self._push_back = push_back
        self._floor = FLOOR * reach
        self._full = 2.0 * self._floor
        self._lag, self._lead = lag, lag + ahead
        self._offset = np.array([*offset, 0.0])
        self._gain = gain
        self._along = np.zeros(3)
        self._state = "waiting"
        self._newest: float | None = None

    @property
    def state(self) -> str:
        """``coming along`` with the tool, or ``waiting`` for work on the ground."""
        return self._state

    def vote(self, now: float, senses: Senses) -> Vote:
        """V_OB_B towards ease, under bounds; weight 0 without work on the ground."""
        arm = senses.arm
        if arm is None or not arm.anchored or now - arm.t > SILENCE:
            self._state, self._newest = "waiting", None
            self._along = np.zeros(3)
            return Vote(np.zeros(3), weight=0.0)
        self._state = "coming along"
        self._take_up(now, arm)
        pose = senses.estimate.pose + senses.estimate.velocity * (now - senses.estimate.t)
        error = difference(self.ease(now, arm), pose)
        # the drive is a lag behind: what it is told now is for then
        missed = error + (self._along - senses.estimate.velocity) * self._lead
        pull = shorten(self._gain * missed, translation=RELATIVE, turn=TURN)
        wanted = self._along + np.array([pull[0], pull[1], self._gain * error[2]])
        # the drive turns a velocity error e into an acceleration e / lag: as much against the arm
        wanted = wanted - self._push_back * self._lag * arm.recoil
        return Vote(
            rotate(-pose[2], wanted),
            weight=1.0 + (URGENT - 1.0) * self._urgency(arm),
            limits=self._limits(pose, error, arm),
            reason="reach is short" if arm.reach_margin < self._full else "",
        )

    def ease(self, now: float, arm: ArmStatus) -> Array:
        """(3,) X_OB from which the tool at ``now`` [s] is at ease."""
        tool = arm.tool + arm.tool_velocity * (now - arm.t)
        facing = np.array([tool[0], tool[1], arm.facing])
        return compose(facing, -self._offset)

    def _take_up(self, now: float, arm: ArmStatus) -> None:
        """Let the velocity fed forward follow the tool's."""
        dt = 0.0 if self._newest is None else now - self._newest
        self._newest = now
        tool = np.array([arm.tool_velocity[0], arm.tool_velocity[1], 0.0])
        self._along = self._along + (tool - self._along) * -math.expm1(-dt / SETTLING)

    def _urgency(self, arm: ArmStatus) -> float:
        """0 with twice the floor of reach left, 1 at the floor."""
        left = (arm.reach_margin - self._floor) / (self._full - self._floor)
        return 1.0 - min(max(left, 0.0), 1.0)

    def _limits(self, pose: Array, error: Array, arm: ArmStatus) -> Array:
        """Half-spaces of V_OB_B: how fast the platform may drift away under the tool.

        In terms of the velocity over the ground, so that b stays positive whatever the tool does:
        standing still is allowed always, and then it is the arm that waits.
        """
        tool = arm.tool_velocity[:2]
        spare = RELATIVE * min(1.0, 2.0 * arm.speed_margin)
        rows = []
        for axis in range(2):
            for sign in (1.0, -1.0):
                a = np.zeros(3)
                a[axis] = sign
                rows.append((a, max(sign * float(tool[axis]), 0.0) + spare))
        away = -error[:2]
        distance = math.hypot(*away)
        if distance > OUTWARD:
            a = np.array([*(away / distance), 0.0])
            left = max(arm.reach_margin - self._floor, 0.0) / HORIZON
            rows.append((a, max(float(a[:2] @ tool), 0.0) + left))
        turning = TURN * min(1.0, 2.0 * arm.speed_margin)
        rows += [(np.array([0.0, 0.0, s]), turning) for s in (1.0, -1.0)]
        return np.array([[*rotate(-pose[2], a), b] for a, b in rows])
