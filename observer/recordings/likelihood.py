"""How likely a platform's description makes its recording, with slope and curvature.

The filter's innovations y with their covariances S, both functions of the parameters' logarithms,
give the likelihood sum log N(y; 0, S); their slopes give its slope and Fisher's information, which
is the expected curvature (Gupta and Mehra, IEEE Trans. Automatic Control 1974).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from deploy.robot import MobileBase
from observer.filter_options import FilterOptions
from observer.observer_options import ObserverOptions
from observer.recordings.innovations import Innovations, Measurements, innovations
from observer.recordings.parameters import Parameter
from services.messages import Array

PRIOR = math.log(10.0)
"""Standard deviation of the prior on a parameter's logarithm."""
STEP = 0.02
"""Of a logarithm, for slopes."""
FRESH = 1.0
"""Innovations in the first part of the recording, while the filter settles, do not count [s]."""
STATED = ObserverOptions(
    disturbance_factor=1.0,
    imu_noise_factor=1.0,
    filter=FilterOptions(
        odometry_update="gaussian", odometry_gate=math.inf, imu_gate=math.inf, alert_nis=math.inf
    ),
)
"""The filter without the observer's margins, gates and alerts: those would hide the noise, and make
the likelihood jump."""


class Likelihood:
    """Minus the log-likelihood and the log-prior, with slope and curvature.

    Every method takes the logarithms of the parameters (parameters,).

    Args:
        given: what the recording measured.
        base: the platform as described: where the search starts, and the middle of the prior.
        names: parameters.
        start: of the recording [s].
    """

    def __init__(
        self, given: Measurements, base: MobileBase, names: Sequence[Parameter], start: float
    ) -> None:
        self._given, self._base, self._names, self._start = given, base, names, start
        self.origin = np.array([math.log(max(p.get(base), 1e-9)) for p in names])
        self._known: dict[bytes, Innovations] = {}
        self._slopes: dict[bytes, tuple[Array, Array]] = {}

    def at(self, logs: Array) -> Innovations:
        """All innovations that count, of all sensors, in one."""
        key = logs.tobytes()
        if key not in self._known:
            base = self._base
            for p, log in zip(self._names, logs.tolist(), strict=True):
                base = p.put(base, math.exp(min(max(log, -25.0), 8.0)))
            self._known[key] = counted(self._given, base, self._start)
        return self._known[key]

    def value(self, logs: Array) -> float:
        """What is to be made small."""
        away = (logs - self.origin) / PRIOR
        return float(-self.at(logs).log_likelihood.sum() + 0.5 * away @ away)

    def slope(self, logs: Array) -> Array:
        """Derivative of `value` (parameters,)."""
        return self._local(logs)[0]

    def curvature(self, logs: Array) -> Array:
        """Its expected second derivative (parameters, parameters): Fisher's information."""
        return self._local(logs)[1]

    def _local(self, logs: Array) -> tuple[Array, Array]:
        key = logs.tobytes()
        if key not in self._slopes:
            here = self.at(logs)
            y, S_inverse = here.value, np.linalg.inv(here.covariance)
            weighted = (S_inverse @ y[..., None])[..., 0]
            dy, gain = [], []
            for i in range(len(logs)):
                there = self.at(logs + STEP * np.eye(len(logs))[i])
                dy.append((there.value - y) / STEP)
                gain.append(S_inverse @ (there.covariance - here.covariance) / STEP)
            slope = (logs - self.origin) / PRIOR**2
            curve = np.eye(len(logs)) / PRIOR**2
            for i in range(len(logs)):
                spread = 0.5 * np.trace(gain[i], axis1=1, axis2=2).sum()
                fit = 0.5 * np.einsum("ni,nij,nj->", y, gain[i], weighted)
                slope[i] += spread - fit + float((weighted * dy[i]).sum())
                for j in range(len(logs)):
                    curve[i, j] += 0.5 * np.einsum("nij,nji->", gain[i], gain[j])
                    curve[i, j] += np.einsum("ni,nij,nj->", dy[i], S_inverse, dy[j])
            self._slopes[key] = slope, curve
        return self._slopes[key]


def by_sensor(given: Measurements, base: MobileBase, start: float) -> dict[str, Innovations]:
    """Innovations under `STATED` from ``FRESH`` after ``start`` [s] on, by sensor."""
    found = {k: i.after(start + FRESH) for k, i in innovations(given, base, STATED).items()}
    return {k: i for k, i in found.items() if len(i)}


def counted(given: Measurements, base: MobileBase, start: float) -> Innovations:
    """The same of all sensors in one."""
    found = list(by_sensor(given, base, start).values())
    if not found:
        return Innovations(np.zeros(0), np.zeros((0, 3)), np.zeros((0, 3, 3)), np.zeros(0, bool))
    return Innovations(
        np.concatenate([i.t for i in found]),
        np.concatenate([i.value for i in found]),
        np.concatenate([i.covariance for i in found]),
        np.concatenate([i.refused for i in found]),
    )
