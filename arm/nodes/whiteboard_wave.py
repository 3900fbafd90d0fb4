"""Whiteboard_wave: one long slanted, wavy stroke, drawn while the platform comes along."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from arm.control.objective import smooth
from arm.hds import Event, NodeType, Parameter, ParameterValue
from arm.nodes.curve import Curve
from arm.nodes.curve_stroke import ACCELERATION, CurveStroke
from arm.nodes.node import Context, Step
from arm.nodes.stroke import DRAWN, EVENTS, PARAMETERS, Array

EASE = 0.05
"""Between ``Margin`` and so much more of reach the pen slows from its full speed to rest [m]."""
CREEPING = 0.15
"""Share of its pace below which the pen waits rather than draws: it comes to rest slowly ..."""
PATIENCE = 30.0
"""... and, because no platform comes, gives up after so long [s]."""
POINTS = 2000
"""Vertices of the wave."""


class WhiteboardWave(CurveStroke):
    """To the right, along a slant with a wave on it, longer than the arm reaches.

    The wave does not say where the platform must be: it goes on at full pace as long as more than
    ``Margin`` of the arm's reach is left, and slower as less is, down to waiting. So a platform
    that is held up is waited for, and one that comes along sets no pace.

    Control law: as every stroke; the pace falls with the reach left. Goal region: the end of the
    wave. Domain: pen on the board; the platform able to drive along it.
    """

    def __init__(self, values: Mapping[str, ParameterValue]) -> None:
        shape = int(values["Shape"])
        given = [float(values[k]) for k in ("Slope", "Amplitude", "Wavelength", "Phase")]
        slope, amplitude, wavelength, phase = varied(shape, given) if shape else given
        wave = wave_points(float(values["Length"]), slope, amplitude, wavelength, phase)
        super().__init__(values, Curve(wave))
        self._margin = float(values["Margin"])
        self._rested = 0.0

    def update(self, context: Context) -> Step:
        """Finished at the end of the wave, Out_of_Reach if the arm had to wait too long."""
        share = smooth((context.reach_margin - self._margin) / EASE)
        context.pace *= share
        step = super().update(context)
        self._rested = self._rested + context.dt if share < CREEPING else 0.0
        if step.event is None and self._rested >= PATIENCE:
            step.event = "Out_of_Reach"
            step.reason = f"the platform did not come along for {PATIENCE:g} s"
        return step


def wave_points(
    length: float, slope: float, amplitude: float, wavelength: float, phase: float
) -> Array:
    """Vertices of the wave from (0, 0), shape (n, 2) [m].

    Args:
        length: along x [m].
        slope: of the slant, upwards is positive [rad].
        amplitude: [m].
        wavelength: [m].
        phase: in the wave at which it begins [rad].
    """
    x = np.linspace(0.0, length, POINTS)
    wave = np.sin(2.0 * math.pi * x / wavelength + phase) - math.sin(phase)
    return np.column_stack([x, math.tan(slope) * x + amplitude * wave])


def varied(shape: int, given: list[float]) -> list[float]:
    """Slope, amplitude, wavelength and phase of one of many shapes.

    Args:
        shape: which one; equal numbers give equal shapes.
        given: what they vary about: the slope from 0.6 of it to the whole, to either side, the
            amplitude likewise, the wavelength up to a quarter longer, any phase.
    """
    rng = np.random.default_rng(shape)
    slope, amplitude, wavelength, _ = given
    side = 1.0 if rng.random() < 0.5 else -1.0
    shares = rng.uniform(0.6, 1.0, 2)
    longer = 1.0 + 0.25 * rng.random()
    return [
        side * shares[0] * slope,
        shares[1] * amplitude,
        longer * wavelength,
        rng.uniform(0.0, 2.0 * math.pi),
    ]


TYPE = NodeType(
    "Whiteboard_wave",
    parameters=(
        Parameter("Length", "mm", 0.01, 50.0, doc="To the right."),
        Parameter("Slope", "deg", -0.5, 0.5, 0.05, "Of the slant, upwards."),
        Parameter("Amplitude", "mm", 0.0, 0.2, 0.04, "Of the wave, up and down."),
        Parameter("Wavelength", "mm", 0.05, 10.0, 0.7, "Of the wave."),
        Parameter("Phase", "deg", -6.2832, 6.2832, 0.0, "In the wave where it begins."),
        Parameter(
            "Shape", kind="integer", lo=0, hi=1e9, default=0, doc="0: as given; else varied."
        ),
        Parameter("Margin", "mm", 0.0, 0.5, 0.1, "Reach at which the pen waits."),
        ACCELERATION,
        *PARAMETERS,
    ),
    events=(*EVENTS, Event("Out_of_Reach", "The platform did not come along.")),
    quantities=(DRAWN,),
    doc="Draw a long slanted wave, at the pace at which the platform comes along.",
    make=WhiteboardWave,
)
