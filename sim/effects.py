"""What the disturbances of a scenario do at one instant."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sim.disturbance import (
    Bias,
    Blinded,
    BoardShift,
    Bump,
    Delay,
    Dropout,
    Noise,
    Push,
    Slip,
    Timed,
)

Array = NDArray[np.float64]
GRAVITY = 9.81
"""[m/s^2]"""


@dataclass
class Effects:
    """Sum of all disturbances that act."""

    pushes: list[tuple[str, Array]] = field(default_factory=list)
    """Body name and force in W, shape (3,) [N]."""
    vertical: float = 0.0
    """Acceleration of the floor, upwards [m/s^2]."""
    yaw: float = 0.0
    """Angular acceleration forced on the platform [rad/s^2]."""
    slip: Array = field(default_factory=lambda: np.zeros(2))
    """Velocity of the platform that the wheels do not see, in W [m/s]."""
    slip_acceleration: Array = field(default_factory=lambda: np.zeros(2))
    """Its derivative [m/s^2]."""
    dropout: set[str] = field(default_factory=set)
    blinded: set[str] = field(default_factory=set)
    delay: dict[str, float] = field(default_factory=dict)
    noise: dict[str, float] = field(default_factory=dict)
    gyro_bias: Array = field(default_factory=lambda: np.zeros(3))
    accel_bias: Array = field(default_factory=lambda: np.zeros(3))
    board: Array | None = None
    """How far the board has been moved, in W [m]; None if it has not."""
    names: list[str] = field(default_factory=list)
    slips: bool = False
    """Whether a slip acts."""


NONE = Effects()


def effects_at(now: float, timeline: list[Timed]) -> Effects:
    """Effects of the disturbances of ``timeline`` that act at robot time ``now`` [s]."""
    active = [d for d in timeline if d.active(now)]
    if not active:
        return NONE
    out = Effects(names=[getattr(d, "kind", "?") for d in active])
    for d in active:
        if isinstance(d, Push):
            out.pushes.append((d.on, d.force * _towards(d.direction)))
        elif isinstance(d, Bump):
            phase = now - d.t
            fade = math.sin(math.pi * phase / d.duration)
            wave = fade * math.sin(2 * math.pi * d.frequency * phase)
            out.vertical += d.amplitude * wave
            out.yaw += d.yaw * wave
        elif isinstance(d, Slip):
            # from rest to rest: a velocity of 1 - cos, which carries ``distance``
            out.slips = True
            phase = 2 * math.pi * (now - d.t) / d.duration
            mean = d.distance / d.duration * _towards(d.direction)[:2]
            out.slip = out.slip + mean * (1.0 - math.cos(phase))
            out.slip_acceleration = out.slip_acceleration + (
                mean * (2 * math.pi / d.duration * math.sin(phase))
            )
        elif isinstance(d, BoardShift):
            phase = min((now - d.t) / d.over, 1.0)
            way = d.distance * (phase - math.sin(2 * math.pi * phase) / (2 * math.pi))
            moved = way * _towards(d.direction)
            out.board = moved if out.board is None else out.board + moved
        elif isinstance(d, Dropout):
            out.dropout.add(d.sensor)
        elif isinstance(d, Blinded):
            out.blinded.add(d.sensor)
        elif isinstance(d, Delay):
            out.delay[d.sensor] = out.delay.get(d.sensor, 0.0) + d.extra
        elif isinstance(d, Noise):
            out.noise[d.sensor] = out.noise.get(d.sensor, 1.0) * d.factor
        elif isinstance(d, Bias):
            bias = out.gyro_bias if d.sensor == "gyro" else out.accel_bias
            bias[d.axis_index] += d.value
    return out


def _towards(direction: float) -> Array:
    angle = math.radians(direction)
    return np.array([math.cos(angle), math.sin(angle), 0.0])
