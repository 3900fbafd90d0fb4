"""The classes of motion the benchmark asks for, as a table: name -> how to make a world of it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from observer.bench.manoeuvres import Manoeuvre, docking, drive, still, sway, turns
from observer.bench.sensing import GRAVITY
from observer.bench.world import SLIP, World, simulate

START = 5.0
"""What happens before is not judged: the biases are being found [s]."""
DURATION = 20.0
"""Of a run [s]."""

Draw = Callable[[np.random.Generator, float], Mapping[str, Any]]
"""Conditions of a run, given a generator and the duration [s]."""


def _nothing(rng: np.random.Generator, duration: float) -> Mapping[str, Any]:
    return {}


def _pushes(rng: np.random.Generator, duration: float) -> Mapping[str, Any]:
    times, t = [], START + rng.uniform(0.2, 1.5)
    while t < duration - 0.6:
        times.append(t)
        t += rng.uniform(4.0, 7.0)
    return {"pushes": tuple(times)}


def _slips(rng: np.random.Generator, duration: float) -> Mapping[str, Any]:
    out, t = [], START + 1.0
    while t < duration - SLIP[1]:
        angle = rng.uniform(-math.pi, math.pi)
        way = (0.05 * math.cos(angle), 0.05 * math.sin(angle))
        out.append((t + rng.uniform(0.0, 1.0), rng.uniform(0.05, 0.3), *way))
        t += 6.0
    return {"slips": tuple(out)}


def _dropout(rng: np.random.Generator, duration: float) -> Mapping[str, Any]:
    start = rng.uniform(START + 2.0, max(START + 2.0, duration - 4.0))
    return {"odometry_gap": (start, start + 1.0)}


def _tilt(rng: np.random.Generator, duration: float) -> Mapping[str, Any]:
    g, angle = GRAVITY * math.sin(math.radians(0.5)), rng.uniform(-math.pi, math.pi)
    return {"tilt": (g * math.cos(angle), g * math.sin(angle))}


@dataclass(frozen=True)
class Motion:
    """A class of motion.

    Attributes:
        about: one line for people.
        command: what the platform is told.
        draw: what befalls it, drawn anew for every seed.
    """

    about: str
    command: Manoeuvre
    draw: Draw = _nothing

    def world(self, seed: int, odometry_hz: float, duration: float = DURATION) -> World:
        """One run of it: a function of the arguments alone."""
        rng = np.random.default_rng([seed, 1])  # apart from the stream the world itself draws from
        conditions = self.draw(rng, duration)
        return simulate(self.command, seed, duration, odometry_rate=odometry_hz, **conditions)


MOTIONS: dict[str, Motion] = {
    "sway": Motion("sway of 0.3 m and 5 deg", sway),
    "drive": Motion("drive and stop; the disturbance goes on", drive),
    "docking": Motion(
        "from 0.3 m/s to 10 mm/s, stop, stand",
        docking,
        lambda rng, duration: {"brakes": 0.2},
    ),
    "push": Motion("sway with pushes of 200 N on 190 kg", sway, _pushes),
    "slip": Motion("sway with 5 cm of wheel slip now and then", sway, _slips),
    "standing": Motion("standing still", still, lambda rng, duration: {"stuck": True}),
    "dropout": Motion("sway with 1 s without odometry", sway, _dropout),
    "tilt": Motion("drive and turn by 120 deg on a floor tilted by 0.5 deg", turns, _tilt),
    "scale": Motion(
        "sway, odometry reads 1 % too much",
        sway,
        lambda rng, duration: {"scale": (1.01, 1.01)},
    ),
    "late": Motion(
        "sway with odometry that comes 0.4 s late",
        sway,
        lambda rng, duration: {"odometry_delay": 0.4},
    ),
}
