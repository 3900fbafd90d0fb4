"""The control basis: objectives composed by subject-to.

What solves them (``priority``) and makes torques (``torque_law``) is imported from there: it brings
in scipy and the simulator's model, which who only declares node types does without.
"""

from arm.control.algebra import Composable, Composite, chain, parallelised
from arm.control.force import ContactObserver, Force, LowPass, Moment
from arm.control.joints import JointLimit, Posture, joint_limits
from arm.control.motion import Line, Orientation, Position
from arm.control.objective import Objective, Rows
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
    "chain",
    "joint_limits",
    "parallelised",
]
