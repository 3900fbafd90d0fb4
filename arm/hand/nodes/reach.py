"""Hand_reach: bring the open hand from above to where the fingers can close."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from arm.hand.handling import Handling, Scene
from arm.hand.model import ARM
from arm.hand.nodes.node import Step
from arm.hand.reaching import Path, look, opened, solve
from arm.hds import Event, NodeType, Parameter, ParameterValue

Array = NDArray[np.float64]

ABOVE = 0.12
"""From where the fingers close to where the hand comes from, along its own axis [m]."""
DRAWS = 60
FAR = 1.8
"""Joints do not go further than this to a place above the bottle [rad]."""
SETTLE = 0.3
"""Time to come to rest at the end [s]."""


class HandReach:
    """Draws a palm that looks at the bottle from ``Tilt`` off its axis, and goes there.

    One place is tried a tick. Goal region: the end of the way. Domain: the platform stands before
    the bottle, the hand above the table.
    """

    feels = False

    def __init__(self, values: Mapping[str, ParameterValue]) -> None:
        self._tilt = (float(values["From"]), float(values["To"]))

    def enter(self, scene: Scene, hand: Handling) -> None:
        """Start to look for a way."""
        hand.take(scene.at)
        hand.squeeze = 0.0
        self._ways = self._search(scene.at.q.copy(), hand, scene)
        self._path: Path | None = None

    def update(self, scene: Scene, hand: Handling) -> Step:
        """Reached, or No_way."""
        if self._path is None:
            try:
                self._path = next(self._ways)
            except StopIteration:
                return Step("No_way", "no way for the arm to the bottle")
            self._since = scene.t
            return Step(stand=True)
        took = scene.t - self._since
        hand.reference, hand.rate = self._path.at(took)
        event = "Reached" if took > self._path.duration + SETTLE else None
        return Step(event, stand=True)

    def _search(self, q: Array, hand: Handling, scene: Scene) -> Iterator[Path | None]:
        model, rng, plan = hand.model, hand.rng, hand.plan
        guess = hand.guess(scene.base)
        wide = model.robot.hand.open
        for _ in range(DRAWS):
            R, p = look(
                guess, *rng.uniform([self._tilt[0], -1.2, -np.pi], [self._tilt[1], 1.2, np.pi])
            )
            there = solve(model, R, p, rng)
            if there is None:
                yield None
                continue
            above = solve(model, R, p - ABOVE * R[:, 2], rng, near=there)
            if above is None or np.abs(above - there).max() > 1.0:
                yield None
                continue
            if np.abs(above - q[ARM])[:6].max() > FAR:
                yield None
                continue
            start = opened(q[ARM], plan.spread, wide)
            yield Path(
                [q, start, opened(above, plan.spread, wide), opened(there, plan.spread, wide)]
            )
            return


TYPE = NodeType(
    "Hand_reach",
    parameters=(
        Parameter("From", "rad", 0.0, 1.5, 0.0, "Least tilt of the palm from the bottle's axis."),
        Parameter("To", "rad", 0.0, 1.5, 0.4, "Largest tilt."),
    ),
    events=(
        Event("Reached", "The open hand is around the bottle."),
        Event("No_way", "The arm finds no way there."),
    ),
    doc="Bring the open hand from above to where the fingers can close.",
    make=HandReach,
)
