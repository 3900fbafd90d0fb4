"""A recording: what the sensors of a platform said, whoever recorded it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from deploy.robot import MobileBase
from services.messages import Array


@dataclass(frozen=True)
class Samples:
    """One sensor's samples, in the order of ``t``.

    Attributes:
        t: when each was sampled, as far as its stamp tells, shape (n,) [s].
        arrival: when each could be used, shape (n,) [s]; never before ``t`` of the same clock.
        values: shape (n, k).
    """

    t: Array
    arrival: Array
    values: Array

    def __len__(self) -> int:
        return len(self.t)

    def between(self, start: float, end: float) -> Samples:
        """The samples with start <= t < end [s]."""
        keep = (self.t >= start) & (self.t < end)
        return Samples(self.t[keep], self.arrival[keep], self.values[keep])

    @property
    def period(self) -> float:
        """Median time between samples [s]; nan with fewer than two."""
        return float(np.median(np.diff(self.t))) if len(self.t) > 1 else float("nan")


@dataclass(frozen=True)
class Recording:
    """Everything a recording holds; None where it has no such sensor.

    Attributes:
        name: for titles.
        base: what is known or assumed of the platform and its sensors.
        odometry: X_OB, values (n, 3): x, y [m], heading [rad], continuous.
        speeds: V_OB_B from the wheels, values (n, 3): [m/s, m/s, rad/s].
        imu: in the sensor's frame, values (n, 6): gyro [rad/s], accelerometer (specific force)
            [m/s^2].
        commands: V_OB_B, values (n, 3), stamped when computed.
        reference: where the platform truly was, values (n, 2) x, y [m] or (n, 3) with heading
            [rad], in a frame of its own.
        reference_sigma: standard deviation of the reference's position [m]; 0 if exact.
    """

    name: str
    base: MobileBase
    odometry: Samples | None = None
    speeds: Samples | None = None
    imu: Samples | None = None
    commands: Samples | None = None
    reference: Samples | None = None
    reference_sigma: float = 0.0
