"""What the platform needs to know of the arm's work on the ground: where it is, how it reacts."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from arm.model import ArmModel, Array
from arm.nodes import Step
from arm.reference import JointReference

LONGEST = 0.05
"""Over more time than this the change of momentum says nothing of a force [s]."""


class GroundWork:
    """Fills in the part of the arm's status that the platform moves by.

    The reaction is the loss of the momentum that the joints' reference gives the robot. It needs
    no acceleration, and being a mean since the last status it misses nothing in between.

    Args:
        model: of the arm, placed at the reference.
    """

    def __init__(self, model: ArmModel) -> None:
        self._model = model
        self._limit = np.array(model.robot.arm.velocity_limit)
        self._momentum = np.zeros(3)
        self._t = -math.inf

    def of(
        self,
        now: float,
        step: Step,
        pressing: bool,
        R_OS: Array,
        p_OS: Array,
        reference: JointReference,
    ) -> dict[str, Any]:
        """Fields of ``ArmStatus`` at ``now`` [s].

        Args:
            now: robot time [s].
            step: last of the node in control.
            pressing: it is at work on the board.
            R_OS: orientation of the board, (3, 3).
            p_OS: position of the board, (3,) [m].
            reference: of the joints.
        """
        momentum = self._model.carried_momentum(reference.qd)
        since, self._t = now - self._t, now
        gained, self._momentum = momentum - self._momentum, momentum
        reaction = -gained / since if 0.0 < since < LONGEST else np.zeros(3)
        return {
            "anchored": pressing,
            "tool": p_OS + R_OS @ step.desired,
            "tool_velocity": R_OS @ step.velocity,
            "facing": math.atan2(-R_OS[1, 2], -R_OS[0, 2]),
            "speed_margin": max(0.0, 1.0 - float((np.abs(reference.qd) / self._limit).max())),
            "reaction": reaction,
            "recoil": self._model.recoil(reaction),
        }
