"""From a recording to noise parameters: those under which its innovations are likeliest.

The likelihood of all innovations, sum of log N(y; 0, S), is a function of what the filter believes
of noise. It is made largest over the logarithms of the parameters by scoring (Gupta and Mehra, IEEE
Trans. Automatic Control 1974): Fisher's information gives both the step and, at the end, how well
the recording tells each parameter. A weak prior, a factor of ten about the description, keeps those
in place of which it tells nothing.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from scipy.optimize import OptimizeResult, minimize

from deploy.robot import MobileBase
from observer.recordings.innovations import Innovations, measurements
from observer.recordings.likelihood import Likelihood, by_sensor, counted
from observer.recordings.parameters import Parameter, parameters
from observer.recordings.part import cut, liveliest
from observer.recordings.recording import Recording
from services.messages import Array

UNTOLD = 0.25
"""A parameter whose logarithm is known no better than this is not told by the recording."""
LAG = "platform.lag"
"""The one parameter that is no noise."""
GAIN = 0.5
"""The search ends when the log-likelihood has no more than this to gain."""
SHORTEST = 5.0
"""Less of a recording than this cannot tell noise from motion [s]."""
FEWEST = 100
"""Nor can fewer innovations."""


@dataclass(frozen=True)
class Tuned:
    """A parameter before and after.

    Attributes:
        parameter: which.
        before: as described.
        after: likeliest; as before if the recording does not tell it.
        deviation: standard deviation of the logarithm of the likeliest: 0.1 is 10 %.
        told: whether the recording tells it, or of noise at least that it is larger than
            described.
    """

    parameter: Parameter
    before: float
    after: float
    deviation: float
    told: bool


@dataclass(frozen=True)
class Tuning:
    """What a recording says of noise.

    Attributes:
        base: the description with the tuned parameters.
        tuned: parameter by parameter.
        log_likelihood: before and after, under `STATED`.
        nis: mean normalised innovation squared per sensor, before and after; 3 is honest.
        innovations: how many counted.
        span: first and last instant used [s].
    """

    base: MobileBase
    tuned: tuple[Tuned, ...]
    log_likelihood: tuple[float, float]
    nis: dict[str, tuple[float, float]]
    innovations: int
    span: tuple[float, float]


def tune(recording: Recording, seconds: float = 30.0, keep: Collection[str] = ()) -> Tuning:
    """Find the noise parameters of a platform from the liveliest part of a recording.

    Args:
        recording: put right by `observer.recordings.prepare.prepare` or right from the start; its
            delays, scales and the mounting of the IMU are taken as its base says.
        seconds: how much of it is used [s]; the time this takes is in proportion.
        keep: names of parameters that stay as they are. The likelihood takes every error for
            white: what is wrong in the same way for seconds, like a heading that turns too far, it
            would take for exact.

    Raises:
        ValueError: less than ``SHORTEST`` seconds asked for, fewer than ``FEWEST`` innovations in
            that part, or neither odometry nor wheel speeds.
    """
    if not seconds >= SHORTEST:
        raise ValueError(f"{seconds:g} s tell no noise from motion: {SHORTEST:g} s at least")
    start, end = liveliest(recording, seconds)
    given = measurements(cut(recording, start, end))
    base = recording.base
    names = [p for p in parameters(recording) if p.name not in keep]
    count = len(counted(given, base, start))
    if count < FEWEST:
        raise ValueError(
            f"{recording.name}: {count} innovations in {end - start:.0f} s; noise takes {FEWEST}"
        )
    function = Likelihood(given, base, names, start)
    best, deviation = _largest(function)
    # what is hardly told may only be raised: noise believed too small costs more than too large;
    # a lag is no noise
    noise = np.array([p.name != LAG for p in names])
    told = (deviation < UNTOLD) | (noise & (best > function.origin + 2.0 * deviation))
    fitted = [p for p, known in zip(names, told, strict=True) if known]
    logs = best[told]
    if fitted and not told.all():
        logs, deviation[told] = _largest(Likelihood(given, base, fitted, start), logs)
    after = base
    for p, log in zip(fitted, logs.tolist(), strict=True):
        after = p.put(after, math.exp(log))
    tuned = [
        Tuned(p, p.get(base), p.get(after), float(sd), bool(known))
        for p, sd, known in zip(names, deviation, told, strict=True)
    ]
    old, new = (by_sensor(given, b, start) for b in (base, after))
    return Tuning(
        after,
        tuple(tuned),
        (_sum(old), _sum(new)),
        {name: (float(old[name].nis.mean()), float(new[name].nis.mean())) for name in old},
        count,
        (start, end),
    )


def _sum(found: dict[str, Innovations]) -> float:
    return float(sum(i.log_likelihood.sum() for i in found.values()))


def _largest(function: Likelihood, start: Array | None = None) -> tuple[Array, Array]:
    """Logarithms at which the likelihood is largest, and the standard deviation of each."""

    def enough(intermediate_result: OptimizeResult) -> None:
        slope, curve = (f(intermediate_result.x) for f in (function.slope, function.curvature))
        if 0.5 * slope @ np.linalg.solve(curve, slope) < GAIN:
            raise StopIteration

    found = minimize(
        function.value,
        function.origin if start is None else start,
        jac=function.slope,
        hess=function.curvature,
        method="trust-exact",
        options={"initial_trust_radius": 1.0, "max_trust_radius": 2.0, "maxiter": 30},
        callback=enough,
    )
    return found.x, np.sqrt(np.diag(np.linalg.inv(function.curvature(found.x))))
