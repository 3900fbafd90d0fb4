"""The control basis: objectives composed by subject-to, solved by priority, made into torques."""

from arm.control.algebra import Composable, Composite, chain, parallelised
from arm.control.force import ContactObserver, Force, LowPass, Moment
from arm.control.joints import JointLimit, Posture, joint_limits
from arm.control.motion import Line, Orientation, Position
from arm.control.objective import Objective, Rows
from arm.control.priority import Solution, priorities, projector, solve
from arm.control.singularity import Singularity

__all__ = [
    "Composable",
    "Composite",
    "ContactObserver",
    "Force",
    "JointLimit",
    "Line",
    "LowPass",
    "Moment",
    "Objective",
    "Orientation",
    "Position",
    "Posture",
    "Rows",
    "Singularity",
    "Solution",
    "chain",
    "joint_limits",
    "parallelised",
    "priorities",
    "projector",
    "solve",
]
