"""Loads a robot's description: what it is, in one place for simulation, control and pictures."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from deploy.tomlfile import BadFile, Strict, load_toml

ROBOTS = Path(__file__).parent / "robots"

Positive = Annotated[float, Field(gt=0)]
NonNegative = Annotated[float, Field(ge=0)]
Vector3 = tuple[float, float, float]
Vector6 = tuple[float, float, float, float, float, float]


class Arm(Strict):
    """The arm, joint by joint, in the order of ``joints``."""

    urdf: str
    joints: tuple[str, str, str, str, str, str]
    torque_limit: Vector6
    velocity_limit: Vector6
    rotor_inertia: Vector6
    coulomb_friction: Vector6
    viscous_friction: Vector6
    encoder_resolution: Positive
    rest: Vector6
    reach: Positive
    force_limit: Positive


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


class LoadCell(Strict):
    """Six-axis wrist sensor; noise per 1 kHz sample."""

    force_noise: NonNegative
    moment_noise: NonNegative


class MobileBase(Strict):
    """A platform and the sensors that tell its motion: all that the observer asks of a robot."""

    platform: Platform
    odometry: Odometry
    imu: Imu


class Robot(MobileBase):
    """Everything a robot is."""

    arm: Arm
    pen: Pen
    load_cell: LoadCell
    chassis: Chassis = Chassis()
    laser: Laser | None = None
    """None: the robot has none, and so with the others."""
    bumper: Bumper | None = None
    vision: Vision | None = None


def load_robot(name: str) -> Robot:
    """Load ``deploy/robots/<name>/robot.toml``.

    Raises:
        BadFile: no such robot (the known ones are named), or a wrong entry.
    """
    path = ROBOTS / name / "robot.toml"
    if not path.is_file():
        known = ", ".join(sorted(p.parent.name for p in ROBOTS.glob("*/robot.toml")))
        raise BadFile(path, [f"no robot {name!r}. Known: {known}"])
    return load_toml(path, Robot)


def urdf_text(name: str) -> str:
    """The URDF of a robot as text (``robot.arm.urdf`` beside its description)."""
    return (ROBOTS / name / load_robot(name).arm.urdf).read_text(encoding="utf-8")
