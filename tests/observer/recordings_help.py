"""Recordings for tests of the logs: from the planar world, and from formulas."""

from __future__ import annotations

import numpy as np

from observer.bench.world import World
from observer.recordings.recording import Recording, Samples
from services.messages import BaseCommand, Imu, Odometry


def recorded(world: World, name: str = "world") -> Recording:
    """What a logger would have written down in a world, truth as the reference."""
    found: dict[type, list] = {Odometry: [], Imu: [], BaseCommand: []}
    for arrival, message in world.arrivals:
        if type(message) in found:
            found[type(message)].append((arrival, message))

    def samples(kind: type, values) -> Samples:
        ordered = sorted(found[kind], key=lambda pair: pair[1].t)
        t = np.array([m.t for _, m in ordered])
        arrival = np.array([a for a, _ in ordered])
        return Samples(t, np.maximum(arrival, t), np.array([values(m) for _, m in ordered]))

    odometry = samples(Odometry, lambda m: m.pose)
    odometry.values[:, 2] = np.unwrap(odometry.values[:, 2])
    return Recording(
        name=name,
        base=world.robot,
        odometry=odometry,
        imu=samples(Imu, lambda m: [*m.gyro, *m.accel]),
        commands=samples(BaseCommand, lambda m: m.velocity),
        reference=Samples(world.t[::10], world.t[::10], world.pose[::10]),
    )
