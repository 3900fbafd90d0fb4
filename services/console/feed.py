"""What the page shows, gathered from messages, live or of a log; it knows neither bus nor page."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from services import topics as T
from services.console.ink import Ink
from services.console.track import Track
from services.messages import ArmState, ArmStatus, BaseStatus, Estimate, Health, Message, Truth

Array = NDArray[np.float64]

INPUTS: tuple[T.Topic, ...] = (
    T.ARM_STATE,
    T.CLOCK,
    T.ESTIMATE,
    T.BOARD,
    T.OBJECT,
    T.SCAN,
    T.BUMPER,
    # of these none is to be missed: ink, and events of the automaton
    replace(T.TRUTH, depth=64),
    replace(T.ARM_STATUS, depth=32),
    replace(T.BASE_STATUS, depth=16),
    *(replace(topic, depth=4) for topic in T.HEALTH.values()),
)
"""What is heard; of the fast topics only the newest message of a frame is so much as decoded."""

TRACKS = {
    "velocity": 3,
    "error": 7,
    "odometry": 3,
    "imu": 3,
    "nis": 2,
    "bias": 3,
    "force": 3,
    "lateness": len(T.SERVICES),
}
"""Columns of what is plotted; ``plots.py`` says what they are."""

EVENTS = 8
NEAR = 0.006
"""Truth further away in time from an estimate than this says nothing of its error [s]."""
TRAIL_STEP, TRAIL_LENGTH = 0.01, 800  # [m], points


@dataclass
class Seen:
    """A service as seen from here."""

    health: Health
    at: float
    """When it was heard, by the clock of whoever calls ``hear`` [s]."""


class Feed:
    """The newest message of each topic, and what has to be remembered of earlier ones."""

    def __init__(self) -> None:
        self._latest: dict[str, Message] = {}
        self.tracks = {name: Track(columns) for name, columns in TRACKS.items()}
        self.services: dict[str, Seen] = {}
        self.events: deque[tuple[float, str]] = deque(maxlen=EVENTS)
        self.ink = Ink()
        self.trail: deque[Array] = deque(maxlen=TRAIL_LENGTH)
        self.t = 0.0
        """Newest robot time heard [s]."""
        self.offset = np.zeros(3)
        """X_WO as x, y [m], heading [rad]: where odometry's frame is in the world.

        Zero without truth: the picture is then the robot's own.
        """
        self.error = np.zeros(3)
        """Estimated minus true pose at one and the same instant; zero without truth."""
        self._truths: deque[Truth] = deque(maxlen=128)
        self._unmatched: deque[Estimate] = deque(maxlen=8)
        self._p99 = dict.fromkeys(T.SERVICES, np.nan)

    def latest(self, topic: T.Topic[T.M]) -> T.M | None:
        """The newest message of a topic, None before the first."""
        return self._latest.get(topic.name)  # type: ignore[return-value]

    def hear(self, topic: T.Topic, message: Message, at: float) -> None:
        """Take one message in.

        Args:
            topic: of the message.
            message: checked.
            at: when it was heard [s].
        """
        if topic.owner == "sim" and not isinstance(message, Health):
            if message.t < self.t - 1.0:  # another run: nothing of the one before is true any more
                self._begin_anew()
            self.t = max(self.t, message.t)
        before = self._latest.get(topic.name)
        self._latest[topic.name] = message
        if isinstance(message, Health):
            self._hear_health(message, at)
        elif isinstance(message, Estimate):
            self._hear_estimate(message)
        elif isinstance(message, Truth):
            self._truths.append(message)
            self._match()
            self.ink.touch(message.tip, message.contact)
        elif isinstance(message, ArmStatus):
            self._hear_arm(message, before)
        elif isinstance(message, BaseStatus):
            self._hear_base(message, before)
        elif isinstance(message, ArmState):
            self._hear_state(message)

    def _begin_anew(self) -> None:
        services = self.services
        self.__init__()  # type: ignore[misc]
        self.services = services

    def _hear_health(self, health: Health, at: float) -> None:
        name = health.service
        self.services[name] = Seen(health, at)
        if name in self._p99:
            self._p99[name] = health.lateness.get("p99", np.nan)
            late = [self._p99[service] * 1e3 for service in T.SERVICES]
            self.tracks["lateness"].add(self.t, late)

    def _hear_estimate(self, e: Estimate) -> None:
        with np.errstate(divide="ignore", invalid="ignore"):
            odometry = e.odometry_innovation / e.odometry_deviation
            imu = e.imu_innovation / e.imu_deviation
        self.tracks["velocity"].add(e.t, e.velocity * (1e3, 1e3, 1e3))
        self.tracks["odometry"].add(e.t, np.where(np.isfinite(odometry), odometry, np.nan))
        self.tracks["imu"].add(e.t, np.where(np.isfinite(imu), imu, np.nan))
        self.tracks["nis"].add(e.t, (e.odometry_nis, e.imu_nis))
        self.tracks["bias"].add(e.t, (e.gyro_bias * 1e3, *(e.accel_bias * 1e3)))
        self._unmatched.append(e)
        if self.latest(T.TRUTH) is not None:
            self._match()
        elif e.valid:
            self._pass(e.pose)

    def _match(self) -> None:
        """Compare estimates with the truth of their instant; topics are not heard in step."""
        while self._unmatched and self._truths and self._truths[-1].t >= self._unmatched[0].t:
            e = self._unmatched.popleft()
            truth = min(self._truths, key=lambda truth: abs(truth.t - e.t))
            if abs(truth.t - e.t) > NEAR or not e.valid:
                continue
            true = truth_at(truth, e.t)
            self.error, self.offset = e.pose - true, between(true, e.pose)
            sigma = 3e3 * np.sqrt(np.maximum(np.diag(e.covariance)[:3], 0.0))
            place, turn = sigma[:2].max(), sigma[2]
            self.tracks["error"].add(e.t, (*self.error * 1e3, place, -place, turn, -turn))
            self._pass(true)

    def _pass(self, pose: Array) -> None:
        if not self.trail or np.hypot(*(pose[:2] - self.trail[-1])) > TRAIL_STEP:
            self.trail.append(pose[:2].copy())

    def _hear_arm(self, status: ArmStatus, before: Message | None) -> None:
        truth = self.latest(T.TRUTH)
        if truth is None:
            drawing = status.stroke > 0 and status.force > 0.5
            self.ink.touch(status.reference, drawing)
        if self._forces() is None:
            true = np.nan if truth is None else truth.force
            self.tracks["force"].add(status.t, (status.force, status.force_reference, true))
        if not isinstance(before, ArmStatus) or (before.state, before.node, before.transitions) != (
            status.state,
            status.node,
            status.transitions,
        ):
            why = f" after {status.event}" if status.event else ""
            node = f", node {status.node}{why}" if status.node else ""
            reason = f": {status.reason}" if status.reason else ""
            self.events.append((status.t, f"arm {status.state}{node}{reason}"))

    def _hear_base(self, status: BaseStatus, before: Message | None) -> None:
        if not isinstance(before, BaseStatus) or (before.state, before.reason) != (
            status.state,
            status.reason,
        ):
            reason = f": {status.reason}" if status.reason else ""
            self.events.append((status.t, f"platform {status.state}{reason}"))

    def _hear_state(self, state: ArmState) -> None:
        forces = self._forces()
        if forces is not None:
            self.tracks["force"].add(state.t, (*forces, np.nan))

    def _forces(self) -> Array | None:
        """What two palms feel, (left, right) [N]; None of a robot with one load cell."""
        state = self.latest(T.ARM_STATE)
        if state is None or len(state.wrench) < 12:
            return None
        return np.linalg.norm(state.wrench.reshape(-1, 6)[:2, :3], axis=1)


def truth_at(truth: Truth, t: float) -> Array:
    """True pose at an instant near that of the message, at constant acceleration."""
    dt = t - truth.t
    return truth.pose + dt * truth.velocity + 0.5 * dt * dt * truth.acceleration


def between(a: Array, b: Array) -> Array:
    """The planar transform that takes pose ``b`` to ``a``: ``moved(between(a, b), b) == a``."""
    turn = a[2] - b[2]
    c, s = np.cos(turn), np.sin(turn)
    x, y = b[0], b[1]
    return np.array([a[0] - (c * x - s * y), a[1] - (s * x + c * y), turn])


def moved(by: Array, pose: Array) -> Array:
    """A planar pose (x, y, heading) in the frame that ``by`` is given in."""
    c, s = np.cos(by[2]), np.sin(by[2])
    x, y, turn = pose
    return np.array([by[0] + c * x - s * y, by[1] + s * x + c * y, by[2] + turn])


def inverse(by: Array) -> Array:
    """The planar transform back."""
    c, s = np.cos(by[2]), np.sin(by[2])
    return np.array([-c * by[0] - s * by[1], s * by[0] - c * by[1], -by[2]])
