"""Slides contacts to a grasp: residual gradients, at 50 Hz, to references for the fingertips.

One update: contacts from the load cells, the displacements of ``residuals`` (three contacts) or
``virtual`` (finger 0 against 1 and 2 as one), references moved by them. It has converged when both
residuals have stayed small, and is stuck when the larger has not fallen for a while.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arm.hand import angles, curvature, residuals, virtual

Array = NDArray[np.float64]

PERIOD = 0.02
"""Of an update [s]."""
SINGLE = ("printed", "curvature")
"""Kinds that do not know virtual contacts."""
NOISE = 0.02
"""Of a normal felt, for what curvature is believed [rad]."""


@dataclass(frozen=True)
class Way:
    """Which controller slides, and when it is done.

    Attributes:
        pair: fingers 1 and 2 act as one virtual contact.
        kind: what is descended: a kind of ``residuals``, ``sequential`` (C*), ``printed`` (the
            composite in angles, Eq 4.28) or ``curvature`` (a null space that is measured); the last
            two are for three contacts.
        variant: of the virtual contact.
        radius: characteristic one [m].
        alpha: step along the gradient.
        most: longest displacement of an update [m].
        leash: largest distance of a reference from its tip [m].
        small: both residuals are below this when converged.
        times: updates for which they must be.
        left: it has not converged after all if one of them then rises above this.
        plateau: time without progress after which it is stuck [s].
        progress: what counts as progress of the residuals' norm.
        turns: updates that finger 0 of a pair slides before the others do, and so on in turn; 0:
            all at once. Fingers that slide around an object the same way turn it along if it is
            free to; those that rest hold it.
    """

    pair: bool = False
    kind: str = "sum"
    variant: virtual.Variant = "physical"
    radius: float = 0.05
    alpha: float = 0.06
    most: float = 0.0015
    leash: float = 0.005
    small: float = 0.15
    times: int = 5
    left: float = 0.2
    plateau: float = 3.0
    progress: float = 0.02
    turns: int = 0


class Slider:
    """References for three fingertips; see the module.

    Attributes:
        rho, moment: norms of the residuals of the last update.
        history: of both, a pair an update.
        updates: so far, until it converged.
        settled: updates since then; it goes on, for what is left.
        references: for the tips' middles, in B, shape (3, 3) [m].
        rates: of them until the next update, in B, shape (3, 3) [m/s].
    """

    def __init__(self, way: Way, middles: Array) -> None:
        if way.pair and way.kind in SINGLE:
            raise ValueError(f"{way.kind} is for three contacts, not for a pair")
        self.way = way
        self.references = middles.copy()
        self.rates = np.zeros((3, 3))
        self.rho = self.moment = np.inf
        self.history: list[tuple[float, float]] = []
        self.updates = self.settled = 0
        self._step = np.zeros((3, 3))
        self._good = 0
        self._least = np.inf
        self._since = 0
        self._sequence = residuals.Sequential()
        self._feelers = [curvature.Curvature(way.radius, noise=NOISE) for _ in range(3)]

    @property
    def converged(self) -> bool:
        """Whether both residuals have become small, and stayed so."""
        return self._good >= self.way.times

    @property
    def stuck(self) -> bool:
        """Whether there has been no progress for ``Way.plateau``."""
        return not self.converged and self._since * PERIOD >= self.way.plateau

    def update(self, normals: Array, points: Array, middles: Array, pace: float = 1.0) -> None:
        """Move the references by one step.

        Args:
            normals: into the object, in B, shape (3, 3).
            points: of contact, in B, shape (3, 3) [m].
            middles: of the tips, in B, shape (3, 3) [m].
            pace: share of ``Way.most`` that joints can follow.
        """
        w = self.way
        most = pace * w.most
        if w.pair:
            rho, moment = virtual.residuals(normals, points, virtual.PAIR, w.radius, w.variant)
        else:
            rho, moment = residuals.residuals(normals, points, w.radius)
        self.rho, self.moment = float(np.linalg.norm(rho)), float(np.linalg.norm(moment))
        self.history.append((self.rho, self.moment))
        self._judge()
        step = self._displacements(normals, points, middles, rho, most)
        if w.pair and w.turns:
            second = (len(self.history) // w.turns) % 2 == 1
            step[[0] if second else [1, 2]] = 0.0
        self.rates = step / PERIOD
        away = self.references + self._step - middles
        self._step = step
        away -= normals * np.sum(away * normals, axis=1)[:, None]
        far = np.linalg.norm(away, axis=1)[:, None]
        self.references = middles + away * np.minimum(1.0, w.leash / np.maximum(far, 1e-9))

    def _displacements(
        self, normals: Array, points: Array, middles: Array, rho: Array, most: float
    ) -> Array:
        """Down the gradients, by the kind of controller, shape (3, 3) [m]."""
        w = self.way
        if w.kind == "printed":
            return angles.displacements(normals, points, w.radius, w.alpha, "null", most=most)
        if w.kind == "curvature":
            for feeler, normal, middle in zip(self._feelers, normals, middles, strict=True):
                feeler.feel(normal, middle)
            shapes = [feeler.estimate() for feeler in self._feelers]
            return curvature.displacements(normals, points, shapes, w.radius, w.alpha, most)
        kind: residuals.Kind = (
            self._sequence.choose(rho) if w.kind == "sequential" else w.kind  # type: ignore
        )
        if w.pair:
            return virtual.displacements(
                normals, points, virtual.PAIR, w.radius, w.alpha, kind, w.variant, most
            )
        return residuals.displacements(normals, points, w.radius, w.alpha, kind, most)

    def _judge(self) -> None:
        largest = max(self.rho, self.moment)
        if self.converged and largest < self.way.left:
            self.settled += 1
            return
        self.updates, self.settled = len(self.history), 0
        self._good = self._good + 1 if largest < self.way.small else 0
        size = float(np.hypot(self.rho, self.moment))
        if size < self._least - self.way.progress:
            self._least, self._since = size, 0
        else:
            self._since += 1
