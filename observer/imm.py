"""Interacting multiple models: all modes at once, each with its probability.

Blom and Bar-Shalom 1988. Every mode of `observer.modes` has a filter of its own, which differs in
the disturbance it expects. At each measurement the beliefs are mixed as the modes' transition
probabilities say, each filter fuses it, and its likelihood moves the weight of its mode. Beside the
automaton that switches, as a comparison: docs/observer.md has the figures.
"""

from __future__ import annotations

import math

import numpy as np

from observer.belief import IMU, Belief, Event, Hypothesis
from observer.modes import Mode, ModeState
from observer.planar_ekf import PlanarEKF
from services.messages import Array

MODES = (
    ModeState(Mode.STANDING, math.inf),
    ModeState(Mode.DRIVING),
    ModeState(Mode.DISTURBED, math.inf),
)
STAY = (2.0, 2.0, 0.2)
"""Mean time in each mode [s]."""
START = (0.1, 0.8, 0.1)
"""Probabilities at the start."""


class ImmEKF(PlanarEKF):
    """Prediction, gate and update in three modes, and their mixture.

    Arguments and errors are those of `PlanarEKF`; ``options.modes`` must be ``imm``.
    """

    def fuse(self, before: Belief, event: Event) -> Belief:
        """Belief after a measurement that was sampled at or after ``before.t``."""
        known = before.hypotheses or tuple(Hypothesis(before.x, before.P, p) for p in START)
        mixed = _mixed(known, event.t - before.t)
        after, logs = [], []
        for state, h in zip(MODES, mixed, strict=True):
            belief = super().fuse(before._replace(x=h.x, P=h.P, mode=state), event)
            after.append(belief)
            nis = belief.imu_nis if event.sensor == IMU else belief.odometry_nis
            logs.append(-0.5 * (nis + float(np.linalg.slogdet(self.S)[1])))
        most = max(logs)
        weights = [
            max(h.weight * math.exp(v - most), 1e-9) for h, v in zip(mixed, logs, strict=True)
        ]
        total = sum(weights)
        hypotheses = tuple(
            Hypothesis(b.x, b.P, w / total) for b, w in zip(after, weights, strict=True)
        )
        x, P = _moments(hypotheses, [h.weight for h in hypotheses])
        best = max(range(3), key=lambda i: hypotheses[i].weight)
        return after[best]._replace(x=x, P=P, mode=MODES[best], hypotheses=hypotheses)


def _mixed(known: tuple[Hypothesis, ...], dt: float) -> list[Hypothesis]:
    """What each mode starts from after ``dt`` [s] in which modes may have changed."""
    change = [-math.expm1(-max(dt, 0.0) / stay) for stay in STAY]
    out = []
    for j in range(3):
        flow = [
            h.weight * (1.0 - change[i] if i == j else 0.5 * change[i]) for i, h in enumerate(known)
        ]
        weight = sum(flow)
        x, P = _moments(known, [f / weight for f in flow])
        out.append(Hypothesis(x, P, weight))
    return out


def _moments(known: tuple[Hypothesis, ...], weights: list[float]) -> tuple[Array, Array]:
    """Mean (14) and covariance (14, 14) of a mixture."""
    x = sum(w * h.x for w, h in zip(weights, known, strict=True))
    P = np.zeros_like(known[0].P)
    for w, h in zip(weights, known, strict=True):
        d = h.x - x
        P += w * (h.P + np.outer(d, d))
    return np.asarray(x), P
