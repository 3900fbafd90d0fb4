"""From a recording to noise parameters: those under which its innovations are likeliest.

The likelihood of all innovations, sum of log N(y; 0, S), is a function of what the filter believes
of noise. It is made largest over the logarithms of the parameters by scoring (Gupta and Mehra, IEEE
Trans. Automatic Control 1974): Fisher's information gives both the step and, at the end, how well
the recording tells each parameter. A weak prior, a factor of ten about the description, keeps those
in place of which it tells nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import OptimizeResult, minimize

from deploy.robot import MobileBase
from observer.logs.innovations import innovations, measurements
from observer.logs.likelihood import STATED, Likelihood, counted
from observer.logs.parameters import Parameter, parameters
from observer.logs.part import cut, liveliest
from observer.logs.recording import Recording
from services.messages import Array

UNTOLD = 0.25
"""A parameter whose logarithm is known no better than this is not told by the recording."""
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
        deviation: standard deviation of the logarithm of ``after``: 0.1 is 10 %.
        told: whether the recording tells it.
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


def tune(recording: Recording, seconds: float = 30.0) -> Tuning:
    """Find the noise parameters of a platform from the liveliest part of a recording.

    Args:
        recording: put right by `observer.logs.verdicts.prepare` or right from the start; delays,
            scales and the mounting of the IMU are taken as its base says.
        seconds: how much of it is used [s]; the time this takes is in proportion.

    Raises:
        ValueError: less than ``SHORTEST`` seconds asked for, fewer than ``FEWEST`` innovations in
            that part, or neither odometry nor wheel speeds.
    """
    if not seconds >= SHORTEST:
        raise ValueError(f"{seconds:g} s tell no noise from motion: {SHORTEST:g} s at least")
    start, end = liveliest(recording, seconds)
    given = measurements(cut(recording, start, end))
    base, names = recording.base, parameters(recording)
    count = len(counted(given, base, start))
    if count < FEWEST:
        raise ValueError(
            f"{recording.name}: {count} innovations in {end - start:.0f} s; noise takes {FEWEST}"
        )
    function = Likelihood(given, base, names, start)
    best, deviation = _largest(function)
    tuned = []
    for p, log, sd in zip(names, best, deviation, strict=True):
        before, told = p.get(base), bool(sd < UNTOLD)
        if told:
            base = p.put(base, math.exp(log))
        tuned.append(Tuned(p, before, p.get(base), float(sd), told))
    both = recording.base, base
    sums = [float(counted(given, b, start).log_likelihood.sum()) for b in both]
    nis = [{k: float(v.nis.mean()) for k, v in innovations(given, b, STATED).items()} for b in both]
    return Tuning(
        base,
        tuple(tuned),
        (sums[0], sums[1]),
        {k: (nis[0][k], nis[1][k]) for k in nis[0]},
        count,
        (start, end),
    )


def _largest(function: Likelihood) -> tuple[Array, Array]:
    """Logarithms at which the likelihood is largest, and the standard deviation of each."""

    def enough(intermediate_result: OptimizeResult) -> None:
        slope, curve = (f(intermediate_result.x) for f in (function.slope, function.curvature))
        if 0.5 * slope @ np.linalg.solve(curve, slope) < GAIN:
            raise StopIteration

    found = minimize(
        function.value,
        function.origin,
        jac=function.slope,
        hess=function.curvature,
        method="trust-exact",
        options={"initial_trust_radius": 1.0, "max_trust_radius": 2.0, "maxiter": 30},
        callback=enough,
    )
    return found.x, np.sqrt(np.diag(np.linalg.inv(function.curvature(found.x))))
