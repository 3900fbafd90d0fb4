"""Runs a program on the arm: reads state and estimate, steps the node, returns torques.

Its states are those of ``arm_states.hds``; in safe hold and in pause contact is released.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import PurePath

import numpy as np
from numpy.typing import NDArray

from arm.board_place import BoardPlace
from arm.control import LowPass, Posture
from arm.control.objective import smooth
from arm.control.priority import priorities
from arm.control.torque_law import Gains, TorqueLaw
from arm.ground_work import GroundWork
from arm.hds import Program
from arm.limits import Limits
from arm.model import ArmModel
from arm.nodes import Context, Control, Step, Wait, build
from arm.nodes.quantities import quantities
from arm.platform_motion import PlatformMotion
from arm.program_runner import ProgramRunner
from arm.recovery import AWAY, Retreat, Return, Station
from arm.reference import JointReference
from deploy.task import BoardPose
from services.messages import ArmCommand, ArmState, ArmStatus, BoardEstimate, Estimate

Array = NDArray[np.float64]

LONGEST_TICK = 0.05
"""After a gap in the arm's state longer than this the reference starts anew [s]."""
LEAVING = 0.03
"""Left of the arm's reach when an arm that only keeps its place lets go of it [m] ..."""
LEAVING_JOINT = 0.1
"""... and of a joint's range once it has come to rest [rad]."""
NEAR = 0.03
"""An arm at rest nearer to the board than this keeps its place over it [m]."""
SLOWED = 0.1
"""Relative manipulability below which the tool moves slower, ..."""
REFUSED = 0.05
"""... and below which a program is interrupted; a wrist is 0.08 rad from straight there."""
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
STATUS_PERIOD = 0.02
"""[s]"""


@dataclass
class _Interrupted:
    """Where a program was when it was stopped: what is needed to come back."""

    desired: Array
    pressing: bool


class Executive(ProgramRunner):
    """The arm's process without its process.

    Args:
        robot: name of the robot's folder in deploy/robots.
        board: where the board is believed to be, X_OS.
        gains: of the torque law.
    """

    def __init__(self, robot: str, board: BoardPose, gains: Gains | None = None) -> None:
        super().__init__("the arm is", build)
        self.model = ArmModel(robot)
        self._law = TorqueLaw(self.model, gains)
        self._limits = Limits(self.model)
        self._reference = JointReference(np.array(self.model.robot.arm.velocity_limit))
        self._board = BoardPlace(board)
        self._R_OS, self._p_OS = self._board.R, self._board.p
        self._into_board = -self._R_OS[:, 2]
        self._control: Control | Retreat | Return | Station | None = None
        self._node: Control | None = None
        self._interrupted: _Interrupted | None = None
        self._desired = np.zeros(3)
        self._last = Step(None, np.zeros(3), np.zeros(3))
        self._felt = LowPass(TOUCH_FILTER)
        self._stiffness = self.model.robot.pen.stiffness
        self._pace = self._calm = 1.0
        self._platform = PlatformMotion()
        self._t: float | None = None
        self._strokes = 0
        self._in_node = 0.0
        self._new_node = False
        self._entered = 0
        self._drawn: tuple[int, int] | None = None
        self._part = 0
        self._goal: Array | None = None
        self._goals = 0
        self._note = ""
        self._status_due = 0.0
        self._ticks = 0
        self._reach = 0.0
        self._start_control = False
        self._resync = False
        self._station_lost = False
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
        self._note = ""

    @property
    def sees(self) -> bool:
        """Whether there is a usable estimate of the platform."""
        return self._t is not None and not self._platform.problem

    def signal(self, name: str) -> None:
        """Tell the program of an event outside it.

        Raises:
            ValueError: no node waits for it now.
        """
        if not self._working or not isinstance(self._node, Wait):
            where = f" in {self._automaton.node.name}" if self._automaton else ""
            raise ValueError(f"no node waits for an event: {self.states}{where}")
        self._node.signal(name)

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
        self._limits.excuse()

    def _problem(self) -> str:
        return self._platform.problem

    def _halt(self, keep_place: bool) -> None:
        if self._working and self._node is not None:
            self._interrupted = _Interrupted(self._desired.copy(), self._node.pressing)
        self._let_go(keep_place)

    def _drop(self, stopped: bool) -> None:
        self._let_go(keep_place=self.sees and not stopped)
        self._node = None
        self._interrupted = None

    def _begin_anew(self) -> None:
        self._interrupted = None

    def _come_back(self) -> None:
        """First to where the program was interrupted; one that had not begun just begins."""
        if self._interrupted is None:
            super()._come_back()
            return
        self._take(Return(self._interrupted.desired, self._interrupted.pressing))
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
        dt = 0.001 if self._t is None else state.t - self._t
        if self._t is None or dt > LONGEST_TICK or self._resync:
            self._restart(state)
            dt = 0.001
        self._t = state.t
        problem = self._platform.follow(dt, state.t, estimate)
        if problem:
            self._without_estimate(problem)
        elif self._station_lost:
            self._station_lost = False
            if isinstance(self._control, Retreat) and self.state in AT_REST:
                self._take(Station(0.0))
        self._calm_down(dt, state.t, estimate)
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
            velocity=self._last.velocity,
            contact=contact,
            stiffness=self._stiffness,
            pace=self._pace,
            drift=self._board.velocity,
        )
        self._run(context)
        objective = self._last.objective
        if objective is None:
            wanted = np.zeros(self.model.joints)
            if self._spare is not None and not self._still:
                reference.switch()  # its own motion ends with the objective's
        else:
            parts = objective.parts() if self._spare is None else (*objective.parts(), self._spare)
            solution = priorities([p.rows(kinematics, dt) for p in parts], self.model.joints)
            wanted = solution.qd
            self._mind(solution.manipulability)
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
            # do not go on pulling towards a reference the arm cannot reach
            self._resync = violated.startswith("tracking")
        return ArmCommand(t=state.t, tau=tau), self._status(state.t)

    def _restart(self, state: ArmState) -> None:
        """Take the present joint positions for the reference, after a start or a gap."""
        self._resync = False
        self._reference.reset(state.q)
        self._law.reset(np.zeros(self.model.joints))
        if isinstance(self._control, Station):
            self._take(Retreat(0.0))
        self._last = Step(None, self._last.desired, np.zeros(3))
        if self._t is not None and self._moving:
            self._interrupt("Failed", "the arm's own state was late")

    def _without_estimate(self, problem: str) -> None:
        """Whatever relies on the platform's motion must stop relying on it."""
        if self._moving:
            self._interrupt("Failed", problem)
        elif self.state == "safe_hold":
            self.states.reason = problem
        elif isinstance(self._control, Station):  # nothing to keep a place by, for now
            self._take(Retreat(0.0))
            self._station_lost = True

    def _run(self, context: Context) -> None:
        """Step what is in control, and follow its events."""
        self._new_node = False
        if self._start_node:
            self._start_node = False
            context.desired = context.tip
            self._next_node(context)
        self._mind_the_board(context)
        if self._start_control and self._control is not None:
            self._start_control = False
            self._control.enter(context)
            self._reference.switch()
        if self._control is None:
            self._last = Step(None, context.tip, np.zeros(3))
            return
        self._update(self._control, context)
        if self._guarded(context):
            self._update(self._control, context)
        # what follows takes over within this tick; the language refuses cycles that take no time
        while self._last.event is not None and self._follow(self._last.event, context):
            self._update(self._control, context)

    def _mind_the_board(self, context: Context) -> None:
        """An arm at rest comes along with the platform, but not into the board."""
        keeps = isinstance(self._control, Station)
        held = self.state in AT_REST and self.sees and not self._touching()
        if not keeps and not (held and context.tip[2] < NEAR):
            return
        left = self.model.joint_margin(self._reference.stopping)
        can = context.reach_margin > LEAVING and left > LEAVING_JOINT
        if keeps and not can:
            self._take(Retreat(0.0))
        elif can and not keeps:
            self._take(Station(0.0))

    def _update(self, control: Control | Retreat | Return | Station, context: Context) -> None:
        """Take one step of what is in control."""
        step = self._last = control.update(context)
        self._desired = step.desired
        if step.part != self._part:
            self._part = step.part
            self._reference.switch()
        if step.drawing and self._drawn != (self._entered, step.part):
            self._drawn = (self._entered, step.part)
            self._strokes += 1
        if step.goal is None:
            self._changed |= self._goal is not None
        elif self._goal is None or (step.goal != self._goal).any():
            self._goals += 1
            self._changed = True
        self._goal = step.goal

    def _follow(self, event: str, context: Context) -> bool:
        """Act on an event; returns whether there is something new in control."""
        context.desired = self._desired
        if self.state == "resuming" and event == "Out_of_Reach":
            self._interrupt("Failed", "the board is not where it was")
            return False
        if self.state == "resuming" and self._node is None:  # it was told to go on elsewhere
            self._interrupted = None
            self.states.fire("Back")
            self._next_node(context)
            return True
        if self.state == "resuming" and self._node is not None:
            self._control = self._node
            self._node.resume(context)
            self._reference.switch()
            self._interrupted = None
            self._event = "resume"
            self.states.fire("Back")
            return True
        if self._working and self._automaton is not None:
            self._event = event
            self._note = self._last.reason
            self._automaton.fire(event)
            self._next_node(context)
            return True
        return False

    def _guarded(self, context: Context) -> bool:
        """Follow a guard that holds, unless the node is new or has raised an event."""
        automaton = self._automaton
        if not self._working or automaton is None or self._new_node:
            return False
        self._in_node += context.dt
        if self._last.event is not None or not automaton.guards:
            return False
        values = quantities(context, self._last, self._in_node, self._felt.value)
        if automaton.check_guards(values) is None:
            return False
        self._event, self._note = automaton.history[-1].event, ""
        context.desired = self._desired
        self._next_node(context)
        return True

    def _next_node(self, context: Context) -> None:
        """Enter the automaton's current node."""
        assert self._automaton is not None
        self._in_node = 0.0
        self._new_node = True
        self._changed = True
        self._reference.switch()
        if self._automaton.finished:
            self._node = None
            self._control = Station(0.0)
            self._control.enter(context)
            self.states.fire("Done")
            return
        node = self._automaton.node
        self._node = self._control = build(node, self._automaton.program)
        self._entered += 1
        self._part = 0
        self._node.enter(context)

    # --- interruptions ----------------------------------------------------------------------

    def _let_go(self, keep_place: bool = False) -> None:
        """Back off from what the tool touches, then keep its place or hold the joints."""
        distance = AWAY if self._touching() else 0.0
        self._take(Station(distance) if keep_place else Retreat(distance))

    def _take(self, control: Retreat | Return | Station) -> None:
        """Put a motion that belongs to no program in control, from the next tick on."""
        self._control = control
        self._start_control = True

    def _calm_down(self, dt: float, now: float, estimate: Estimate | None) -> None:
        """Draw slower while the estimate is late; the speed changes gradually."""
        if estimate is not None:
            self._look_at_age(now - estimate.t)
        wanted = DEGRADED_PACE if self.state == "degraded" else 1.0
        self._calm += float(np.clip(wanted - self._calm, -PACE_RATE * dt, PACE_RATE * dt))

    def _mind(self, manipulability: float) -> None:
        """Slow down towards a singular posture, and refuse to go on right at it.

        There a small motion of the tool asks for any motion of the joints. The platform may drive
        the arm there as well, which no slowness helps against.
        """
        self._pace = self._calm * smooth((manipulability - REFUSED) / (SLOWED - REFUSED))
        if manipulability < REFUSED and self._moving:
            self._interrupt(
                "Failed", f"near a singular posture: manipulability {manipulability:.3f}"
            )

    @property
    def _moving(self) -> bool:
        """Whether a program has the arm, or it is on its way back to one."""
        return self._working or self.state == "resuming"

    def _pressing(self) -> bool:
        """Whether a node of a running program is at work on the board."""
        return self._working and self._node is not None and self._node.pressing

    def _touching(self) -> bool:
        """Whether the tool may be in contact."""
        pressing = self._control is not None and self._control.pressing
        return pressing or self._felt.value > TOUCH

    # --- what people see ----------------------------------------------------------------------

    def _status(self, now: float) -> ArmStatus | None:
        if not self._changed and now + 1e-9 < self._status_due:
            return None
        self._changed = False
        self._status_due = now + STATUS_PERIOD
        automaton = self._automaton
        reason = self.reason or self._note
        if self._halting and automaton:
            reason = f"{reason}; interrupted in {automaton.node.name}: resume or stop the program"
        return ArmStatus(
            t=now,
            state=self.state,
            program=PurePath(automaton.program.path).name if automaton else "",
            node=automaton.node.name if automaton else "",
            event=self._event,
            transitions=automaton.transitions if automaton else 0,
            reason=reason,
            stroke=self._strokes if self._last.drawing else 0,
            reference=self._last.desired,
            reference_velocity=self._last.velocity,
            force=self._last.filtered,
            force_reference=self._last.force,
            reach_margin=self._reach,
            joint_margin=self._limits.joint_margin,
            goal_number=0 if self._goal is None else self._goals,
            goal=np.zeros(3) if self._goal is None else self._goal,
            **self._work.of(
                now, self._last, self._pressing(), self._R_OS, self._p_OS, self._reference
            ),
        )
