"""The obstacles of a world at any instant."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from sim.obstacle_specs import Box, Mover, Obstacle, Pillar, Wall
from sim.shapes import NOTHING, Shapes

Array = NDArray[np.float64]


class Obstacles:
    """What stands around, and what moves.

    Args:
        specs: as in a scenario's ``[[world.obstacle]]``.

    Attributes:
        fastest: speed of the fastest mover [m/s].
    """

    def __init__(self, specs: Iterable[Obstacle] = ()) -> None:
        self._specs = tuple(specs)
        boxes = [s.box() if isinstance(s, Wall) else s for s in self._specs]
        self._boxes = np.array(
            [(b.x, b.y, b.yaw, b.length / 2, b.width / 2) for b in boxes if isinstance(b, Box)]
        )
        self._pillars = [(p.x, p.y, p.radius) for p in self._specs if isinstance(p, Pillar)]
        self._walks = [_Walk(s) for s in self._specs if isinstance(s, Mover)]
        self.fastest = max((w.speed for w in self._walks), default=0.0)
        self._now = 0.0
        self._shapes = self._made(0.0)

    def __len__(self) -> int:
        return len(self._specs)

    def at(self, t: float) -> Shapes:
        """Their shapes in W at robot time ``t`` [s]: boxes and walls, pillars, movers.

        The movers among them go on when this is called again.
        """
        if self._walks and t != self._now:
            self._now = t
            # the boxes have not moved: only the movers' middles are written anew
            count = len(self._walks)
            self._shapes.circles = self._shapes.circles.copy()
            self._shapes.circles[-count:, :2] = [w.at(t)[0] for w in self._walks]
        return self._shapes

    def velocities(self, t: float) -> Array:
        """Of each shape of ``at(t)``, in its order, (n, 2) [m/s]."""
        out = np.zeros((len(self._shapes), 2))
        for row, walk in enumerate(reversed(self._walks)):
            out[-1 - row] = walk.at(t)[1]
        return out

    def higher_than(self, height: float) -> Obstacles:
        """Those that a line of sight at ``height`` [m] cannot pass over."""
        return Obstacles(s for s in self._specs if s.height > height)

    def clearance(self, t: float, pose: Array | Sequence[float], radius: float) -> float:
        """From the edge of a circle to the nearest obstacle [m], negative where they overlap.

        Args:
            t: robot time [s].
            pose: of the circle's middle in W, of which x, y count [m].
            radius: of the circle [m].
        """
        if not self._specs:
            return NOTHING
        return float(self.at(t).nearest(np.array(pose[:2]))[0].min()) - radius

    def _made(self, t: float) -> Shapes:
        movers = [(*w.at(t)[0], w.radius) for w in self._walks]
        return Shapes(self._boxes, np.array(self._pillars + movers))


class _Walk:
    """A mover's position as a function of time."""

    def __init__(self, spec: Mover) -> None:
        self.radius, self.speed = spec.radius, spec.speed
        self._start, self._loop = spec.start_at, spec.loop
        self._points = np.array(spec.points + (spec.points[:1] if spec.loop else ()))
        legs = np.diff(self._points, axis=0)
        lengths = np.hypot(legs[:, 0], legs[:, 1])
        self._directions = legs / lengths[:, None]
        self._passed = np.concatenate([[0.0], np.cumsum(lengths)])

    def at(self, t: float) -> tuple[Array, Array]:
        """Position (2,) [m] and velocity (2,) [m/s] at robot time ``t`` [s]."""
        gone = (t - self._start) * self.speed
        total = self._passed[-1]
        if gone <= 0.0:
            return self._points[0], np.zeros(2)
        if self._loop:
            gone %= total
        elif gone >= total:
            return self._points[-1], np.zeros(2)
        leg = min(
            int(np.searchsorted(self._passed, gone, side="right")) - 1, len(self._directions) - 1
        )
        direction = self._directions[leg]
        return self._points[leg] + (gone - self._passed[leg]) * direction, self.speed * direction
