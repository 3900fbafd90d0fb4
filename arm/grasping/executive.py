"""Runs a program on two arms: reads state, estimates, steps the node, returns torques.

Its states are those of ``arm_states.hds``. Whatever happens, a box between the palms is not let go
of by itself.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from arm.grasping.feel import Feel
from arm.grasping.hands import Hands, Move
from arm.grasping.law import Gains, Law
from arm.grasping.model import JOINTS, Palms, TwoArmModel
from arm.grasping.nodes import Control, Step, build
from arm.grasping.nodes.carrying import carried
from arm.grasping.nodes.node import quantities
from arm.grasping.regions import Regions
from arm.grasping.scene import BoxPlace, Faces, Scene, between, box_in_platform
from arm.hds import Program
from arm.joint_limits import PATIENCE, JointLimits
from arm.node_runner import NodeRunner
from services.messages import ArmCommand, ArmState, ArmStatus, Estimate, ObjectEstimate

Array = NDArray[np.float64]

BOX_AGE = 0.3
"""A message about the box older than this is none [s]."""
BOX_SD = 0.15
"""A box known no better than this is not known [m]."""
PARTED = 1.0
"""A palm that has not come back to what it held for this long has lost it [s]."""
STIFFNESS = 4.0
"""Of joints that are held [1/s]."""


class GraspExecutive(NodeRunner):
    """The process of two arms without its process.

    Args:
        robot: name of the robot's folder in deploy/robots.
        size: of the box along x, y, z of X, as the task states it [m].
        gains: of the torque law.
    """

    def __init__(
        self, robot: str, size: tuple[float, float, float], gains: Gains | None = None
    ) -> None:
        self.model = TwoArmModel(robot)
        made, ends = self.model.robot, (self.model.q_lower, self.model.q_upper)
        arms, palms = made.arms, made.palms
        self._limits = JointLimits(arms.joints, *ends, arms.velocity_limit * 2, PATIENCE)
        super().__init__("the arms are", build, Step(), made.period, self._limits)
        self.hands = Hands(np.array(arms.rest), *ends, palms.pad.stiffness)
        self.feel = Feel()
        self.regions = Regions()
        self._law = Law(self.model, gains)
        self._size = np.array(size)
        self._faces = Faces()
        self._half_palm = 0.5 * np.array(palms.size)
        self._seen: ObjectEstimate | None = None
        self._placed = False
        self._held_at: Array | None = None
        self._holding = False
        self._parted = 0.0
        self._lifted = False

    def start(self, program: Program) -> None:
        """Run a checked program from its initial node; ValueError as any executive."""
        super().start(program)
        if not any(self.feel.touches):
            self._faces = Faces()  # the box may have been put elsewhere since

    # --- what the safe states ask of these arms -------------------------------------------------

    def _halt(self, keep_place: bool) -> None:
        """Hold still, with what is held."""
        self._holding = self._lifted and any(self.feel.touches)
        self.hands.carry.speed = 0.0
        self._changed |= self._step.goal is not None
        self._step = Step(lifted=self._lifted)

    def _drop(self, stopped: bool) -> None:
        self._halt(keep_place=True)
        self._node = None
        if stopped:
            self._held_at = None  # what was pushed to a limit is not flung back from there

    # --- the tick ---------------------------------------------------------------------------

    def see_box(self, seen: ObjectEstimate | None) -> None:
        """Take in where the observer believes the box to be, None if it does not know."""
        self._seen = seen

    def step(
        self, state: ArmState, estimate: Estimate | None
    ) -> tuple[ArmCommand, ArmStatus | None]:
        """Compute the torques for one state of the arms.

        Args:
            state: newest joint states and load cells.
            estimate: newest platform estimate, None before the first.

        Returns:
            The command, and a status when one is due.
        """
        dt = self._begin(state, self._trusted(estimate))
        palms = self.model.place(state.q, state.qd)
        self.feel.step(state.wrench, dt)
        scene = self._scene(dt, state, palms)
        self.regions.step(scene, self._lifted)
        if self._working:
            self._run(scene)
        move = self._move(scene)
        if move.controller is None:
            if self._held_at is None:
                self._held_at = state.q.copy()
            wanted, extra = STIFFNESS * (self._held_at - state.q), np.zeros(JOINTS)
        else:
            self._held_at = None
            wanted, extra = self.hands.execute(move, scene, state.qd)
        free = not any(self.feel.touches)
        hard = float(np.abs(self.feel.pushed).max()) > self.hands.yields.limit
        ends = self._limits.ends(state.q)
        tau = self._law.torque(dt, wanted, state.qd, extra, free, ends, hard)
        violated = self._limits.violated(dt, state.q, state.qd)
        if violated is not None:
            self.protective_stop(violated)
        return ArmCommand(t=state.t, tau=tau), self._status(state.t)

    def _after_gap(self, state: ArmState) -> None:
        self._law.reset()

    def _trusted(self, estimate: Estimate | None) -> Estimate | None:
        """The estimate, uncertain as it may be once it has been good.

        Box and platform are seen from the same uncertain place, which cancels: a push that costs
        the platform its place in O must not cost the hands what they hold.
        """
        if estimate is None:
            return None
        self._placed = self._placed or estimate.valid
        return replace(estimate, valid=True) if self._placed else estimate

    def _scene(self, dt: float, state: ArmState, palms: Palms) -> Scene:
        box: BoxPlace | None = None
        age = math.inf
        seen, base = self._seen, self._platform.base
        if seen is not None and state.t - seen.t <= BOX_AGE:
            free = not (self._lifted or any(self.feel.touches))
            place = box_in_platform(seen, base, self._size, self._faces, free)
            age = seen.age + state.t - seen.t
            if float(place.sd[:3].max()) <= BOX_SD:
                box = place
        if box is None and self._holding:  # what is held is where the palms are
            box = between(palms, self._faces.size(self._size))
        return Scene(
            dt,
            state.t,
            palms,
            self.feel,
            base,
            box,
            age,
            self._faces.size(self._size),
            self._half_palm,
        )

    def _move(self, scene: Scene) -> Move:
        """What the hands do: the node's, or holding still, with what they hold."""
        if self._working:
            return self._step.move
        # a palm that has lost touch comes back to what the other one keeps
        self._parted = 0.0 if self.feel.both else self._parted + scene.dt
        wide = scene.width > 0.5 * float(scene.size[1])
        if self._holding and wide and self._parted < PARTED and any(self.feel.touches):
            return carried(self.hands)
        self._holding = False
        return Move(None)

    def _advance(self, scene: Scene) -> Step | None:
        node: Control = self._node
        if node.needs_box and scene.box is None:
            self._interrupt("Failed", "the box is not known")
            return None
        step = node.update(scene, self.hands, self.regions)
        self._lifted = step.lifted
        return step

    def _enter(self, scene: Scene) -> None:
        if self._node.needs_box and scene.box is None:
            self._interrupt("Failed", "the box is not known")
            return
        self._node.enter(scene, self.hands, self.regions)

    def _end(self, scene: Scene) -> None:
        self._node = None
        self._hold(scene)

    def _values(self, scene: Scene) -> Mapping[str, float]:
        return quantities(scene, self.regions, self._in_node)

    # --- interruptions ----------------------------------------------------------------------

    def _hold(self, scene: Scene | None) -> None:
        """Keep what is held, where it is."""
        self._holding = self.feel.both
        if self._holding and not self._lifted and scene is not None:
            self.hands.carry.capture(scene)
            self.hands.roll.capture(scene)
            self.hands.force.keep(scene)
        self.hands.carry.speed = 0.0
        self._step = Step(lifted=self._lifted)

    # --- what people see --------------------------------------------------------------------

    def _more(self, now: float) -> Mapping[str, Any]:
        return {
            "force": float(self.feel.force.min()),
            "force_reference": float(self.hands.force.force.min()),
        }
