"""Worlds by seed, for campaigns: clutter, a person who crosses, a doorway, a corridor."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from sim.gridplan import Grid
from sim.obstacle_specs import Box, Mover, Obstacle, Pillar, Wall
from sim.obstacles import Obstacles

Pose3 = tuple[float, float, float]

PASSAGE = 1.2
"""There is always a path at least this wide, in widths of the platform."""
ROOM = ((0.0, -2.5), (8.0, 2.5))
"""Corners of the room [m]."""
MARGIN = 0.25
"""From the edge of a platform at start or goal to the nearest obstacle, at least [m]."""


@dataclass(frozen=True)
class BenchWorld:
    """A world with a task for the platform.

    Attributes:
        obstacles: as in a scenario's ``[[world.obstacle]]``.
        start: X_WB at first [m, m, rad].
        goal: X_WB to reach [m, m, rad].
        shortest: length of the shortest way that the platform does not collide on [m], movers
            apart.
    """

    obstacles: tuple[Obstacle, ...]
    start: Pose3
    goal: Pose3
    shortest: float


def clutter(seed: int, radius: float = 0.31) -> BenchWorld:
    """A room with pillars and boxes between start and goal.

    There is a path at least ``PASSAGE`` times as wide as the platform.

    Args:
        seed: equal seeds give equal worlds.
        radius: of the platform's circle [m].
    """
    rng = np.random.default_rng([seed, 1])
    start = (0.8, _digits(rng.uniform(-1.6, 1.6)), _digits(rng.uniform(-math.pi, math.pi)))
    goal = (7.2, _digits(rng.uniform(-1.6, 1.6)), _digits(rng.uniform(-math.pi, math.pi)))
    a, b = np.array(start[:2]), np.array(goal[:2])
    placed: list[Obstacle] = list(_room())
    grid = Grid(*ROOM)
    grid.add(Obstacles(placed).at(0.0))
    target = len(placed) + int(rng.integers(8, 17))
    for _ in range(60):
        if len(placed) >= target:
            break
        candidate = _thing(rng)
        shape = Obstacles([candidate]).at(0.0)
        if shape.distance(np.array([a, b])).min() < radius + MARGIN:
            continue
        if grid.passable(shape, a, b, PASSAGE * radius):
            placed.append(candidate)
            grid.add(shape)
    return BenchWorld(tuple(placed), start, goal, grid.shortest(a, b, radius))


def crossing(seed: int, radius: float = 0.31, cruise: float = 0.5) -> BenchWorld:
    """A person walks across the platform's way, at 0.3 to 1 m/s, and would hit it.

    Args:
        seed: equal seeds give equal worlds.
        radius: of the platform's circle [m].
        cruise: speed at which a platform that saw nobody would drive [m/s].
    """
    rng = np.random.default_rng([seed, 2])
    start = (0.8, _digits(rng.uniform(-0.5, 0.5)), 0.0)
    goal = (7.2, _digits(rng.uniform(-0.5, 0.5)), 0.0)
    a, b = np.array(start[:2]), np.array(goal[:2])
    way = float(np.linalg.norm(b - a))
    at = rng.uniform(0.3, 0.65) * way
    speed = _digits(rng.uniform(0.3, 1.0))
    meeting = a + at / way * (b - a)
    when = at / cruise + 0.2 + rng.uniform(-0.4, 0.4)
    side = rng.choice([-1.0, 1.0])
    angle = side * rng.uniform(math.radians(60), math.radians(120))
    heading = np.array([math.cos(angle), math.sin(angle)])
    # from near one wall to near the other; a slow one has not that far to come
    before = min((2.1 + side * meeting[1]) / abs(heading[1]), speed * when)
    after = (2.1 - side * meeting[1]) / abs(heading[1])
    comes, goes = meeting - before * heading, meeting + after * heading
    person = Mover(
        points=(_point(comes), _point(goes)),
        speed=speed,
        start_at=_digits(max(when - before / speed, 0.0)),
    )
    return BenchWorld((*_room(), person), start, goal, way)


def doorway(seed: int, radius: float = 0.31) -> BenchWorld:
    """Two rooms and a door between them, 1.25 to 1.6 times as wide as the platform.

    Args:
        seed: equal seeds give equal worlds.
        radius: of the platform's circle [m].
    """
    rng = np.random.default_rng([seed, 3])
    start = (0.8, _digits(rng.uniform(-1.6, 1.6)), _digits(rng.uniform(-math.pi, math.pi)))
    goal = (7.2, _digits(rng.uniform(-1.6, 1.6)), _digits(rng.uniform(-math.pi, math.pi)))
    door = rng.uniform(-1.5, 1.5)
    half = radius * rng.uniform(1.25, 1.6)
    x, thickness = _digits(rng.uniform(3.0, 5.0)), _digits(rng.uniform(0.08, 0.25))
    walls = [
        Wall(start=(x, -2.5), end=(x, _digits(door - half)), thickness=thickness),
        Wall(start=(x, _digits(door + half)), end=(x, 2.5), thickness=thickness),
    ]
    return _measured((*_room(), *walls), start, goal, radius, *ROOM)


def corridor(seed: int, radius: float = 0.31) -> BenchWorld:
    """A corridor with a right-angled bend, 1.4 to 2.2 times as wide as the platform.

    Args:
        seed: equal seeds give equal worlds.
        radius: of the platform's circle [m].
    """
    rng = np.random.default_rng([seed, 4])
    half = _digits(radius * rng.uniform(1.4, 2.2))
    long, short = _digits(rng.uniform(3.0, 5.0)), _digits(rng.uniform(2.5, 3.5))
    left = float(rng.choice([-1.0, 1.0]))
    t = 0.1  # thickness: the middle lines stand half of it outside
    inner, outer = long - half - t / 2, long + half + t / 2
    side, back, end = left * (half + t / 2), -1.0, left * (short + 1.0)
    lines = [
        ((back, -side), (outer, -side)),
        ((outer, -side), (outer, end)),
        ((back, side), (inner, side)),
        ((inner, side), (inner, end)),
        ((back, -side), (back, side)),
        ((inner, end), (outer, end)),
    ]
    walls = tuple(Wall(start=_point(p), end=_point(q), thickness=t) for p, q in lines)
    goal = (long, left * short, left * math.pi / 2)
    low, high = (back, min(-side, end, side)), (outer, max(-side, end, side))
    return _measured(walls, (0.0, 0.0, 0.0), goal, radius, low, high)


KINDS: dict[str, Callable[[int], BenchWorld]] = {
    "clutter": clutter,
    "crossing": crossing,
    "doorway": doorway,
    "corridor": corridor,
}
"""Every kind of world by its name: a function of the seed."""


def _measured(
    obstacles: tuple[Obstacle, ...],
    start: Pose3,
    goal: Pose3,
    radius: float,
    low: tuple[float, float],
    high: tuple[float, float],
) -> BenchWorld:
    grid = Grid(low, high)
    grid.add(Obstacles(obstacles).at(0.0))
    shortest = grid.shortest(np.array(start[:2]), np.array(goal[:2]), radius)
    return BenchWorld(obstacles, start, goal, shortest)


def _room() -> tuple[Wall, ...]:
    (x0, y0), (x1, y1) = ROOM
    corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0)]
    return tuple(Wall(start=p, end=q) for p, q in pairwise(corners))


def _thing(rng: np.random.Generator) -> Obstacle:
    x, y = _digits(rng.uniform(1.2, 6.8)), _digits(rng.uniform(-2.4, 2.4))
    if rng.random() < 0.5:
        return Pillar(x=x, y=y, radius=_digits(rng.uniform(0.05, 0.3)))
    length, width = _digits(rng.uniform(0.2, 1.0)), _digits(rng.uniform(0.2, 0.6))
    return Box(x=x, y=y, yaw=_digits(rng.uniform(0.0, math.pi)), length=length, width=width)


def _digits(value: float) -> float:
    """To the millimetre, so that a world can be written into a scenario as it is."""
    return round(float(value), 3)


def _point(p: np.ndarray | tuple[float, float]) -> tuple[float, float]:
    return _digits(p[0]), _digits(p[1])
