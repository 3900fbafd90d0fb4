"""What the exact filter knows: everything about the world that is not drawn afresh each instant."""

from __future__ import annotations

import math
from dataclasses import replace

from observer.bench.world import DT, World
from observer.ekf_observer import EkfObserver
from observer.filter_options import FilterOptions
from observer.observer_options import ObserverOptions
from observer.output import OutputOptions

NEVER = 1e12


def exact_observer(world: World) -> EkfObserver:
    """The exact filter on line."""
    return EkfObserver(world.truth, exact_options(world))


def smooth_exact_observer(world: World) -> EkfObserver:
    """The same through the product's output stage: what a limit on steps costs whoever obeys it."""
    return EkfObserver(world.truth, replace(exact_options(world), output=OutputOptions()))


def exact_options(world: World) -> ObserverOptions:
    """Assumptions of a Kalman filter whose model is the world.

    The true lag, noise, scale and mounting come with ``world.truth``. Odometry is taken as
    R = q^2 / 12, so this is the best *linear* estimator of position in motion: in pushes and at
    standstill, of which it knows nothing, it can be beaten, and the interval update beats it in
    heading. No output stage, no gate, no mode, no budget of replay.
    """
    tilt = math.hypot(*world.conditions.tilt) / math.sqrt(2.0)
    return ObserverOptions(
        disturbance_factor=1.0,
        imu_noise_factor=1.0,
        command_latency=DT,
        output=None,
        reported_floor=0.0,
        filter=FilterOptions(
            odometry_update="gaussian",
            modes="single",
            odometry_gate=NEVER,
            imu_gate=NEVER,
            alert_nis=NEVER,
            floor_tilt=max(tilt, 1e-6),
            replay=10**9,
        ),
    )
