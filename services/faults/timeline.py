"""Timelines of faults, drawn by seed: of messages, of services, and of the robot and its world."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np

from services.faults import kinds as k
from sim.disturbance import Bias, BoardShift, Bump, Delay, Dropout, Noise, Push, Slip, Timed

TOPICS = (
    "robot/arm_state",
    "robot/clock",
    "robot/odometry",
    "robot/imu",
    "arm/command",
    "base/command",
    "observer/estimate",
    "arm/status",
)
"""Whose messages go wrong: every one that somebody acts upon."""
SERVICES = ("observer", "arm", "base")
WINDOW = (1.0, 7.0)
"""When faults begin [s]: from the approach to the retreat."""
MOST = 3
"""Faults in a run."""

Rng = np.random.Generator


def draw(seed: int) -> tuple[list[k.Fault], list[Timed]]:
    """One to three faults: those of the wire and of services, and those of the world."""
    rng = np.random.default_rng([seed, 9])
    faults: list[k.Fault] = []
    world: list[Timed] = []
    for _ in range(int(rng.integers(1, MOST + 1))):
        makers = (_MESSAGES, _SERVICES, _WORLD)[int(rng.choice(3, p=(0.5, 0.2, 0.3)))]
        made = makers[int(rng.integers(len(makers)))](rng, float(rng.uniform(*WINDOW)))
        if isinstance(made, Timed):
            world.append(made)
        else:
            faults.append(made)
    return faults, world


def _topic(rng: Rng) -> str:
    return TOPICS[int(rng.integers(len(TOPICS)))]


def _service(rng: Rng) -> str:
    return SERVICES[int(rng.integers(len(SERVICES)))]


def _share(rng: Rng) -> float:
    """Now and then all of them."""
    return 1.0 if rng.random() < 0.4 else float(rng.uniform(0.05, 0.9))


def _span(rng: Rng) -> float:
    """From a few ticks to seconds."""
    return float(np.exp(rng.uniform(np.log(0.02), np.log(2.0))))


def _towards(rng: Rng) -> float:
    return float(rng.uniform(-180, 180))


Maker = Callable[[Rng, float], k.Fault | Timed]
_MESSAGES: tuple[Maker, ...] = (
    lambda r, t: k.Loss(t, _span(r), _topic(r), _share(r)),
    lambda r, t: k.Duplication(t, _span(r), _topic(r), _share(r)),
    lambda r, t: k.Reordering(t, _span(r), _topic(r), float(r.uniform(0.002, 0.05))),
    lambda r, t: k.Lateness(t, _span(r), _topic(r), float(r.uniform(0.002, 0.2))),
    lambda r, t: k.Replay(t, _span(r), _topic(r), float(r.uniform(0.05, 3.0))),
    lambda r, t: k.Corruption(t, _span(r), _topic(r), _share(r)),
    lambda r, t: k.Flood(t, min(_span(r), 0.5), _topic(r), int(r.integers(1, 20))),
)
_SERVICES: tuple[Maker, ...] = (
    lambda r, t: k.Hang(t, _span(r), _service(r)),
    lambda r, t: k.Death(t, float(r.uniform(0.5, 2.0)), _service(r)),
    lambda r, t: k.ClockStep(t, _span(r), _service(r), float(r.uniform(-5.0, 5.0))),
)


def _sensor_fault(rng: Rng, t: float) -> Timed:
    """A sensor that is silent, late or noisy."""
    sensor: Literal["odometry", "imu"] = "odometry" if rng.random() < 0.5 else "imu"
    duration = _span(rng)
    match int(rng.integers(3)):
        case 0:
            return Dropout(t=t, sensor=sensor, duration=duration)
        case 1:
            extra = float(rng.uniform(0.01, 0.4))
            return Delay(t=t, sensor=sensor, extra=extra, duration=duration)
    return Noise(t=t, sensor=sensor, factor=float(rng.uniform(2, 30)), duration=duration)


_WORLD: tuple[Maker, ...] = (
    lambda r, t: Push(t=t, duration=0.2, force=float(r.uniform(20, 300)), direction=_towards(r)),
    lambda r, t: Bump(t=t, amplitude=float(r.uniform(0.5, 4)), yaw=float(r.uniform(0, 2))),
    lambda r, t: Slip(t=t, distance=float(r.uniform(0.005, 0.05)), direction=_towards(r)),
    _sensor_fault,
    _sensor_fault,
    _sensor_fault,
    lambda r, t: Bias(t=t, sensor="gyro", value=float(r.uniform(-0.05, 0.05))),
    lambda r, t: Bias(t=t, sensor="accel", value=float(r.uniform(-0.3, 0.3))),
    lambda r, t: BoardShift(t=t, distance=float(r.uniform(0.01, 0.3)), direction=0.0),
    lambda r, t: BoardShift(t=t, distance=float(r.uniform(0.005, 0.03)), direction=180.0),
)
