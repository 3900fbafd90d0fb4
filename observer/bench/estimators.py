"""What is compared, as a table: name -> how it follows a world."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from observer.bench.exact import exact_observer, smooth_exact_observer
from observer.bench.play import Track, track
from observer.bench.smoother import smoothed
from observer.bench.world import World
from observer.filter_options import FilterOptions
from observer.observer import Observer, ObserverOptions, make_observer

Clock = Callable[[], float]


@dataclass(frozen=True)
class Estimator:
    """One of the estimators compared.

    Attributes:
        about: one line for people.
        make: an observer that knows of the world what it is told; None: it works offline.
        detects: whether it can report slip.
    """

    about: str
    make: Callable[[World], Observer] | None
    detects: bool = False

    def follow(self, world: World, clock: Clock | None = None) -> Track:
        """What it says of a world.

        Args:
            world: to be followed.
            clock: [s], measures the cost of every step.
        """
        return smoothed(world) if self.make is None else track(self.make(world), world, clock)


def _taylor(order: int) -> Estimator:
    return Estimator(
        f"polynomial of degree {order} through odometry",
        lambda world: make_observer("taylor", world.robot, order=order),
    )


SINGLE = ObserverOptions(filter=FilterOptions(modes="single"))

ESTIMATORS: dict[str, Estimator] = {
    "ekf": Estimator(
        "the product, output stage included", lambda w: make_observer("ekf", w.robot), True
    ),
    "hold": Estimator("the newest odometry", lambda w: make_observer("hold", w.robot)),
    "taylor1": _taylor(1),
    "taylor2": _taylor(2),
    "taylor3": _taylor(3),
    "undelayed": Estimator(
        "ekf, measurements taken as fresh", lambda w: make_observer("undelayed", w.robot), True
    ),
    "single": Estimator(
        "ekf without modes", lambda w: make_observer("ekf", w.robot, options=SINGLE), True
    ),
    "imm": Estimator("ekf, all modes at once", lambda w: make_observer("imm", w.robot), True),
    "exact": Estimator(
        "Kalman filter that knows the world's parameters",
        exact_observer,
    ),
    "exact_smooth": Estimator("exact, through the output stage", smooth_exact_observer),
    "smoother": Estimator("exact, half a second later, offline", None),
}
REFERENCE = "exact"
"""The estimator that ratios refer to."""
