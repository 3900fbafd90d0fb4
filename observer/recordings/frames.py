"""How an inertial unit is mounted: which of its axes points up, which forward."""

from __future__ import annotations

import math

import numpy as np
from scipy.spatial.transform import Rotation

from observer.recordings.recording import Samples
from observer.sensor_models import rotation_of
from services.messages import Array

GRAVITY = 9.81
"""[m/s^2]"""
AXES = ("x", "y", "z")


def axis_vector(axis: str) -> Array:
    """Unit vector (3) of an axis by name, as ``-y``."""
    out = np.zeros(3)
    out[AXES.index(axis[1])] = 1.0 if axis[0] == "+" else -1.0
    return out


def nearest_axis(direction: Array) -> tuple[str, float]:
    """The axis nearest to a direction (3), and the angle between the two [rad]."""
    unit = direction / np.linalg.norm(direction)
    k = int(np.argmax(np.abs(unit)))
    name = ("+" if unit[k] > 0 else "-") + AXES[k]
    return name, math.acos(min(abs(float(unit[k])), 1.0))


def level(up: Array, forward: Array | None = None) -> Array:
    """R_BI (3, 3) of an IMU whose ``up`` (3) points up and ``forward`` (3) along x of B.

    Args:
        up: in the sensor's axes; any length.
        forward: likewise; only its part across ``up`` counts. None, or along ``up``: the first of
            the sensor's +x, +z that is not nearer to the vertical than 45 degrees.
    """
    z = up / np.linalg.norm(up)
    for candidate in (forward, np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])):
        if candidate is not None:
            x = candidate - (candidate @ z) * z
            if np.linalg.norm(x) > 0.7 * np.linalg.norm(candidate):
                break
    x = x / np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z])


def turned(R_BI: Array, yaw: float) -> Array:
    """A mounting (3, 3), turned about the vertical of B by ``yaw`` [rad]."""
    c, s = math.cos(yaw), math.sin(yaw)
    return np.asarray(np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ R_BI)


def rpy_of(R_BI: Array) -> tuple[float, float, float]:
    """Roll, pitch, yaw [rad] of a rotation (3, 3)."""
    roll, pitch, yaw = Rotation.from_matrix(R_BI).as_euler("xyz")
    return float(roll), float(pitch), float(yaw)


def matrix_of(rpy: tuple[float, float, float]) -> Array:
    """R_BI (3, 3) of roll, pitch, yaw [rad]."""
    turned = rotation_of(rpy)
    return np.eye(3) if turned is None else turned


def in_B(imu: Samples, R_BI: Array) -> Samples:
    """IMU samples (n, 6) turned into B."""
    values = np.concatenate([imu.values[:, :3] @ R_BI.T, imu.values[:, 3:] @ R_BI.T], axis=1)
    return Samples(imu.t, imu.arrival, values)


def heading_of(quaternion: Array) -> Array:
    """Heading (n,) [rad] of quaternions (n, 4): x, y, z, w."""
    x, y, z, w = quaternion.T
    return np.asarray(np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)))


def east_north(latitude: Array, longitude: Array) -> Array:
    """Metres east and north (n, 2) of the first point, on the WGS 84 ellipsoid.

    Args:
        latitude: (n,) [deg].
        longitude: (n,) [deg].
    """
    a, e2 = 6378137.0, 6.69437999014e-3
    first = math.radians(float(latitude[0]))
    w = math.sqrt(1.0 - e2 * math.sin(first) ** 2)
    north = a * (1.0 - e2) / w**3
    east = a / w * math.cos(first)
    across = np.radians((longitude - longitude[0] + 180.0) % 360.0 - 180.0)
    return np.stack([east * across, north * np.radians(latitude - latitude[0])], axis=1)
