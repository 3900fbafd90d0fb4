"""What the nodes share that carry the box: the grip, by the load."""

from __future__ import annotations

from arm.grasping.hands import Hands, Move
from arm.grasping.nodes.node import load
from arm.grasping.scene import Scene
from arm.hds import Parameter

GRIP = Parameter("Grip", "N", 10.0, 60.0, 45.0, "Force a palm may press with for a heavy box.")
LEAST = 25.0
"""Force of a palm on a light box [N]."""
FRICTION = 0.4
"""Of palms on a box, counted on [1]."""
CARRIED = 0.95
"""Share of the measured load that is fed forward; all of it would float away [1]."""


def carried(hands: Hands) -> Move:
    """The move that carries what is gripped."""
    hands.preshape.firm = False
    return Move(
        hands.lifted, (hands.roll, hands.preshape, hands.posture), presses=True, carries=CARRIED
    )


class Grip:
    """Presses as hard as the load asks for.

    Args:
        most: force that a palm may press with [N].
    """

    def __init__(self, most: float) -> None:
        self.most = most

    def step(self, scene: Scene, hands: Hands) -> str:
        """Set the force; returns why the box is too heavy, empty if it is not."""
        weight = load(scene)
        asked = 0.5 * weight / FRICTION
        hands.force.goal = min(max(asked, LEAST), self.most)
        if asked <= self.most:
            return ""
        return f"it weighs more than {2 * FRICTION * self.most / 9.81:.1f} kg: {weight:.0f} N"
