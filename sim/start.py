"""Where a platform stands when a run begins."""

from __future__ import annotations

import math

import numpy as np
from scipy.spatial.transform import Rotation

from sim.scenario import World


def start_pose(world: World, rng: np.random.Generator) -> tuple[float, float, float]:
    """X_WB at t = 0: x, y [m], heading [rad]; drawn if the world says so."""
    drawn = [float(u) for u in rng.uniform(size=3)]
    if world.start is None:
        return world.platform_start
    at = world.box or world.table
    spans = (world.start.distance, world.start.bearing, world.start.heading)
    distance, bearing, off = (lo + u * (hi - lo) for u, (lo, hi) in zip(drawn, spans, strict=True))
    # in front of the box is -x of it
    away = Rotation.from_rotvec([0.0, 0.0, at.yaw + math.pi + bearing])
    x, y, _ = away.apply([distance, 0.0, 0.0]).tolist()
    heading = math.remainder(at.yaw + bearing + off, 2 * math.pi)
    return at.x + x, at.y + y, heading
