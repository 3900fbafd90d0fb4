"""A recording through an observer: what it would have said, tick by tick."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import numpy as np

from observer.logs.recording import Recording, Samples
from observer.observer import Observer
from services.messages import Array, BaseCommand, Estimate, Imu, Message, Odometry, WheelSpeed

TICK = 0.002
"""Time between two estimates, as on the robot [s]."""
SLACK = 1e-9
"""What arrives this little after a tick counts as there: stamps are rounded [s]."""

M = TypeVar("M", bound=Message)


@dataclass(frozen=True)
class Track:
    """Motion over time, one row an instant.

    Attributes:
        t: instants, ascending (n,) [s].
        pose: X_OB (n, 3): x, y [m], heading [rad], continuous.
    """

    t: Array
    pose: Array

    def __len__(self) -> int:
        return len(self.t)


@dataclass(frozen=True)
class Estimates(Track):
    """What an observer said.

    Attributes:
        velocity: V_OB_O (n, 3) [m/s, m/s, rad/s].
        covariance: of (pose, velocity) as reported (n, 6, 6).
        gyro_bias: (n,) [rad/s].
        accel_bias: (n, 2) [m/s^2].
        odometry_innovation: newest until then (n, 3) [m, m, rad].
        odometry_nis: its normalised square (n,).
        imu_innovation: newest until then (n, 3) [rad/s, m/s^2, m/s^2].
        imu_nis: its normalised square (n,).
        valid: whether the estimate may be used (n,).
        slip: whether slip is reported (n,).
        reason: what was said beside it, (n) words.
        rejected: refused measurements by reason, over the whole recording.
    """

    velocity: Array
    covariance: Array
    gyro_bias: Array
    accel_bias: Array
    odometry_innovation: Array
    odometry_nis: Array
    imu_innovation: Array
    imu_nis: Array
    valid: np.ndarray[Any, np.dtype[np.bool_]]
    slip: np.ndarray[Any, np.dtype[np.bool_]]
    reason: list[str]
    rejected: dict[str, int]

    @property
    def used(self) -> Track:
        """The track where it is valid."""
        return Track(self.t[self.valid], self.pose[self.valid])


def odometry_track(recording: Recording) -> Track | None:
    """The odometry as it is, at its stamps; None if there is none."""
    o = recording.odometry
    return None if o is None or not len(o) else Track(o.t, o.values)


class _Queue(Generic[M]):
    """Messages of one sensor by arrival, handed out as time passes."""

    def __init__(self, samples: Samples | None, make: Any) -> None:
        self._messages: list[M] = []
        self._arrivals: list[float] = []
        self._next = 0
        if samples is not None:
            order = np.argsort(samples.arrival, kind="stable")
            self._arrivals = (samples.arrival[order] - SLACK).tolist()
            rows = zip(samples.t[order].tolist(), samples.values[order], strict=True)
            self._messages = [make(t, row) for t, row in rows]

    def until(self, now: float) -> Sequence[M]:
        first, self._next = self._next, bisect_right(self._arrivals, now, self._next)
        return self._messages[first : self._next]


def replay(
    recording: Recording, observer: Observer, tick: float = TICK, start: float | None = None
) -> Iterator[Estimate]:
    """Step an observer over a recording, giving it everything when it arrived.

    Args:
        recording: what the sensors said.
        observer: fresh.
        tick: time between two estimates [s]; ticks are multiples of it.
        start: first tick [s]; by default the last before anything arrives.

    Raises:
        ValueError: a tick that is not positive, or a recording in which nothing arrives.
    """
    if not tick > 0:
        raise ValueError(f"the tick is {tick} s; it must be positive")
    odometry: _Queue[Odometry] = _Queue(recording.odometry, lambda t, v: Odometry(t=t, pose=v))
    speeds: _Queue[WheelSpeed] = _Queue(recording.speeds, lambda t, v: WheelSpeed(t=t, velocity=v))
    imu: _Queue[Imu] = _Queue(recording.imu, lambda t, v: Imu(t=t, gyro=v[:3], accel=v[3:]))
    commands: _Queue[BaseCommand] = _Queue(
        recording.commands, lambda t, v: BaseCommand(t=t, velocity=v)
    )
    first, last = span(recording)
    begin = first if start is None else start
    for k in range(int(np.floor(begin / tick)), int(np.ceil(last / tick)) + 1):
        now = k * tick
        yield observer.step(
            now, odometry.until(now), imu.until(now), commands.until(now), speeds.until(now)
        )


def span(recording: Recording) -> tuple[float, float]:
    """First and last arrival of anything but the reference [s].

    Raises:
        ValueError: nothing ever arrives.
    """
    sensors = (recording.odometry, recording.speeds, recording.imu, recording.commands)
    arrivals = [s.arrival for s in sensors if s is not None and len(s)]
    if not arrivals:
        raise ValueError(f"{recording.name}: no sensor says anything")
    return min(float(a.min()) for a in arrivals), max(float(a.max()) for a in arrivals)


def collect(estimates: Iterator[Estimate]) -> Estimates:
    """Estimates as arrays, from the first that had something to go by.

    Raises:
        ValueError: there was never anything to go by: the recording has neither odometry nor wheel
            speeds that the observer could use.
    """
    kept = [e for e in estimates if e.reason != "no odometry yet"]
    if not kept:
        raise ValueError("the observer never started: it needs odometry or wheel speeds")
    return Estimates(
        t=np.array([e.t for e in kept]),
        pose=np.array([e.pose for e in kept]),
        velocity=np.array([e.velocity for e in kept]),
        covariance=np.array([e.covariance for e in kept]),
        gyro_bias=np.array([e.gyro_bias for e in kept]),
        accel_bias=np.array([e.accel_bias for e in kept]),
        odometry_innovation=np.array([e.odometry_innovation for e in kept]),
        odometry_nis=np.array([e.odometry_nis for e in kept]),
        imu_innovation=np.array([e.imu_innovation for e in kept]),
        imu_nis=np.array([e.imu_nis for e in kept]),
        valid=np.array([e.valid for e in kept]),
        slip=np.array(["slip" in e.reason for e in kept]),
        reason=[e.reason for e in kept],
        rejected=dict(kept[-1].rejected),
    )
