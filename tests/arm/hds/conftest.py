"""Made-up node types and a good program around the fragment printed in the 1999 paper."""

import pytest

from arm.hds import Registry
from tests.arm.hds.made_up import TYPES

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
    return TYPES


@pytest.fixture(scope="session")
def paper() -> str:
    """The fragment exactly as the paper prints it."""
    return PAPER


@pytest.fixture(scope="session")
def good() -> str:
    """A program without findings: header, the paper's fragment, and what it leads to."""
    return HEADER + PAPER + REST
