"""Runs a program on the arm: reads state and estimate, steps the node, returns torques.

Its states are those of ``arm_states.hds``; in safe hold and in pause contact is released.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from arm.at_rest import AtRest
from arm.board_place import BoardPlace
from arm.control import LowPass, Posture
from arm.control.objective import smooth
from arm.control.torque_law import Gains, TorqueLaw
from arm.control.within import priorities_within
from arm.ground_work import GroundWork
from arm.hds import Program
from arm.limits import Limits
from arm.model import ArmModel
from arm.node_runner import NodeRunner
from arm.nodes import Context, Step, build
from arm.nodes.quantities import quantities
from arm.recovery import Retreat, Return, Station
from arm.reference import JointReference
from deploy.task import BoardPose
from services.messages import ArmCommand, ArmState, ArmStatus, BoardEstimate, Estimate

Array = NDArray[np.float64]

PERIOD = 0.001
"""Of the arm's state [s]."""
SLOWED = 0.1
"""Relative manipulability below which the tool moves slower, ..."""
REFUSED = 0.05
"""... and below which a program is interrupted; a wrist is 0.08 rad from straight there."""
TILTED = 0.2
"""How far the tool may lean where joints at the ends of their ranges hold it back [rad], ..."""
ASTRAY = 0.02
"""... and how far its tip may be from where it should be [m]."""
DEGRADED_PACE = 0.5
"""Share of the speed at which a program goes on while the estimate is late, ..."""
PACE_RATE = 5.0
"""... and how fast the share changes [1/s]."""
AT_REST = ("idle", "paused", "finished")
"""States in which an arm may keep its place or its joints."""
MARGIN_TICKS = 5
"""The distance to the end of the arm's reach is looked at every so many ticks."""
TOUCH = 0.3
"""Pressing force that means contact [N], ..."""
TOUCH_FILTER = 20.0
"""... after a low-pass of this cut-off [Hz]."""
POSTURE = 1.0
"""Rate at which a joint to spare goes to its place at rest [1/s]."""


@dataclass
class _Interrupted:
    """Where a program was when it was stopped: what is needed to come back."""

    desired: Array
    pressing: bool


class Executive(NodeRunner):
    """The arm's process without its process.

    Args:
        robot: name of the robot's folder in deploy/robots.
        board: where the board is believed to be, X_OS.
        gains: of the torque law.
    """

    def __init__(self, robot: str, board: BoardPose, gains: Gains | None = None) -> None:
        self.model = ArmModel(robot)
        self._limits = Limits(self.model)
        still = Step(None, np.zeros(3), np.zeros(3))
        super().__init__("the arm is", build, still, PERIOD, self._limits)
        self._law = TorqueLaw(self.model, gains)
        self._reference = JointReference(
            np.array(self.model.robot.arm.velocity_limit), self.model.q_lower, self.model.q_upper
        )
        self._board = BoardPlace(board)
        self._R_OS, self._p_OS = self._board.R, self._board.p
        self._into_board = -self._R_OS[:, 2]
        self._rest = AtRest()
        self._interrupted: _Interrupted | None = None
        self._desired = np.zeros(3)
        self._felt = LowPass(TOUCH_FILTER)
        self._stiffness = self.model.robot.pen.stiffness
        self._pace = self._calm = 1.0
        self._strokes = 0
        self._entered = 0
        self._drawn: tuple[int, int] | None = None
        self._part = 0
        self._ticks = 0
        self._reach = 0.0
        self._work = GroundWork(self.model)
        # six joints are all that a pen square on a board takes; a seventh is drawn to rest
        rest = np.array(self.model.robot.arm.rest)
        self._spare = Posture(rest, gain=POSTURE) if self.model.joints > 6 else None
        self._still = True

    # --- what the safe states ask of this arm ---------------------------------------------------

    def start(self, program: Program) -> None:
        """Run a checked program from its initial node; ValueError as any executive."""
        super().start(program)
        self._strokes = 0

    @property
    def platform_pose(self) -> Array:
        """Where the platform is taken to be: X_OB, shape (3,) [m, m, rad]."""
        return self._platform.base.pose

    def see_board(self, seen: BoardEstimate | None) -> None:
        """Take in where the observer sees the board, None if it does not."""
        self._board.see(seen)

    def reset(self) -> None:
        """Leave a protective stop; ValueError if it is not in one."""
        super().reset()
        self._t = None  # take the present joint positions for the reference

    def _halt(self, keep_place: bool) -> None:
        if self._working and self._node is not None:
            self._interrupted = _Interrupted(self._desired.copy(), self._node.pressing)
        self._rest.let_go(self._touching(), keep_place)

    def _drop(self, stopped: bool) -> None:
        self._rest.let_go(self._touching(), keep_place=self.sees and not stopped)
        self._node = None
        self._interrupted = None

    def _forget_way_back(self) -> None:
        self._node = self._interrupted = None

    def _come_back(self) -> None:
        """First to where the program was interrupted; one that had not begun just begins."""
        if self._interrupted is None:
            super()._come_back()
            return
        self._rest.take(Return(self._interrupted.desired, self._interrupted.pressing))
        self.states.fire("Resume")

    def _redirected(self, target: str) -> None:
        """A node that presses is entered where the pen pressed when it was interrupted."""
        automaton = self._halted()
        node = automaton.program.node(target)
        presses = not node.terminal and build(node, automaton.program).pressing
        if presses and (self._interrupted is None or not self._interrupted.pressing):
            raise ValueError(
                f"{target} presses on the board, and the pen is not on it; "
                "jump to the node that brings it there"
            )
        if not presses:
            self._interrupted = None  # no need to go back to where it was
        self._node = None

    # --- the tick ---------------------------------------------------------------------------

    def step(
        self, state: ArmState, estimate: Estimate | None
    ) -> tuple[ArmCommand, ArmStatus | None]:
        """Compute the torques for one arm state.

        Everything is aligned to the instant of ``state``: the estimate is advanced to it, and the
        reference is the one intended then.

        Args:
            state: newest joint state.
            estimate: newest platform estimate, None before the first.

        Returns:
            The command, and a status when one is due.
        """
        dt = self._begin(state, estimate)
        if not self._platform.problem:
            self._rest.find_place(self.state in AT_REST)
        self._calm_down(dt)
        base = self._platform.base
        self._board.follow(state.t)
        if self._board.R is not self._R_OS:  # it is seen to drift
            self._R_OS, self._p_OS = self._board.R, self._board.p
            self._into_board = -self._R_OS[:, 2]
        reference = self._reference
        reference.advance(dt)
        kinematics = self.model.place(base, reference.q, reference.qd)
        contact = -kinematics.R.dot(state.wrench[:3])  # of the tool on the world, in O
        self._ticks += 1
        if self._ticks % MARGIN_TICKS == 1:
            self._reach = self._limits.reach_margin()
        reach = self._reach
        force = float(self._into_board.dot(contact))
        self._felt.step(force, dt)
        context = Context(
            dt=dt,
            kinematics=kinematics,
            base=base,
            R_OS=self._R_OS,
            p_OS=self._p_OS,
            force=force,
            reach_margin=reach,
            desired=self._desired,
            velocity=self._step.velocity,
            contact=contact,
            stiffness=self._stiffness,
            pace=self._pace,
            drift=self._board.velocity,
        )
        self._run(context)
        objective = self._step.objective
        if objective is None:
            wanted = np.zeros(self.model.joints)
            if self._spare is not None and not self._still:
                reference.switch()  # its own motion ends with the objective's
        else:
            parts = objective.parts() if self._spare is None else (*objective.parts(), self._spare)
            ends = self._limits.ends(reference.q)
            rows = [p.rows(kinematics, dt) for p in parts]
            solution, held = priorities_within(rows, ends.lowest, ends.highest)
            wanted = solution.qd
            self._mind(solution.manipulability, held)
            self._mind_the_ends(context, held)
        self._still = objective is None
        reference.follow(wanted, dt)
        tau = self._law.torque(
            dt,
            state.q,
            state.qd,
            reference.q,
            reference.qd,
            base,
            kinematics,
            contact if self._touching() else None,
        )
        violated = self._limits.violated(
            dt,
            state.q,
            state.qd,
            reference.q,
            state.wrench,
            self._law.saturated,
            reference.clamped,
            reach if self._moving else None,
        )
        if violated is not None:
            self.protective_stop(violated)
            if violated.startswith("tracking"):
                self._t = None  # do not go on pulling towards a reference the arm cannot reach
        return ArmCommand(t=state.t, tau=tau), self._status(state.t)

    def _after_gap(self, state: ArmState) -> None:
        """Take the present joint positions for the reference."""
        self._reference.reset(state.q)
        self._law.reset(np.zeros(self.model.joints))
        if isinstance(self._rest.motion, Station):
            self._rest.take(Retreat(0.0))
        self._step = Step(None, self._step.desired, np.zeros(3))

    def _without_estimate(self, problem: str) -> None:
        super()._without_estimate(problem)
        self._rest.lose_place()

    # --- what is in control -----------------------------------------------------------------

    def _run(self, context: Context) -> None:
        if self._start_node:
            context.desired = context.tip
        super()._run(context)

    def _prepare(self, context: Context) -> None:
        """Without a program, see to what the arm does by itself."""
        if self._working:
            return
        held = self.state in AT_REST and self.sees and not self._touching()
        left = self.model.joint_margin(self._reference.stopping)
        self._rest.mind_the_board(context, held, left)
        if self._rest.begin(context):
            self._reference.switch()
        if self._rest.motion is None:
            self._step = Step(None, context.tip, np.zeros(3))

    @property
    def _steps(self) -> bool:
        return self._working or self._rest.motion is not None

    def _advance(self, context: Context) -> Step:
        control: Any = self._node if self._working else self._rest.motion
        step: Step = control.update(context)
        return step

    def _update(self, context: Context) -> None:
        super()._update(context)
        step: Step = self._step
        context.desired = self._desired = step.desired
        if step.part != self._part:
            self._part = step.part
            self._reference.switch()
        if step.drawing and self._drawn != (self._entered, step.part):
            self._drawn = (self._entered, step.part)
            self._strokes += 1

    def _follow(self, context: Context) -> bool:
        """As any, or back from an interruption."""
        if self.state != "resuming":
            return super()._follow(context)
        if self._step.event == "Out_of_Reach":
            self._interrupt("Failed", "the board is not where it was")
            return False
        self._interrupted = None
        self.states.fire("Back")
        if self._node is None:  # it was told to go on elsewhere
            self._next_node(context)
            return True
        self._node.resume(context)
        self._reference.switch()
        self._tell("resume")
        return True

    def _enter(self, context: Context) -> None:
        self._entered += 1
        self._part = 0
        self._reference.switch()
        self._node.enter(context)

    def _end(self, context: Context) -> None:
        self._node = None
        self._rest.take(Station(0.0))
        self._rest.begin(context)
        self._reference.switch()

    def _values(self, context: Context) -> Mapping[str, float]:
        return quantities(context, self._step, self._in_node, self._felt.value)

    def _calm_down(self, dt: float) -> None:
        """Draw slower while the estimate is late; the speed changes gradually."""
        wanted = DEGRADED_PACE if self.state == "degraded" else 1.0
        self._calm += float(np.clip(wanted - self._calm, -PACE_RATE * dt, PACE_RATE * dt))

    def _mind(self, manipulability: float, held: list[int]) -> None:
        """Slow down towards a singular posture, and refuse to go on right at it.

        There a small motion of the tool asks for any motion of the joints. The platform may drive
        the arm there as well, which no slowness helps against. Where joints are held at the ends
        of their ranges, it is what the others can still do that counts.
        """
        self._pace = self._calm * smooth((manipulability - REFUSED) / (SLOWED - REFUSED))
        if manipulability < REFUSED and self._moving:
            why = f"manipulability {manipulability:.3f}{self._at_the_end(held)}"
            self._interrupt("Failed", f"near a singular posture: {why}")

    def _mind_the_ends(self, context: Context, held: list[int]) -> None:
        """Joints at the ends of their ranges may lean the tool, but not lay it down or astray."""
        if not held or not (self._working and self._moving):
            return
        tilt = math.acos(
            min(max(float(self._into_board.dot(context.kinematics.R[:, 2])), -1.0), 1.0)
        )
        off = float(np.linalg.norm(context.tip - self._desired))
        if tilt > TILTED:
            why = f"the tool leans by {math.degrees(tilt):.0f} deg"
        elif off > ASTRAY:
            why = f"the tip is {1e3 * off:.0f} mm from where it should be"
        else:
            return
        self._interrupt("Failed", why + self._at_the_end(held))

    def _at_the_end(self, held: list[int]) -> str:
        names = [self.model.robot.arm.joints[i] for i in held]
        return f", with {' and '.join(names)} near the end of range" if names else ""

    def _pressing(self) -> bool:
        """Whether a node of a running program is at work on the board."""
        return self._working and self._node is not None and self._node.pressing

    def _touching(self) -> bool:
        """Whether the tool may be in contact."""
        return self._pressing() or self._felt.value > TOUCH

    # --- what people see ----------------------------------------------------------------------

    def _more(self, now: float) -> Mapping[str, Any]:
        step: Step = self._step
        return {
            "stroke": self._strokes if step.drawing else 0,
            "reference": step.desired,
            "reference_velocity": step.velocity,
            "force": step.filtered,
            "force_reference": step.force,
            "reach_margin": self._reach,
            **self._work.of(now, step, self._pressing(), self._R_OS, self._p_OS, self._reference),
        }
