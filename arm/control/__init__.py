"""The control basis: objectives composed by subject-to, solved by priority, made into torques."""

from arm.control.force import ContactObserver, Force, LowPass
from arm.control.motion import Orientation, Position, Posture
from arm.control.objective import Composable, Composite, Objective, Rows
from arm.control.priority import solve

__all__ = [
    "Composable",
    "Composite",
    "ContactObserver",
    "Force",
    "LowPass",
    "Objective",
    "Orientation",
    "Position",
    "Posture",
    "Rows",
    "solve",
]
