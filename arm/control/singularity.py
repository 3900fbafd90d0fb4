"""Keeping away from singular postures, by the gradient of the manipulability."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from arm.control.objective import Objective, Rows, edge

if TYPE_CHECKING:
    from arm.model import Kinematics

Array = NDArray[np.float64]


class Singularity(Objective):
    """Raises the manipulability w = sqrt(det J J^T) while it is below what is wanted.

    Yoshikawa's measure, for the joints of one serial chain; its gradient follows from the
    geometric Jacobian alone: dw/dq_k = w tr(dJ/dq_k J^#).

    Args:
        wanted: manipulability at which the goal region begins, in the units of J.
        chain: indices of the chain's revolute joints from base to tip; None is all.
        gain: [1/s].
    """

    name = "singularity"

    def __init__(self, wanted: float, chain: list[int] | None = None, gain: float = 2.0) -> None:
        self.wanted = wanted
        self.gain = gain
        self.tolerance = 0.0
        self._chain = chain

    def error(self, kinematics: Kinematics) -> Array:
        """What is missing, shape (1,); 0 where there is enough."""
        return np.array([max(self.wanted - manipulability(self._mine(kinematics)), 0.0)])

    def jacobian(self, kinematics: Kinematics) -> Array:
        """Gradient of the manipulability, shape (1, n)."""
        J = np.zeros((1, kinematics.J.shape[1]))
        chain = slice(None) if self._chain is None else self._chain
        J[0, chain] = manipulability_gradient(self._mine(kinematics))
        return J

    def rows(self, kinematics: Kinematics, dt: float) -> Rows:
        """Up the gradient; smoothly more active over the first half of what is missing."""
        error = self.error(kinematics)
        activation = edge(error, 0.5 * self.wanted)
        if activation <= 0.0:
            return Rows(np.zeros((1, kinematics.J.shape[1])), error, 0.0)
        return Rows(self.jacobian(kinematics), self.gain * error, activation)

    def _mine(self, kinematics: Kinematics) -> Array:
        return kinematics.J if self._chain is None else kinematics.J[:, self._chain]


def manipulability(J: Array) -> float:
    """Product of the singular values of J (m, n) with m <= n."""
    return float(np.prod(np.linalg.svd(J, compute_uv=False)))


def manipulability_gradient(J: Array) -> Array:
    """Derivative of ``manipulability`` by the joints, shape (n,).

    Args:
        J: geometric Jacobian of a serial chain, linear rows first, shape (6, n); its column k
            turns all columns after it, and those before it turn column k.
    """
    n = J.shape[1]
    v, w = J[:3].T, J[3:].T
    inverse = np.linalg.pinv(J)
    gradient = np.empty(n)
    for k in range(n):
        dJ = np.zeros_like(J)
        dJ[:3, k:] = np.cross(w[k], v[k:]).T
        dJ[3:, k:] = np.cross(w[k], w[k:]).T
        dJ[:3, :k] = np.cross(w[:k], v[k]).T
        gradient[k] = float(np.sum(dJ * inverse.T))
    return manipulability(J) * gradient
