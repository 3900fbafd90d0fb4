"""Made-up node types and a good program around the fragment printed in the 1999 paper."""

import math

import pytest

from arm.hds import Event, NodeType, Parameter, Quantity, Registry, registry

PAPER = """\
BEGIN
    NAME = Approach1;
    TYPE = Whiteboard_approach;

    Force = 200; % Threshold when contact
    Filter = 4; % Select low-pass filter
    MaxX = 700; % Define out of reach
    Speed = 20; % Approach with 20mm/s

    TRANSITION[Contact] = Line1;
    TRANSITION[Out_of_Reach] = End;
END

BEGIN
    NAME = Line1;
    TYPE = Whiteboard_line;

    Length = 50;
    Direction = 225;
    Speed = 40;
    Force = 150;
    FGain = 0.00002;

    TRANSITION[Finished] = Retract1;
END
"""

HEADER = """\
INTERFACE = r1;
INITIAL   = Approach1;

"""

REST = """
BEGIN
    NAME = Retract1;
    TYPE = Goto_pose;
    Speed = 0.1 m/s;
    Mode = Soft;
    TRANSITION[Finished] = Choose1;
END

BEGIN
    NAME = Choose1;
    TYPE = Choose;
    TRANSITION[Again] = Approach1;
    TRANSITION[Done] = Rest1;
END

BEGIN
    NAME = Rest1;
    TYPE = Rest;
END
"""


@pytest.fixture(scope="session")
def types() -> Registry:
    """A handful of node types with every kind of parameter and event."""
    speed = Parameter("Speed", "mm/s", 0.001, 0.25, doc="speed of the tool")
    force = Parameter("Force", "cN", 0.2, 20.0)
    timeout = Parameter("Timeout", "s", 0.1, 600.0, default=math.inf)
    finished = Event("Finished")
    timed_out = Event("Timeout", needs="Timeout")
    return registry(
        NodeType(
            "Whiteboard_approach",
            (
                force,
                Parameter("Filter", lo=1, hi=64, default=8, kind="integer"),
                Parameter("MaxX", "mm", 0.0, 1.2),
                speed,
                timeout,
            ),
            (Event("Contact"), Event("Out_of_Reach"), timed_out),
        ),
        NodeType(
            "Whiteboard_line",
            (
                Parameter("Length", "mm", 0.001, 1.0),
                Parameter("Direction", "deg", -2 * math.pi, 2 * math.pi),
                speed,
                force,
                Parameter("FGain", "m/N/ms", 0.0, 1.0, default=0.02),
                timeout,
            ),
            (finished, timed_out),
        ),
        NodeType(
            "Goto_pose",
            (
                speed,
                Parameter("Mode", kind="word", choices=("Soft", "Stiff"), default="Stiff"),
                Parameter("Label", kind="word", default=""),
                Parameter("Torque", "N m", 0.0, 10.0, default=1.0),
            ),
            (finished,),
        ),
        NodeType("Choose", (), (Event("Again"), Event("Done")), takes_time=False),
        NodeType("Rest", terminal=True),
        quantities=(Quantity("Force", "N"), Quantity("Distance", "mm")),
    )


@pytest.fixture(scope="session")
def paper() -> str:
    """The fragment exactly as the paper prints it."""
    return PAPER


@pytest.fixture(scope="session")
def good() -> str:
    """A program without findings: header, the paper's fragment, and what it leads to."""
    return HEADER + PAPER + REST
