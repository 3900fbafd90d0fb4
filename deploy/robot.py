"""Loads a robot's description: what it is, in one place for simulation, control and pictures."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, TypeVar, overload

from pydantic import Field

from deploy.arms import Arm, Hand, HandArm, Palms, Pen, TwoArms
from deploy.numbers import NonNegative, Positive, Vector3
from deploy.sensors import Bumper, Imu, Laser, LoadCell, Odometry, Vision
from deploy.tomlfile import BadFile, Strict, load_toml, toml_entry

ROBOTS = Path(__file__).parent / "robots"


class Platform(Strict):
    """The mobile base; its mass and size are in the URDF."""

    speed_limit: Vector3
    acceleration_limit: Vector3
    lag: Positive
    command_delay: NonNegative
    disturbance: tuple[Positive, Positive, Positive]
    """Acceleration that the command does not explain, standard deviation
    [m/s^2, m/s^2, rad/s^2] ..."""
    disturbance_time: Positive = 0.3
    """... and its correlation time [s]."""


class Chassis(Strict):
    """What of the platform only its own control asks for."""

    drive: Literal["holonomic", "differential"] = "holonomic"
    """A differential drive cannot move sideways, but turns on the spot."""
    radius: Positive = 0.31
    """Of the circle around the middle of B that holds all of the platform [m]."""
    jerk_limit: tuple[Positive, Positive, Positive] = (8.0, 8.0, 16.0)
    """Of what the drive is commanded [m/s^3, m/s^3, rad/s^3]."""


class MobileBase(Strict):
    """A platform and the sensors that tell its motion: all that the observer asks of a robot."""

    description: str = ""
    """In a line, for ``steadyhand list``."""
    platform: Platform
    odometry: Odometry
    imu: Imu


class Equipped(MobileBase):
    """A mobile base with what its own control and its look around need."""

    chassis: Chassis = Chassis()
    laser: Laser | None = None
    """None: the robot has none, and so with the others."""
    bumper: Bumper | None = None
    vision: Vision | None = None

    @property
    def reach(self) -> float:
        """From shoulder to wrist or palm at most [m]."""
        raise NotImplementedError


class Robot(Equipped):
    """A robot of one arm, which holds a pen."""

    kind: Literal["one_arm"] = "one_arm"
    arm: Arm
    pen: Pen
    load_cell: LoadCell

    @property
    def reach(self) -> float:
        """From shoulder to wrist at most [m]."""
        return self.arm.reach


class TwoArmRobot(Equipped):
    """A robot of two arms with flat palms (docs/two_arm_robot.md)."""

    kind: Literal["two_arm"]
    period: Annotated[float, Field(ge=0.001, le=0.01, multiple_of=0.001)]
    """Of the arms' state and of their control [s]."""
    arms: TwoArms
    palms: Palms
    load_cell: LoadCell

    @property
    def reach(self) -> float:
        """From shoulder to the middle of the palm, stretched [m]."""
        return self.arms.reach


class HandRobot(Equipped):
    """A robot of one arm with a three-finger hand (docs/grasping.md)."""

    kind: Literal["hand"]
    period: Annotated[float, Field(ge=0.001, le=0.01, multiple_of=0.001)]
    """Of the states of arm and hand, and of their control [s]."""
    arm: HandArm
    hand: Hand
    load_cell: LoadCell

    @property
    def reach(self) -> float:
        """From shoulder to wrist at most [m]."""
        return self.arm.reach


KINDS: dict[str, type[Equipped]] = {
    "one_arm": Robot,
    "two_arm": TwoArmRobot,
    "hand": HandRobot,
}
"""Every kind of robot by the ``kind`` its description states; ``one_arm`` if it states none."""

R = TypeVar("R", bound=MobileBase)


@overload
def load_robot(name: str) -> Robot: ...
@overload
def load_robot(name: str, kind: type[R]) -> R: ...
def load_robot(name: str, kind: type[MobileBase] = Robot) -> MobileBase:
    """Load ``deploy/robots/<name>/robot.toml``.

    Args:
        name: of the robot.
        kind: class that the caller can work with; ``MobileBase`` or ``Equipped`` for any robot.

    Raises:
        BadFile: no such robot (the known ones are named), a wrong entry, or another kind.
    """
    path = _path(name)
    stated = robot_kind(name)
    model = KINDS[stated]
    if not issubclass(model, kind):
        wanted = ", ".join(repr(k) for k, m in KINDS.items() if issubclass(m, kind))
        raise BadFile(path, [f"kind: {name!r} is of kind {stated!r}; this needs {wanted}"])
    return load_toml(path, model)


def robot_kind(name: str) -> str:
    """Which of ``KINDS`` a robot is.

    Raises:
        BadFile: no such robot, or no such kind; the known ones are named.
    """
    path = _path(name)
    kind = toml_entry(path, "kind", "one_arm")
    if kind not in KINDS:
        raise BadFile(path, [f"kind: no kind {kind!r}. Known: {', '.join(KINDS)}"])
    return str(kind)


def urdf_text(name: str) -> str:
    """The URDF of a robot as text (named in its description, beside it)."""
    robot = load_robot(name, Equipped)
    assert isinstance(robot, Robot | TwoArmRobot | HandRobot)
    file = robot.arms.urdf if isinstance(robot, TwoArmRobot) else robot.arm.urdf
    return (ROBOTS / name / file).read_text(encoding="utf-8")


def robot_names() -> list[str]:
    """Names of the robots that are described."""
    return sorted(path.parent.name for path in ROBOTS.glob("*/robot.toml"))


def robot_file(name: str) -> Path:
    """Where a robot of that name is described, if it is."""
    return ROBOTS / name / "robot.toml"


def _path(name: str) -> Path:
    path = robot_file(name)
    if not path.is_file():
        raise BadFile(path, [f"no robot {name!r}. Known: {', '.join(robot_names())}"])
    return path
