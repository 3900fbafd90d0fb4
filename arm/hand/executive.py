"""Runs a program of an arm with a hand: reads states and estimate, steps the node, torques out.

Its states are those of ``arm_states.hds``. Whatever interrupts a program, joints are held where
they were meant to be and a bottle between the fingers stays squeezed.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from arm.hand.handling import Handling, Scene
from arm.hand.model import ARM, Placed
from arm.hand.nodes import Control, Step, build
from arm.hand.nodes.node import quantities
from arm.hds import Program
from arm.joint_limits import PATIENCE, JointLimits
from arm.node_runner import NodeRunner
from deploy.task import BottleTask
from services.messages import ArmCommand, ArmState, ArmStatus, Estimate, HandCommand, HandState


class HandExecutive(NodeRunner):
    """The process of an arm with a hand without its process.

    Args:
        robot: name of the robot's folder in deploy/robots.
        task: what to fetch.
        seed: of the reaches that are drawn.

    Attributes:
        hand_command: torques of the hand of the last step.
    """

    def __init__(self, robot: str, task: BottleTask, seed: int = 0) -> None:
        self.hand = Handling(robot, task, seed)
        model = self.hand.model
        arm, ends = model.robot.arm, (model.lower[ARM], model.upper[ARM])
        # fingers lie at the ends of theirs: open, and on what is thin
        self._limits = JointLimits(arm.joints, *ends, arm.velocity_limit, PATIENCE)
        super().__init__("the arm is", build, Step(), model.robot.period, self._limits)
        self._hand_state: HandState | None = None
        self.hand_command = HandCommand(t=0.0, tau=np.zeros(4))
        self._at: Placed | None = None

    def see_hand(self, state: HandState) -> None:
        """Take in the hand's newest state; needed before the first step."""
        self._hand_state = state

    def step(self, arm: ArmState, estimate: Estimate | None) -> tuple[ArmCommand, ArmStatus | None]:
        """Torques for one state of arm and hand, and a status when one is due.

        Those of the hand are ``hand_command``.
        """
        hand = self._hand_state
        assert hand is not None
        dt = self._begin(arm, estimate)
        self.hand.model.move(self._platform.base)
        q, qd = np.concatenate([arm.q, hand.q]), np.concatenate([arm.qd, hand.qd])
        at = self.hand.model.place(q, qd)
        if self._at is None:
            self.hand.take(at)
        self._at = at
        scene = Scene(dt, arm.t, at, hand.cells, hand.struck, self._platform.base)
        self.hand.sense(scene, self._node is not None and self._node.feels)
        if self._working:
            self._run(scene)
        tau = self._step.torque if self._working else None
        if tau is None:
            tau = self.hand.torque(at)
        violated = self._limits.violated(dt, arm.q, arm.qd)
        if violated is not None:
            self.protective_stop(violated)
        self.hand_command = HandCommand(t=hand.t, tau=tau[7:])
        return ArmCommand(t=arm.t, tau=tau[:7]), self._status(arm.t)

    # --- the program ------------------------------------------------------------------------

    def start(self, program: Program) -> None:
        """Run a checked program; what was tried before is forgotten."""
        super().start(program)
        self.hand.begin()

    def _advance(self, scene: Scene) -> Step:
        node: Control = self._node
        return node.update(scene, self.hand)

    def _enter(self, scene: Scene) -> None:
        self._node.enter(scene, self.hand)

    def _end(self, scene: Scene) -> None:
        self._halt(keep_place=True)

    def _values(self, scene: Scene) -> Mapping[str, float]:
        return quantities(self.hand, self._in_node)

    def _drop(self, stopped: bool) -> None:
        self._halt(keep_place=True)
        if stopped and self._at is not None:
            # what was pushed to a limit is not flung back from there; fingers go on squeezing
            self.hand.reference[ARM] = self._at.q[ARM]

    def _halt(self, keep_place: bool) -> None:
        if self._step.torque is not None and self._at is not None:
            self.hand.take(self._at)  # a grasp is cut off: its fingers stay where they are
        self._changed |= self._step.goal is not None
        self._node, self._step = None, Step()
        self.hand.stay()

    def _more(self, now: float) -> Mapping[str, Any]:
        none = self._step.residuals is None
        return {
            "force": float(np.linalg.norm(self.hand.feel.force, axis=1).min()),
            "force_reference": self.hand.squeeze,
            "stand": self._step.stand,
            "residuals": np.zeros(0) if none else self._step.residuals,
        }
