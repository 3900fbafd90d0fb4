"""The numbers of a platform's description that a recording may tell."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from deploy.robot import MobileBase
from observer.recordings.recording import Recording


@dataclass(frozen=True)
class Parameter:
    """One number of a platform's description that the likelihood is made large over.

    Attributes:
        name: for people.
        unit: of its value.
        get: its value in a description.
        put: the description with another value.
    """

    name: str
    unit: str
    get: Callable[[MobileBase], float]
    put: Callable[[MobileBase, float], MobileBase]


def parameters(recording: Recording) -> tuple[Parameter, ...]:
    """What a recording can say something of."""
    out: list[Parameter] = []
    if recording.imu is not None:
        out += [_single("imu", "gyro_noise", "rad/s"), _single("imu", "accel_noise", "m/s^2")]
    if recording.odometry is not None:
        out += _pair("odometry", "noise", "m", "rad")
    if recording.speeds is not None:
        out += _pair("odometry", "speed_noise", "m/s", "rad/s")
    out += _pair("platform", "disturbance", "m/s^2", "rad/s^2")
    if recording.commands is not None and len(recording.commands):
        out.append(_single("platform", "lag", "s"))
    return tuple(out)


def _single(table: str, key: str, unit: str) -> Parameter:
    def get(base: MobileBase) -> float:
        return float(getattr(getattr(base, table), key))

    def put(base: MobileBase, value: float) -> MobileBase:
        if key == "lag":  # the closed form divides by their difference
            apart = value / base.platform.disturbance_time
            value *= 1.03 if 0.985 < apart < 1.015 else 1.0
        return _with(base, table, key, value)

    return Parameter(f"{table}.{key}", unit, get, put)


def _pair(table: str, key: str, unit: str, unit_heading: str) -> list[Parameter]:
    """x and y together (the larger of them stands for both), heading apart."""

    def get(base: MobileBase) -> tuple[float, float, float]:
        x, y, w = getattr(getattr(base, table), key)
        return float(x), float(y), float(w)

    def both(base: MobileBase, value: float) -> MobileBase:
        return _with(base, table, key, (value, value, get(base)[2]))

    def heading(base: MobileBase, value: float) -> MobileBase:
        return _with(base, table, key, (*get(base)[:2], value))

    return [
        Parameter(f"{table}.{key} x, y", unit, lambda b: max(get(b)[:2]), both),
        Parameter(f"{table}.{key} heading", unit_heading, lambda b: get(b)[2], heading),
    ]


def _with(base: MobileBase, table: str, key: str, value: object) -> MobileBase:
    changed = getattr(base, table).model_copy(update={key: value})
    return base.model_copy(update={table: changed})
