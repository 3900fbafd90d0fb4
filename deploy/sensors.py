"""What a description says of sensors."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from deploy.numbers import NonNegative, Positive, Vector3
from deploy.tomlfile import Strict


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
