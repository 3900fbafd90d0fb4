"""Made-up node types with every kind of parameter, event and quantity."""

import math

from arm.hds import Event, NodeType, Parameter, Quantity, registry

_SPEED = Parameter("Speed", "mm/s", 0.001, 0.25, doc="speed of the tool")
_FORCE = Parameter("Force", "cN", 0.2, 20.0)
_TIMEOUT = Parameter("Timeout", "s", 0.1, 600.0, default=math.inf)
_FINISHED = Event("Finished")
_TIMED_OUT = Event("Timeout", needs="Timeout")
TYPES = registry(
    NodeType(
        "Whiteboard_approach",
        (
            _FORCE,
            Parameter("Filter", lo=1, hi=64, default=8, kind="integer"),
            Parameter("MaxX", "mm", 0.0, 1.2),
            _SPEED,
            _TIMEOUT,
        ),
        (Event("Contact"), Event("Out_of_Reach"), _TIMED_OUT),
    ),
    NodeType(
        "Whiteboard_line",
        (
            Parameter("Length", "mm", 0.001, 1.0),
            Parameter("Direction", "deg", -2 * math.pi, 2 * math.pi),
            _SPEED,
            _FORCE,
            Parameter("FGain", "m/N/ms", 0.0, 1.0, default=0.02),
            _TIMEOUT,
        ),
        (_FINISHED, _TIMED_OUT),
    ),
    NodeType(
        "Goto_pose",
        (
            _SPEED,
            Parameter("Mode", kind="word", choices=("Soft", "Stiff"), default="Stiff"),
            Parameter("Label", kind="word", default=""),
            Parameter("Torque", "N m", 0.0, 10.0, default=1.0),
        ),
        (_FINISHED,),
    ),
    NodeType("Choose", (), (Event("Again"), Event("Done")), takes_time=False),
    NodeType("Rest", terminal=True),
    quantities=(Quantity("Force", "N"), Quantity("Distance", "mm")),
)
