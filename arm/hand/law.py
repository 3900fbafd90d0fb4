"""The torque law of a hand that slides: tau = h + (M S) qdd + JL^T f, leaders' rows throughout.

Fingertips press along their normals with an open-loop force; what they do along the surface is an
acceleration towards references. Normal rows ask for damping only: a position loop along the
normal would turn errors of the estimated normal into force.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arm.hand.friction import Friction
from arm.hand.model import FINGERS, JOINTS, SPREAD, HandModel, Placed
from arm.hand.quality import tangents

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Gains:
    """Of the law; none was swept."""

    normal: float = 10.0
    """Damping along the normal [1/s]."""
    tangent: float = 30.0
    """Bandwidth along the surface, critically damped [rad/s]."""
    damping: float = 1e-4
    """lambda^2 of the inverse of the nine rows [m^2]."""
    posture: float = 4.0
    """Of flexion and spread, in the null space [1/s]."""
    haste: float = 0.5
    """Fastest that posture is sought: what drives the null space moves arm and palm [rad/s]."""
    rest: float = 10.0
    """Damping of the null space [1/s]."""
    edge: float = 0.10
    """Joints are pushed back from this near their limits [rad]."""
    stop: float = 0.03
    """This near a limit a joint counts as at it [rad]."""
    saturation: float = 0.001
    """Distance over which the feed-forward against friction builds up [m]."""
    hold: float = 30.0
    """Bandwidth of joints that follow a reference, critically damped [rad/s]."""


class Law:
    """Torques of the eleven driven joints.

    Args:
        model: as believed.
        gains: see ``Gains``.
        friction: share of the described Coulomb friction that is fed forward, arm and hand [1].

    Attributes:
        friction: to be shown how the joints move, and what is sent in the end.
    """

    def __init__(
        self, model: HandModel, gains: Gains | None = None, friction: tuple[float, float] = (0, 0)
    ) -> None:
        self.gains = gains or Gains()
        self._model = model
        self.friction = Friction(model.coulomb * np.repeat(friction, [7, 4]))
        self._rate = np.zeros(JOINTS)

    def reset(self) -> None:
        """Forget the desired rates that friction is fed forward for."""
        self._rate = np.zeros(JOINTS)

    def slide(
        self,
        dt: float,
        at: Placed,
        normals: Array,
        references: Array,
        force: Array,
        friction: Array,
        posture: Array,
        rates: Array | None = None,
    ) -> Array:
        """Press and slide with all three fingers, shape (11,) [N m].

        Args:
            dt: since the last call [s].
            at: the hand as it is.
            normals: into the object, in B, shape (3, 3).
            references: for the tips' middles, in B, shape (3, 3) [m]; only what is tangential of
                the way there counts.
            force: to press with, shape (3,) [N].
            friction: expected at each tip, shape (3,) [1].
            posture: of spread and flexions where there is freedom, shape (4,) [rad].
            rates: of the references, in B, shape (3, 3); 0 if not stated [m/s].
        """
        g = self.gains
        away = references - at.x
        along = away - normals * np.sum(away * normals, axis=1)[:, None]
        v = at.v
        slower = v if rates is None else v - rates
        rows = np.empty((9, JOINTS))
        asked = np.empty(9)
        first, second = tangents(normals)
        w = g.tangent
        for i in range(FINGERS):
            n, s, t, J = normals[i], first[i], second[i], at.JS[i]
            wish = w * w * along[i] - 2.0 * w * slower[i]
            rows[i], rows[3 + 2 * i], rows[4 + 2 * i] = n @ J, s @ J, t @ J
            asked[i] = -g.normal * (n @ v[i])
            asked[3 + 2 * i], asked[4 + 2 * i] = s @ wish, t @ wish
        own = self._own(at, posture)
        qdd = self._share(rows, asked, own)
        stopped = self._stopped(at, qdd)
        if stopped.any():
            # a joint at its stop is no help: left in, the others would run after what it owes
            rows[:, stopped] = 0.0
            own[stopped] = -2.0 * g.rest * at.qd[stopped]
            qdd = self._share(rows, asked, own)
        # where the tips are to go, as a speed: friction there is fed forward
        heading = 0.5 * w * along + (0.0 if rates is None else rates)
        size = np.linalg.norm(heading, axis=1)[:, None]
        drag = (friction * force)[:, None] * heading / np.maximum(size, 0.5 * w * g.saturation)
        f = normals * force[:, None] + drag
        tau = at.h + at.M @ qdd + np.einsum("ikj,ik->j", at.JL, f)
        self._rate = 0.9 * (self._rate + dt * qdd) + 0.1 * at.qd
        return self._clip(tau + self.friction.against(self._rate))

    def follow(
        self,
        at: Placed,
        q: Array,
        qd: Array,
        free: Array,
        force: Array,
        bandwidth: Array | float | None = None,
    ) -> Array:
        """Follow joint references, some flexions giving way to a force, shape (11,) [N m].

        Args:
            at: the hand as it is.
            q: references, shape (11,) [rad].
            qd: their rates, shape (11,) [rad/s].
            free: joints that follow no reference but are only damped, shape (11,).
            force: of each tip on the world, in B, shape (3, 3) [N].
            bandwidth: of the following, each or all; ``Gains.hold`` if not stated [rad/s].
        """
        w = self.gains.hold if bandwidth is None else bandwidth
        qdd = np.where(
            free, -self.gains.normal * at.qd, w * w * (q - at.q) + 2.0 * w * (qd - at.qd)
        )
        tau = at.h + at.M @ qdd + np.einsum("ikj,ik->j", at.JL, force)
        return self._clip(tau + self.friction.against(np.where(free, 0.0, qd + 2.0 * (q - at.q))))

    def press(self, at: Placed, finger: int, force: Array) -> Array:
        """Torque of one finger's own flexion for a force (3,) on the world, shape (11,) [N m]."""
        tau = np.zeros(JOINTS)
        tau[8 + finger] = at.JL[finger, :, 8 + finger] @ force
        return tau

    def _share(self, rows: Array, asked: Array, own: Array) -> Array:
        """Accelerations of joints for those of nine rows, normals first, shape (11,)."""
        gram = rows @ rows.T
        gram.flat[::10] += self.gains.damping
        qdd = own + rows.T @ np.linalg.solve(gram, asked - rows @ own)
        # what damping left undone of the normals must not become force
        upper = rows[:3]
        out: Array = qdd + upper.T @ np.linalg.solve(upper @ upper.T, asked[:3] - upper @ qdd)
        return out

    def _stopped(self, at: Placed, qdd: Array) -> NDArray[np.bool_]:
        """Which joints are at a limit and would go on into it, shape (11,)."""
        near = self.gains.stop
        ahead = at.q + near * np.sign(qdd)
        out: NDArray[np.bool_] = (ahead < self._model.lower) | (ahead > self._model.upper)
        return out

    def _own(self, at: Placed, posture: Array) -> Array:
        """What the joints would do by themselves: posture, damping, away from limits."""
        g = self.gains
        rate = np.zeros(JOINTS)
        rate[SPREAD:] = np.clip(g.posture * (posture - at.q[SPREAD:]), -g.haste, g.haste)
        lower = np.maximum(self._model.lower + g.edge - at.q, 0.0)
        upper = np.maximum(at.q - self._model.upper + g.edge, 0.0)
        rate += 10.0 * (lower - upper)
        own: Array = g.rest * (rate - at.qd)
        return own

    def _clip(self, tau: Array) -> Array:
        return np.clip(tau, -self._model.limit, self._model.limit)
