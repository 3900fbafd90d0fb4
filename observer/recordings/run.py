"""A recording through an observer: what it would have said, tick by tick."""

from __future__ import annotations

import sys
from array import array
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import numpy as np

from observer.observer import Observer
from observer.recordings.recording import Recording, Samples
from services.messages import Array, BaseCommand, Estimate, Imu, Message, Odometry, WheelSpeed

TICK = 0.002
"""Time between two estimates, as on the robot [s]."""
SLACK = 1e-9
"""What arrives this little after a tick counts as there: stamps are rounded [s]."""

_SHAPES: dict[str, tuple[int, ...]] = {
    "t": (),
    "pose": (3,),
    "covariance": (6, 6),
    "gyro_bias": (),
    "accel_bias": (2,),
    "odometry_innovation": (3,),
    "odometry_nis": (),
}
"""Figures of an estimate that are kept: the arrays of `Estimates`."""

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
        covariance: of (pose, velocity) as reported (n, 6, 6).
        gyro_bias: (n,) [rad/s].
        accel_bias: (n, 2) [m/s^2].
        odometry_innovation: newest until then (n, 3) [m, m, rad].
        odometry_nis: its normalised square (n,).
        valid: whether the estimate may be used (n,).
        slip: whether slip is reported (n,).
        reason: what was said beside it, (n) words.
        rejected: refused measurements by reason, over the whole recording.
    """

    covariance: Array
    gyro_bias: Array
    accel_bias: Array
    odometry_innovation: Array
    odometry_nis: Array
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


def replay(recording: Recording, observer: Observer, tick: float = TICK) -> Iterator[Estimate]:
    """Step an observer over a recording, giving it everything when it arrived.

    Args:
        recording: what the sensors said.
        observer: fresh.
        tick: time between two estimates [s]; ticks are multiples of it, from the
            last before anything arrives.

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
    for k in range(int(np.floor(first / tick)), int(np.ceil(last / tick)) + 1):
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
    columns = {name: array("d") for name in _SHAPES}
    reason: list[str] = []
    valid = bytearray()
    rejected: dict[str, int] = {}
    for e in estimates:
        if e.reason == "no odometry yet":
            continue
        for name, column in columns.items():
            column.frombytes(np.asarray(getattr(e, name), dtype=np.float64).tobytes())
        reason.append(sys.intern(e.reason))
        valid.append(e.valid)
        rejected = e.rejected
    if not reason:
        raise ValueError("the observer never started: it needs odometry or wheel speeds")
    arrays = {
        name: np.frombuffer(column, dtype=np.float64).reshape(-1, *_SHAPES[name])
        for name, column in columns.items()
    }
    return Estimates(
        **arrays,
        valid=np.frombuffer(valid, dtype=np.bool_),
        slip=np.array(["slip" in text for text in reason]),
        reason=reason,
        rejected=dict(rejected),
    )
