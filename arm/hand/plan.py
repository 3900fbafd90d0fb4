"""Plans of grasps: which controller slides, what presses, what is tried again."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from arm.hand.sliding import Way


@dataclass(frozen=True)
class Plan:
    """How to grasp.

    Attributes:
        way: controller of the sliding.
        press: force of each finger while sliding [N].
        grip: force of a squeeze, of finger 0 of a pair, of each of three [N].
        spread: of fingers 1 and 2 at the start and where there is freedom [rad].
        flexion: the same of the flexions [rad].
        friction: expected while sliding [1].
        tries: reaches, the first included.
        again: tilt of the palm from the axis in further tries, from, to [rad].
        level: further tries turn the hand so that finger 0 and the pair are level, within 0.4 rad.
        settle: time of sliding after convergence [s].
        lift: height to lift to, 0: stop when converged [m].
        hardest: force of a tip that ends a try [N].
        stiff: bandwidth of arm and fingers while an object is held [rad/s].
    """

    way: Way = field(default_factory=Way)
    press: tuple[float, float, float] = (1.5, 1.5, 1.5)
    grip: float = 40.0
    spread: float = 1.05
    flexion: float = 0.95
    friction: float = 0.3
    tries: int = 3
    again: tuple[float, float] = (0.0, 0.5)
    level: bool = False
    settle: float = 0.6
    lift: float = 0.0
    hardest: float = 25.0
    stiff: tuple[float, float] = (100.0, 120.0)


THREE = Plan()
"""Three contacts."""
PAIR = Plan(way=Way(pair=True), press=(2.0, 1.0, 1.0), spread=0.3)
"""Finger 0 against the virtual contact of 1 and 2."""


FROM_THE_SIDE = replace(PAIR, again=(0.8, 1.3), level=True, spread=0.1)
"""The pair on an object with a neck, where the palm has no room above."""


TURNS = 8
"""Updates that a finger, or the pair, slides on a free object while what opposes it rests."""


def gently(plan: Plan, lift: float) -> Plan:
    """The plan for an object that stands free: press less and slide in turns, so that it stays.

    Args:
        plan: for one that is fixed.
        lift: height to lift it to [m].
    """
    if not plan.way.pair:
        return replace(plan, press=(1.0, 1.0, 1.0), lift=lift)
    way = replace(plan.way, turns=TURNS)
    return replace(plan, way=way, press=(4 / 3, 2 / 3, 2 / 3), lift=lift)
