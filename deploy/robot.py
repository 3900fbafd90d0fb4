"""Loads a robot's description: what it is, in one place for simulation, control and pictures."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, TypeVar, overload

from pydantic import Field, model_validator

from deploy.tomlfile import BadFile, Strict, load_toml, toml_entry

ROBOTS = Path(__file__).parent / "robots"

Positive = Annotated[float, Field(gt=0)]
NonNegative = Annotated[float, Field(ge=0)]
Vector3 = tuple[float, float, float]
Vector7 = tuple[float, float, float, float, float, float, float]
Names7 = tuple[str, str, str, str, str, str, str]


class Arm(Strict):
    """The arm, joint by joint, in the order of ``joints``: six, or seven with one to spare.

    Its links are ``link1``, ``link2`` (with its origin in the shoulder) ... to the last one (with
    its origin in the wrist).
    """

    urdf: str
    joints: Annotated[tuple[str, ...], Field(min_length=6, max_length=7)]
    torque_limit: tuple[Positive, ...]
    velocity_limit: tuple[Positive, ...]
    rotor_inertia: tuple[NonNegative, ...]
    coulomb_friction: tuple[NonNegative, ...]
    viscous_friction: tuple[NonNegative, ...]
    encoder_resolution: Positive
    rest: tuple[float, ...]
    """Posture at the start; with a joint to spare, the one it is drawn to at work [rad]."""
    reach: Positive
    force_limit: Positive

    @model_validator(mode="after")
    def _complete(self) -> Arm:
        for name in (
            "torque_limit",
            "velocity_limit",
            "rotor_inertia",
            "coulomb_friction",
            "viscous_friction",
            "rest",
        ):
            given = len(getattr(self, name))
            if given != len(self.joints):
                raise ValueError(f"{name} has {given} values for {len(self.joints)} joints")
        return self

    @property
    def links(self) -> tuple[str, ...]:
        """Names of the bodies that the joints move, from the shoulder on."""
        return tuple(f"link{i}" for i in range(1, len(self.joints) + 1))


class TwoArms(Strict):
    """Two arms of seven joints, mirror images: figures hold for both, from shoulder to wrist.

    Wherever joints of both are listed, the left arm's seven come first, then the right arm's.
    """

    urdf: str
    joints_left: Names7
    joints_right: Names7
    torque_limit: Vector7
    velocity_limit: Vector7
    rotor_inertia: Vector7
    coulomb_friction: Vector7
    viscous_friction: Vector7
    encoder_resolution: Positive
    rest_left: Vector7
    rest_right: Vector7
    reach: Positive
    """Shoulder to middle of the palm, stretched [m]."""

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of all 14 joints, left then right."""
        return self.joints_left + self.joints_right

    @property
    def rest(self) -> tuple[float, ...]:
        """Posture at the start, (14,) [rad]."""
        return self.rest_left + self.rest_right


class Pad(Strict):
    """A soft pad on a palm: its face gives way along the palm's normal and stays parallel to it."""

    stiffness: Positive
    """[N/m]"""
    damping: Positive
    """[N s/m]"""
    plateau: Positive
    """At this force its cells buckle: until its stroke is used up it resists no harder [N]."""
    stroke: Positive
    """By which the face can give way before the pad is as hard as what it is glued to [m]."""
    mass: Positive
    """Of what moves with the face, of the palm's in the URDF [kg]."""


class Palms(Strict):
    """Flat palms, one at the end of each arm, each on a load cell; masses are in the URDF.

    Frame P: origin in the middle of the palm, x across the hand, y along the normal (of a left
    palm -y looks at the right one), z from fingertips to heel.
    """

    links: tuple[str, str]
    """Bodies in the URDF, left then right."""
    size: tuple[Positive, Positive, Positive]
    """Along x, y, z of P [m]."""
    force_limit: Positive
    """That a hand survives [N]."""
    pad: Pad
    """What the palms are covered with."""


class HandArm(Strict):
    """The arm that carries a hand, joint by joint from shoulder to wrist."""

    urdf: str
    joints: Names7
    torque_limit: Vector7
    velocity_limit: Vector7
    coulomb_friction: Vector7
    """What its joints have where a trial asks for friction [N m]."""
    rest: Vector7
    reach: Positive
    """Shoulder to wrist, stretched [m]."""


class Hand(Strict):
    """A hand of three fingers with coupled joints and a load cell in every tip.

    Frame H: origin in the middle of the palm, z out of it, finger 0 towards -x.
    """

    palm: str
    drives: tuple[str, str, str, str]
    """Driven joints: the spread of fingers 1 and 2, then the flexion of fingers 0, 1, 2."""
    followers: tuple[tuple[str, str, float], ...]
    """Joints that go along: their name, their leader's, positions over the leader's."""
    tips: tuple[str, str, str]
    tip_radius: Positive
    torque_limit: tuple[Positive, Positive, Positive, Positive]
    coulomb_friction: tuple[NonNegative, NonNegative, NonNegative, NonNegative]
    """What its drives have where a trial asks for friction [N m]."""
    open: float
    """Flexion before closing [rad]."""
    force_limit: Positive
    """That a fingertip survives [N]."""


class Pen(Strict):
    """A pen on a spring-loaded prismatic joint; masses and lengths are in the URDF."""

    stiffness: Positive
    damping: NonNegative
    tip_radius: Positive


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


class Odometry(Strict):
    """Wheel odometry; resolution of x, y [m] and heading [rad]."""

    rate: Positive
    delay: NonNegative
    resolution: Vector3
    noise: tuple[Positive, Positive, Positive] = (1e-4, 1e-4, 5e-5)
    """Standard deviation before rounding [m, m, rad]."""
    speed_noise: tuple[Positive, Positive, Positive] = (0.02, 0.02, 0.02)
    """Standard deviation of wheel speeds, where those are used [m/s, m/s, rad/s]."""
    scale: tuple[Positive, Positive] = (1.0, 1.0)
    """What it reads over what is true, of distance and of heading turned."""


class Imu(Strict):
    """Gyro and accelerometer; noise and bias as standard deviations."""

    rate: Positive
    delay: NonNegative
    gyro_noise: NonNegative
    gyro_bias: NonNegative
    accel_noise: NonNegative
    accel_bias: NonNegative
    position: Vector3
    rotation: Vector3 = (0.0, 0.0, 0.0)
    """R_BI as roll, pitch, yaw: turns what it reads into B [rad]."""


class Laser(Strict):
    """A planar laser scanner; its axes are those of B."""

    rate: Positive
    delay: NonNegative
    position: tuple[float, float]
    """p_BL along x and y of B [m]."""
    field_of_view: Positive
    """Symmetric about x of B [rad]; a full turn has no beam twice."""
    increment: Positive
    """Between beams [rad]."""
    farthest: Positive
    """[m]"""
    noise: NonNegative
    """Of a range, standard deviation [m]."""


class Bumper(Strict):
    """A ring of switches around the platform."""

    rate: Positive
    parts: Annotated[int, Field(ge=1, le=360)]
    """Equal ones, the first with its middle straight ahead."""


class Vision(Strict):
    """A camera that finds named objects; deviations are ``noise + noise_per_metre * distance``."""

    rate: Positive
    delay: NonNegative
    position: Vector3
    """p_BC of the camera [m]."""
    farthest: Positive
    """[m]"""
    field_of_view: Positive
    """Full angle about x of B [rad]."""
    noise: tuple[NonNegative, NonNegative]
    """Standard deviation of position [m] and rotation [rad] at distance zero."""
    noise_per_metre: tuple[NonNegative, NonNegative]
    """What each metre of distance adds [m/m], [rad/m]."""
    noise_per_metre_squared: tuple[NonNegative, NonNegative] = (0.0, 0.0)
    """What the distance squared adds [m/m^2], [rad/m^2]."""
    correlation: NonNegative = 0.0
    """Time over which the error stays alike [s]; 0: every picture errs anew."""


class LoadCell(Strict):
    """Six-axis wrist sensor; noise per 1 kHz sample."""

    force_noise: NonNegative
    moment_noise: NonNegative


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
