"""Hand_grasp: tare, close, slide the fingertips to a grasp (``arm/hand/grasp.py``)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from arm.hand.grasp import Grasp
from arm.hand.handling import Handling, Scene
from arm.hand.nodes.node import Step
from arm.hds import Event, NodeType, ParameterValue

NOTHING = "nothing there"
EVENTS = {
    "converged": "Grasped",
    NOTHING: "Nothing_there",
    "stuck": "Stuck",
    "a link struck the object": "Struck",
}
"""Events by how a try ends; any other end is ``Lost_touch``, a dead cell ``Dead_cell``."""


class HandGrasp:
    """One try of ``Grasp``; what failed is the program's to lead back from.

    Goal region: force and moment residuals small. Domain: the end of a reach, the platform at rest.
    """

    feels = True

    def __init__(self, values: Mapping[str, ParameterValue]) -> None:
        pass

    def enter(self, scene: Scene, hand: Handling) -> None:
        """A new try."""
        guess = hand.guess(scene.base)
        self._grasp = Grasp(hand.model, hand.plan, guess, hand.rng)
        hand.feel = self._grasp.feel

    def update(self, scene: Scene, hand: Handling) -> Step:
        """How the try ended, once it has."""
        grasp = self._grasp
        torque = grasp.step(scene.t, scene.at.q, scene.at.qd, scene.cells, scene.struck)
        if not grasp.outcome:
            history = grasp.slider.history if grasp.slider is not None else []
            residuals = np.array(history[-1]) if history else None
            return Step(stand=True, residuals=residuals, torque=torque)
        hand.tries.append(grasp.tries[-1])
        hand.take(scene.at)
        end = grasp.outcome
        dead = "Dead_cell" if end.startswith("load cell") else "Lost_touch"
        return Step(
            EVENTS.get(end, dead), "" if end == "converged" else end, stand=True, torque=torque
        )


TYPE = NodeType(
    "Hand_grasp",
    events=(
        Event("Grasped", "The fingertips have slid to a grasp."),
        Event("Nothing_there", "The fingers closed on nothing."),
        Event("Stuck", "The residuals have not fallen for 3 s."),
        Event("Struck", "A link or the palm touches something."),
        Event("Lost_touch", "A tip is off, too hard on, or out of its range."),
        Event("Dead_cell", "A load cell does not live."),
    ),
    doc="Close the fingers and slide their tips to a grasp, by touch.",
    make=HandGrasp,
)
