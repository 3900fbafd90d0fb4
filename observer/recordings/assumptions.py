"""What is taken of a platform until its log has been looked at."""

from __future__ import annotations

import numpy as np

from deploy.robot import MobileBase, Platform
from deploy.sensors import Imu, Odometry
from observer.recordings.description import LogDescription
from observer.recordings.frames import axis_vector, level, rpy_of
from observer.recordings.recording import Samples

NO_DRIVE = 1000.0
"""Lag [s] of a drive of which nothing is known: commands then do nothing."""
ANY = (10.0, 10.0, 20.0)
"""Acceleration limit that never binds [m/s^2, m/s^2, rad/s^2]."""
PLATFORM = Platform(
    speed_limit=(2.0, 2.0, 2.0),
    acceleration_limit=ANY,
    lag=NO_DRIVE,
    command_delay=0.0,
    disturbance=(0.5, 0.5, 1.0),
)
ODOMETRY = Odometry(rate=20.0, delay=0.0, resolution=(1e-3, 1e-3, 2e-3), noise=(1e-3, 1e-3, 1e-3))
IMU = Imu(
    rate=100.0,
    delay=0.0,
    gyro_noise=0.002,
    gyro_bias=0.005,
    accel_noise=0.05,
    accel_bias=0.1,
    position=(0.0, 0.0, 0.0),
)
_KEYS = {
    "platform": tuple(Platform.model_fields),
    "odometry": ("delay", "resolution", "noise", "scale"),
    "speeds": ("delay", "noise"),
    "imu": ("up", "forward", "gyro_noise", "gyro_bias", "accel_noise", "accel_bias"),
}


def auto_keys(description: LogDescription) -> frozenset[str]:
    """Keys that the description leaves to be estimated, as ``odometry.delay``."""
    found = set()
    for name, keys in _KEYS.items():
        table = getattr(description, name)
        if table is not None:
            found |= {f"{name}.{key}" for key in keys if getattr(table, key) is None}
    if description.imu is not None and description.imu.rotation is not None:
        found -= {"imu.up", "imu.forward"}
    if description.imu is not None and description.imu.forward is not None:
        found -= {"imu.up"}  # gravity has told it by then
    return frozenset(found)


def assumed_base(description: LogDescription, samples: dict[str, Samples]) -> MobileBase:
    """The platform as described, stand-ins where the description says nothing.

    Args:
        description: of the log.
        samples: by name of their table; rates and delays are measured on them.
    """
    platform = PLATFORM.model_copy(update=_given(description.platform, "platform"))
    wheels = samples.get("odometry") or samples["speeds"]
    update = _timing(wheels) | _given(description.odometry, "odometry")
    if description.speeds is not None and description.speeds.noise is not None:
        update["speed_noise"] = description.speeds.noise
    odometry = ODOMETRY.model_copy(update=update)
    imu = IMU
    if description.imu is not None:
        d = description.imu
        update = _timing(samples["imu"]) | _given(d, "imu") | {"position": d.position}
        if d.rotation is not None:
            update["rotation"] = d.rotation
        gravity = np.median(samples["imu"].values[:, 3:], axis=0)
        known = d.up is not None or (d.forward is not None and gravity.any())
        if known and d.rotation is None:  # forward alone without gravity: refused later
            up = axis_vector(d.up) if d.up else gravity
            forward = axis_vector(d.forward) if d.forward else None
            update["rotation"] = rpy_of(level(up, forward))
        imu = IMU.model_copy(update=update)
    return MobileBase(platform=platform, odometry=odometry, imu=imu)


def _given(table: object, name: str) -> dict[str, object]:
    """Keys of a table that have a value; not ``delay``, which has been taken off the stamps."""
    keys = [key for key in _KEYS[name] if key not in ("delay", "up", "forward")]
    values = {key: getattr(table, key, None) for key in keys}
    return {key: value for key, value in values.items() if value is not None}


def _timing(samples: Samples) -> dict[str, object]:
    late = float(np.median(samples.arrival - samples.t))
    return {"rate": 1.0 / samples.period, "delay": max(late, 0.0)}
