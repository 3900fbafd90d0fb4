"""Runs a program of its own on the arm, and tells what happens as it happens.

First, in another terminal: steadyhand up whiteboard_moving
"""

import tempfile
from pathlib import Path

from services import connect

PROGRAM = """
INTERFACE = r1;
INITIAL   = Above;

BEGIN
    NAME = Above;
    TYPE = Goto_pose;
    X = -20 mm;
    Y = 20 mm;
    Z = 15 mm;
    Speed = 150 mm/s;
    TRANSITION[Finished] = Touch;
END

BEGIN
    NAME = Touch;
    TYPE = Whiteboard_approach;
    Force = 200;
    Filter = 4;
    MaxX = 850;
    Speed = 30;
    TRANSITION[Contact] = Stroke;
    TRANSITION[Out_of_Reach] = End;
END

BEGIN
    NAME = Stroke;
    TYPE = Whiteboard_line;
    Length = 40;
    Direction = 0;
    Speed = 60;
    Force = 150;
    FGain = 0.00002;
    TRANSITION[Finished] = Away;
END

BEGIN
    NAME = Away;
    TYPE = Retract;
    Distance = 20 mm;
    Speed = 100 mm/s;
    TRANSITION[Finished] = End;
END
"""

with tempfile.TemporaryDirectory() as folder, connect() as robot:
    file = Path(folder) / "stroke.hds"
    file.write_text(PROGRAM)

    if robot.latest("arm/status").state not in ("idle", "finished"):
        robot.request("arm", "stop")  # whatever it was drawing
    robot.request("arm", "start", program=str(file))

    for event in robot.events():
        print(f"{event.t:8.3f} s  {event.service:9}{event.name:14}{event.detail}")
        if (event.service, event.name) == ("arm", "finished"):
            break
