"""What a stranger writes beside their CSV files: one TOML that says what the columns mean.

Documented key by key in docs/logs.md. "auto" (or leaving the key out) means: estimate it.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field, model_validator

from deploy.numbers import NonNegative, Positive, Vector3
from deploy.tomlfile import Strict

Column = Annotated[str, Field(min_length=1)]
"""Name of a column; with a minus before it the column's values are negated."""
Axis = Literal["+x", "-x", "+y", "-y", "+z", "-z"]
TimeUnit = Literal["s", "ms", "us", "ns"]
Positive2 = tuple[Positive, Positive]
Positive3 = tuple[Positive, Positive, Positive]
NonNegative3 = tuple[NonNegative, NonNegative, NonNegative]


def _auto(value: Any) -> Any:
    return None if value == "auto" else value


AUTO = BeforeValidator(_auto)


class Stamped(Strict):
    """A sensor in a CSV file; keys left out are taken from the top of the description."""

    file: Column | None = None
    time: Column | None = None
    """Stamps: when sampled."""
    receive: Column | None = None
    """When it arrived; without it, ``latency`` after the stamp."""
    time_unit: Annotated[TimeUnit | None, AUTO] = None
    latency: NonNegative = 0.0
    """From sampling to arrival [s], where there is no ``receive``."""


class PoseColumns(Stamped):
    """A pose in the plane: position and, one way or another, heading."""

    x: Column | None = None
    y: Column | None = None
    heading: Column | None = None
    quaternion: tuple[Column, Column] | tuple[Column, Column, Column, Column] | None = None
    """qz, qw or qx, qy, qz, qw."""
    length_unit: Literal["m", "cm", "mm"] = "m"
    angle_unit: Literal["rad", "deg"] = "rad"

    @model_validator(mode="after")
    def _one_heading(self) -> Self:
        if self.heading is not None and self.quaternion is not None:
            raise ValueError("give heading or quaternion, not both")
        return self


class OdometryColumns(PoseColumns):
    """Wheel odometry: X_OB."""

    x: Column
    y: Column
    delay: Annotated[float | None, AUTO] = None
    """The stamps are this much later than the instant the pose was true [s]."""
    resolution: Annotated[NonNegative3 | None, AUTO] = None
    noise: Annotated[Positive3 | None, AUTO] = None
    scale: Annotated[Positive2 | None, AUTO] = None

    @model_validator(mode="after")
    def _some_heading(self) -> Self:
        if self.heading is None and self.quaternion is None:
            raise ValueError("give heading (a column) or quaternion (two or four columns)")
        return self


class VelocityColumns(Stamped):
    """A body velocity V_OB_B."""

    vx: Column
    vy: Column | None = None
    """Left out: zero, for a platform that cannot move sideways."""
    w: Column
    length_unit: Literal["m", "cm", "mm"] = "m"
    angle_unit: Literal["rad", "deg"] = "rad"


class SpeedColumns(VelocityColumns):
    """Body velocity V_OB_B from the wheels."""

    delay: Annotated[float | None, AUTO] = None
    noise: Annotated[Positive3 | None, AUTO] = None


class ImuColumns(Stamped):
    """Gyro and accelerometer, in the sensor's own axes."""

    gyro: tuple[Column, Column, Column]
    accel: tuple[Column, Column, Column]
    angle_unit: Literal["rad", "deg"] = "rad"
    """Of the gyro: rad/s or deg/s."""
    accel_unit: Literal["m/s^2", "g", "mg"] = "m/s^2"
    up: Annotated[Axis | None, AUTO] = None
    """The sensor's axis that points up."""
    forward: Annotated[Axis | None, AUTO] = None
    """The sensor's axis that points along x of B."""
    rotation: Vector3 | None = None
    """R_BI as roll, pitch, yaw [rad], instead of ``up`` and ``forward``."""
    position: Vector3 = (0.0, 0.0, 0.0)
    delay: float = 0.0
    """The stamps are this much later than the instant of sampling [s]."""
    gyro_noise: Annotated[Positive | None, AUTO] = None
    gyro_bias: Annotated[NonNegative | None, AUTO] = None
    accel_noise: Annotated[Positive | None, AUTO] = None
    accel_bias: Annotated[NonNegative | None, AUTO] = None

    @model_validator(mode="after")
    def _mounting(self) -> Self:
        if self.rotation is not None and (self.up or self.forward):
            raise ValueError("give rotation, or up and forward, not both")
        if self.up and self.forward and self.up[1] == self.forward[1]:
            raise ValueError(f"up {self.up!r} and forward {self.forward!r} are the same axis")
        return self


class CommandColumns(VelocityColumns):
    """Commands to the drive, V_OB_B."""


class ReferenceColumns(PoseColumns):
    """Where the platform truly was, in a frame of its own."""

    latitude: Column | None = None
    """With ``longitude`` instead of x, y [deg]: made into metres east and north."""
    longitude: Column | None = None
    sigma: NonNegative = 0.0
    """Standard deviation of x and of y [m]."""

    @model_validator(mode="after")
    def _one_position(self) -> Self:
        plane = (self.x is not None, self.y is not None)
        globe = (self.latitude is not None, self.longitude is not None)
        if (plane, globe) not in (((True, True), (False, False)), ((False, False), (True, True))):
            raise ValueError("give x and y, or latitude and longitude")
        return self


class PlatformFacts(Strict):
    """What is known of the drive; the keys of a robot's [platform]."""

    speed_limit: Annotated[Positive3 | None, AUTO] = None
    acceleration_limit: Annotated[Positive3 | None, AUTO] = None
    lag: Annotated[Positive | None, AUTO] = None
    command_delay: Annotated[NonNegative | None, AUTO] = None
    disturbance: Annotated[Positive3 | None, AUTO] = None
    disturbance_time: Annotated[Positive | None, AUTO] = None


class LogDescription(Stamped):
    """A log in the plain form. Keys of `Stamped` at the top hold for every sensor."""

    name: Column | None = None
    odometry: OdometryColumns | None = None
    speeds: SpeedColumns | None = None
    imu: ImuColumns | None = None
    commands: CommandColumns | None = None
    reference: ReferenceColumns | None = None
    platform: PlatformFacts = PlatformFacts()

    @model_validator(mode="after")
    def _something_to_estimate_from(self) -> Self:
        if self.odometry is None and self.speeds is None:
            raise ValueError("needs [odometry] or [speeds]: without wheels there is no pose")
        return self

    def sensors(self) -> dict[str, Stamped]:
        """The sensors that are described, by name of their table, defaults filled in."""
        tables = {
            "odometry": self.odometry,
            "speeds": self.speeds,
            "imu": self.imu,
            "commands": self.commands,
            "reference": self.reference,
        }
        return {name: self._filled(table) for name, table in tables.items() if table is not None}

    def _filled(self, table: Stamped) -> Stamped:
        keys = [key for key in Stamped.model_fields if key not in table.model_fields_set]
        return table.model_copy(update={key: getattr(self, key) for key in keys})
