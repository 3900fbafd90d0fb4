"""The vocabulary: one dataclass per message, read-only to type checkers.

Every field states its shape, unit and physical range, so that one generic check can refuse what
no robot could have meant. SI units throughout; frames in monogram notation (docs/notation.md).
This module imports numpy only: every room may speak it.
"""

from __future__ import annotations

import math
from dataclasses import Field, dataclass, field, fields
from functools import lru_cache
from typing import Any, TypeVar, dataclass_transform

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
M = TypeVar("M")
AT_WORK = ("running", "degraded", "resuming")
"""States of the arm in which its program goes on."""
PROGRAM_ENDED = ("finished", "protective_stop")
"""States of the arm in which its program is over."""
BASE_ENDED = ("finished", "arrived", "docked", "aborted")
"""States of the platform in which what it was to do is over."""

__all__ = [
    "AT_WORK",
    "BASE_ENDED",
    "PROGRAM_ENDED",
    "ArmCommand",
    "ArmState",
    "ArmStatus",
    "Array",
    "BadMessage",
    "BaseCommand",
    "BaseStatus",
    "BoardEstimate",
    "Bumper",
    "Clock",
    "Estimate",
    "HandCommand",
    "HandState",
    "Health",
    "Imu",
    "Message",
    "ObjectEstimate",
    "Odometry",
    "Request",
    "Scan",
    "Tick",
    "Truth",
    "Vision",
    "check",
]


class BadMessage(ValueError):
    """A message that must not be used; ``reason`` is the short name it is counted under."""

    def __init__(self, reason: str, detail: str) -> None:
        super().__init__(f"{reason}: {detail}")
        self.reason = reason


@dataclass(frozen=True)
class Spec:
    """What a field may hold: array shape (None for a scalar), unit and inclusive range.

    A dimension of None is of any length, nothing included.
    """

    shape: tuple[int | None, ...] | None
    unit: str
    lo: float
    hi: float


def array(*shape: int | None, unit: str, lo: float = -1e9, hi: float = 1e9) -> Any:
    """Declare an array field of the given shape, unit and range."""
    return field(metadata={"spec": Spec(shape, unit, lo, hi)})


def number(unit: str, lo: float = -1e9, hi: float = 1e9, **default: Any) -> Any:
    """Declare a float field of the given unit and range."""
    return field(metadata={"spec": Spec(None, unit, lo, hi)}, **default)


@dataclass_transform(frozen_default=True, field_specifiers=(field, array, number))
def _message(cls: type[M]) -> type[M]:
    """Make a message of a class: frozen for whoever checks types, without paying for it.

    The constructor of a frozen dataclass takes 2.5 times as long, some thousand times a second.
    """
    return dataclass(slots=True)(cls)


@_message
class Message:
    """Base of all messages. ``t`` [s] is the instant the content was true, in robot time."""

    t: float = number("s", 0.0)


@_message
class ArmState(Message):
    """Joints and load cells of the arm; of two arms, first the left one's, then the right one's."""

    q: Array = array(None, unit="rad", lo=-10, hi=10)
    qd: Array = array(None, unit="rad/s", lo=-100, hi=100)
    tau: Array = array(None, unit="N m", lo=-1000, hi=1000)
    wrench: Array = array(None, unit="N, N m", lo=-1e4, hi=1e4)
    """Force [N] then moment [N m] of the world on the tool, in the load cell's frame; six values
    a cell."""

    def of(self, joints: int, cells: int) -> bool:
        """Whether it is of a robot with so many joints and load cells."""
        return (
            self.q.shape == self.qd.shape == self.tau.shape == (joints,)
            and len(self.wrench) == 6 * cells
        )


@_message
class HandState(Message):
    """Drives, fingertip load cells and switches of a hand; ``t`` is that of the arm's state."""

    q: Array = array(None, unit="rad", lo=-10, hi=10)
    """Of the driven joints: the spread, then the flexions."""
    qd: Array = array(None, unit="rad/s", lo=-100, hi=100)
    tau: Array = array(None, unit="N m", lo=-1000, hi=1000)
    cells: Array = array(None, 6, unit="N, N m", lo=-1e4, hi=1e4)
    """Force [N] then moment [N m] of the world on each fingertip about its middle, in its frame."""
    struck: bool = False
    """A switch in palm or links says that one of them touches something."""

    def of(self, joints: int, fingers: int) -> bool:
        """Whether it is of a hand with so many drives and fingers."""
        drives = self.q.shape == self.qd.shape == self.tau.shape == (joints,)
        return drives and self.cells.shape == (fingers, 6)


@_message
class Clock(Message):
    """The robot's time, as it is sent."""


@_message
class Odometry(Message):
    """Pose X_OB of the platform from its wheels: x, y [m], heading [rad]."""

    pose: Array = array(3, unit="m, m, rad", lo=-1e5, hi=1e5)


@_message
class WheelSpeed(Message):
    """Velocity V_OB_B of the platform from its wheels, stamped in the middle of its averaging."""

    velocity: Array = array(3, unit="m/s, m/s, rad/s", lo=-50, hi=50)


@_message
class Imu(Message):
    """Gyro [rad/s] and accelerometer (specific force) [m/s^2], both in the sensor's frame."""

    gyro: Array = array(3, unit="rad/s", lo=-50, hi=50)
    accel: Array = array(3, unit="m/s^2", lo=-500, hi=500)


@_message
class ArmCommand(Message):
    """Joint torques [N m], computed from the arm state of instant ``t``."""

    tau: Array = array(None, unit="N m", lo=-1000, hi=1000)
    """In the order of ``ArmState.q``."""

    def of(self, joints: int) -> bool:
        """Whether it is for a robot with so many joints."""
        return self.tau.shape == (joints,)


@_message
class HandCommand(Message):
    """Torques of a hand's drives [N m], computed from the hand's state of instant ``t``."""

    tau: Array = array(None, unit="N m", lo=-1000, hi=1000)
    """In the order of ``HandState.q``."""

    def of(self, joints: int) -> bool:
        """Whether it is for a hand with so many drives."""
        return self.tau.shape == (joints,)


@_message
class BaseCommand(Message):
    """Platform velocity V_OB_B after arbitration: vx, vy [m/s], yaw rate [rad/s]."""

    velocity: Array = array(3, unit="m/s, m/s, rad/s", lo=-10, hi=10)
    planned: Array = field(
        default_factory=lambda: np.zeros((0, 3)),
        metadata={"spec": Spec((None, 3), "m/s, m/s, rad/s", -10, 10)},
    )
    """V_OB_B that the base means to command at its next steps, first to last; may be empty."""


@_message
class Scan(Message):
    """Ranges of the planar laser, sampled together at ``t``, counter-clockwise."""

    start: float = number("rad", -7, 7)
    """Bearing of the first beam in the laser's frame, of which the axes are those of B."""
    increment: float = number("rad", 0, 7)
    ranges: Array = array(None, unit="m", lo=0, hi=1000)
    """From the laser's origin (robot.toml, ``[laser]``); ``farthest`` where nothing is seen."""
    farthest: float = number("m", 0, 1000)


@_message
class Bumper(Message):
    """Which parts of the ring of bumpers are pressed."""

    pressed: Array = array(None, unit="rad", lo=-7, hi=7)
    """Bearings in B of the middles of the pressed parts; empty if none is."""


@_message
class Vision(Message):
    """Pose of a named object in B, as a camera saw it at ``t``."""

    p: Array = array(3, unit="m", lo=-100, hi=100)
    """p_BX."""
    R: Array = array(3, 3, unit="1", lo=-1.001, hi=1.001)
    """R_BX."""
    covariance: Array = array(6, 6, unit="m^2, rad^2")
    """Of position and of a small rotation, both along axes of B."""
    name: str = ""
    """Of the object X."""


@_message
class Estimate(Message):
    """What the observer believes of the platform at instant ``t``."""

    pose: Array = array(3, unit="m, m, rad")
    """X_OB: x, y [m], heading [rad] (continuous, not wrapped)."""
    velocity: Array = array(3, unit="m/s, m/s, rad/s", lo=-100, hi=100)
    """V_OB_O: the derivative of ``pose``."""
    acceleration: Array = array(3, unit="m/s^2, m/s^2, rad/s^2", lo=-1000, hi=1000)
    """A_OB_O: the derivative of ``velocity`` without the output stage's corrections."""
    covariance: Array = array(6, 6, unit="SI")
    """Of (pose, velocity), in O."""
    gyro_bias: float = number("rad/s")
    accel_bias: Array = array(2, unit="m/s^2")
    odometry_innovation: Array = array(3, unit="m, m, rad")
    odometry_nis: float = number("1", 0.0)
    imu_innovation: Array = array(3, unit="rad/s, m/s^2, m/s^2")
    imu_nis: float = number("1", 0.0)
    odometry_age: float = number("s", 0.0)
    imu_age: float = number("s", 0.0)
    command_age: float = number("s", 0.0)
    rejected: dict[str, int] = field(default_factory=dict)
    """Refused measurements by reason since start (gate, too_old, stale, ...)."""
    mode: str = ""
    """What the platform is taken to be doing: ``driving``, ``standing`` or ``disturbed``."""
    valid: bool = True
    reason: str = ""
    """Why the estimate must not be used, or what was detected (for example ``slip``)."""
    odometry_deviation: Array = field(
        default_factory=lambda: np.zeros(3), metadata={"spec": Spec((3,), "m, m, rad", 0.0, 1e9)}
    )
    """Of the odometry innovation, as believed; zero if there is none."""
    imu_deviation: Array = field(
        default_factory=lambda: np.zeros(3),
        metadata={"spec": Spec((3,), "rad/s, m/s^2, m/s^2", 0.0, 1e9)},
    )
    """Of the IMU innovation, as believed; zero if there is none."""


@_message
class BoardEstimate(Message):
    """Where the observer believes the board to be in odometry's frame at instant ``t``."""

    pose: Array = array(3, unit="m, m, rad", lo=-1e5, hi=1e5)
    """X_OS in the plane: x, y of its origin [m], yaw as of ``task.board`` [rad]; without steps."""
    velocity: Array = array(3, unit="m/s, m/s, rad/s", lo=-10, hi=10)
    """The derivative of ``pose``: O drifts as the platform drives."""
    covariance: Array = array(3, 3, unit="m^2, rad^2")
    """Of what is believed, which ``pose`` follows."""
    wheel_scale: float = number("1", 0.1, 10.0, default=1.0)
    """Way that odometry reads over the way that was driven."""
    age: float = number("s", 0.0, default=0.0)
    """Of the newest sighting that was used."""
    taken: int = 0
    """Sightings used since the start, ..."""
    refused: int = 0
    """... and refused."""


@_message
class ObjectEstimate(Message):
    """Where the observer believes a named object to be in odometry's frame at instant ``t``."""

    p: Array = array(3, unit="m", lo=-1e5, hi=1e5)
    """p_OX."""
    R: Array = array(3, 3, unit="1", lo=-1.001, hi=1.001)
    """R_OX."""
    covariance: Array = array(6, 6, unit="m^2, rad^2")
    """Of position and of a small rotation along axes of O, relative to the platform."""
    name: str = ""
    """Of the object X."""
    held: bool = False
    """It is between two palms and goes where they go."""
    age: float = number("s", 0.0, default=0.0)
    """Of the newest sighting that was used."""
    taken: int = 0
    """Sightings used since the start, ..."""
    refused: int = 0
    """... and refused."""


@_message
class ArmStatus(Message):
    """What the arm is doing, and how far it is from its limits."""

    state: str = "idle"
    """idle, running, paused, safe_hold, resuming, protective_stop or finished."""
    program: str = ""
    node: str = ""
    event: str = ""
    """The newest event that changed the node."""
    transitions: int = 0
    reason: str = ""
    stroke: int = 0
    """Number of the stroke being drawn, counted from 1; 0 when the pen is not meant to draw."""
    reference: Array = field(
        default_factory=lambda: np.zeros(3), metadata={"spec": Spec((3,), "m", -100, 100)}
    )
    """Pen tip intended at ``t``: p_ST_S [m]."""
    reference_velocity: Array = field(
        default_factory=lambda: np.zeros(3), metadata={"spec": Spec((3,), "m/s", -100, 100)}
    )
    force: float = number("N", default=0.0)
    """Filtered pressing force [N]."""
    force_reference: float = number("N", default=0.0)
    residuals: Array = field(
        default_factory=lambda: np.zeros(0), metadata={"spec": Spec((None,), "1", 0, 1e3)}
    )
    """Of force and moment, |rho| and |M|, while fingertips slide to a grasp; else nothing."""
    reach_margin: float = number("m", default=0.0)
    """Distance left before the arm is stretched out [m]."""
    joint_margin: float = number("rad", default=0.0)
    """Smallest distance of a joint to its limit [rad]."""
    goal_number: int = 0
    """Counts the program's goals for the platform; 0 while it asks for none."""
    goal: Array = field(
        default_factory=lambda: np.zeros(3), metadata={"spec": Spec((3,), "m, m, rad", -1e5, 1e5)}
    )
    """Where the program asks the platform to be: X_OB."""
    stand: bool = False
    """The platform is asked to stand where it is, without correcting its place."""
    anchored: bool = False
    """The tool is at work on something that stands on the ground, at ``tool``."""
    tool: Array = field(
        default_factory=lambda: np.zeros(3), metadata={"spec": Spec((3,), "m", -1e5, 1e5)}
    )
    """Where it is meant to be at ``t``: p_OT [m]."""
    tool_velocity: Array = field(
        default_factory=lambda: np.zeros(3), metadata={"spec": Spec((3,), "m/s", -100, 100)}
    )
    """And where it goes from there, the derivative of ``tool`` [m/s]."""
    facing: float = number("rad", -10, 10, default=0.0)
    """Heading with which the platform looks square onto what the tool works on."""
    speed_margin: float = number("1", 0.0, 1.0, default=1.0)
    """Share of its speed limit that the joint nearest to its own has left."""
    reaction: Array = field(
        default_factory=lambda: np.zeros(3), metadata={"spec": Spec((3,), "N, N m", -1e4, 1e4)}
    )
    """Force and moment F_B of the moving arm on the platform in O, mean since the last status."""
    recoil: Array = field(
        default_factory=lambda: np.zeros(3),
        metadata={"spec": Spec((3,), "m/s^2, rad/s^2", -1000, 1000)},
    )
    """A_OB_O that the reaction gives a platform that rolls freely."""


@_message
class BaseStatus(Message):
    """What each behaviour wanted and what was chosen."""

    state: str = "idle"
    reason: str = ""
    votes: dict[str, list[float]] = field(default_factory=dict)
    """Behaviour name to [vx, vy, yaw rate, weight]."""
    chosen: Array = field(
        default_factory=lambda: np.zeros(3), metadata={"spec": Spec((3,), "m/s, rad/s", -10, 10)}
    )


@_message
class Truth(Message):
    """Ground truth. For recorder, console and tests; never for a controller."""

    pose: Array = array(3, unit="m, m, rad")
    velocity: Array = array(3, unit="m/s, m/s, rad/s")
    acceleration: Array = array(3, unit="m/s^2, m/s^2, rad/s^2")
    q: Array = array(None, unit="rad")
    qd: Array = array(None, unit="rad/s")
    tip: Array = array(3, unit="m")
    """Pen tip p_ST_S in the board's frame [m]; z is the distance in front of the board."""
    force: float = number("N", -1e5, 1e5)
    """Force of the pen on the board along its normal [N]."""
    contact: bool = False
    recent: Array = field(
        default_factory=lambda: np.zeros((5, 4)), metadata={"spec": Spec((5, 4), "m, N", -1e5, 1e5)}
    )
    """Tip [m] and force [N] at the last five ticks of 1 ms, oldest first."""
    disturbances: list[str] = field(default_factory=list)
    """Names of the disturbances acting at ``t``."""
    clearance: float = number("m", -1e3, 1e3, default=1e3)
    """From the platform's edge to the nearest obstacle; negative where they overlap."""
    bodies: dict[str, list[float]] = field(default_factory=dict)
    """X_WX of bodies worth knowing, by name: x, y, z [m], then w, x, y, z of the rotation as a
    unit quaternion."""
    forces: dict[str, list[float]] = field(default_factory=dict)
    """Contact force on bodies by name, in W: x, y, z [N]."""


@_message
class Health(Message):
    """Heartbeat, stamped inside the control loop."""

    service: str = ""
    state: str = ""
    detail: str = ""
    progress: int = 0
    """Ticks done since start: this, not a process that exists, is what counts as alive."""
    pid: int = 0
    restarts: int = 0
    """How often the service was restarted before this process."""
    period: dict[str, float] = field(default_factory=dict)
    """Of the ticks since the last heartbeat [s]: target, mean, std, max."""
    lateness: dict[str, float] = field(default_factory=dict)
    """Start of a tick behind its deadline [s]: p50, p99, max; share over_1ms later than that."""
    overruns: int = 0
    """Ticks skipped since start because the one before took too long."""
    ages: dict[str, float] = field(default_factory=dict)
    """Age of each input [s]."""
    answers: dict[str, float] = field(default_factory=dict)
    """Of the robot alone: from an arm state sent to the command for it heard [s]: p50, p99, max."""
    refused: dict[str, int] = field(default_factory=dict)
    """Refused messages since start, by ``topic: reason``."""


@_message
class Request(Message):
    """What a person, a script or the supervisor asked of a service, as its loop took it up."""

    verb: str = ""
    args: str = ""
    """JSON."""
    accepted: bool = True
    reason: str = ""


@_message
class Tick(Message):
    """Paced mode: the sim's call for tick ``number``, and a service's answer to it."""

    number: int = 0
    sent: dict[str, int] = field(default_factory=dict)
    """Newest sequence number of each topic that may be used in (or was sent by) this tick."""


@lru_cache(maxsize=64)
def _plan(kind: type[Message]) -> list[tuple[Field[Any], Spec | None, str]]:
    return [(f, f.metadata.get("spec"), str(f.type)) for f in fields(kind)]


_PLAIN: dict[str, type | tuple[type, ...]] = {
    "str": str,
    "bool": bool,
    "int": int,
    "float": (float, int),
}
_CONTAINERS: dict[str, type] = {"dict": dict, "list": list}


def check(kind: type[Message], content: dict[str, Any]) -> Message:
    """Build a message from plain data, or refuse it.

    Args:
        kind: message class.
        content: field name to value; arrays as nested lists or arrays.

    Returns:
        The message, arrays as float64 of the declared shape.

    Raises:
        BadMessage: with reason ``fields``, ``type``, ``shape``, ``non-finite`` or ``range``.
    """
    values: dict[str, Any] = {}
    plan = _plan(kind)  # type: ignore[arg-type]
    for f, spec, type_name in plan:
        try:
            value = content[f.name]
        except KeyError:
            raise BadMessage("fields", f"{kind.__name__}.{f.name} is missing") from None
        if spec is None:
            allowed = _PLAIN.get(type_name) or _CONTAINERS.get(type_name.split("[")[0], object)
            if not isinstance(value, allowed) or (
                isinstance(value, bool) and type_name in ("int", "float")
            ):
                raise BadMessage("type", f"{kind.__name__}.{f.name} is not a {type_name}")
            if isinstance(value, (dict, list, float)):
                _check_inside(f"{kind.__name__}.{f.name}", type_name, value)
        elif spec.shape is None:
            if isinstance(value, bool) or not isinstance(value, (float, int)):
                raise BadMessage("type", f"{kind.__name__}.{f.name} is not a number")
            value = float(value)
            if not math.isfinite(value):
                raise BadMessage("non-finite", f"{kind.__name__}.{f.name}")
            if not spec.lo <= value <= spec.hi:
                raise BadMessage("range", f"{kind.__name__}.{f.name} = {value} {spec.unit}")
        else:
            value = _array(kind, f.name, spec, value)
        values[f.name] = value
    if len(content) != len(plan):
        unknown = sorted(set(content) - {f.name for f, _, _ in plan})
        raise BadMessage("fields", f"{kind.__name__} has no {', '.join(unknown)}")
    return kind(**values)


def _check_inside(name: str, type_name: str, value: Any) -> None:
    """Refuse a container whose elements are not what its annotation says, or not finite."""
    inner: list[Any] = []
    if isinstance(value, dict):
        if not all(isinstance(k, str) for k in value):
            raise BadMessage("type", f"{name} has a key that is not a name")
        inner = list(value.values())
        element = type_name[:-1].split(", ", 1)[-1]  # dict[str, X] -> X
    elif isinstance(value, list):
        inner, element = value, type_name[5:-1]  # list[X] -> X
    elif not math.isfinite(value):
        raise BadMessage("non-finite", name)
    for v in inner:
        allowed = _PLAIN.get(element) or _CONTAINERS.get(element.split("[")[0], object)
        if not isinstance(v, allowed) or (isinstance(v, bool) and element in ("int", "float")):
            raise BadMessage("type", f"{name} holds something that is not a {element}")
        if isinstance(v, (dict, list, float)):
            _check_inside(name, element, v)


def _array(kind: type[Message], name: str, spec: Spec, value: Any) -> Array:
    try:
        out = np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise BadMessage("type", f"{kind.__name__}.{name} is not numeric") from None
    if spec.shape is None or not _fits(out.shape, spec.shape):
        raise BadMessage("shape", f"{kind.__name__}.{name} is {out.shape}, not {spec.shape}")
    if out.size == 0:
        return out.reshape([n or 0 for n in spec.shape])
    lo, hi = float(out.min()), float(out.max())  # NaN if anything is
    if not (math.isfinite(lo) and math.isfinite(hi)):
        raise BadMessage("non-finite", f"{kind.__name__}.{name}")
    if lo < spec.lo or hi > spec.hi:
        raise BadMessage("range", f"{kind.__name__}.{name} leaves {spec.lo}..{spec.hi} {spec.unit}")
    return out


def _fits(shape: tuple[int, ...], asked: tuple[int | None, ...]) -> bool:
    if shape == (0,) and None in asked:  # an empty list does not tell its other dimensions
        return True
    return len(shape) == len(asked) and all(
        a in (None, n) for n, a in zip(shape, asked, strict=True)
    )
