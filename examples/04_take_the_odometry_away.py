"""Takes the odometry away until the arm lets go, gives it back, and has the arm go on.

First, in another terminal: steadyhand up whiteboard_moving
"""

from services import connect
from services.script import Refused, Silent

with connect() as robot:
    if robot.latest("arm/status").state in ("idle", "finished"):
        robot.request("arm", "start")

    robot.disturb("dropout", sensor="odometry", duration=4)
    try:
        held = robot.wait_for("arm/status", lambda status: status.state == "safe_hold")
        print(f"{held.t:8.3f} s  the arm let go: {held.reason}")
    except Silent:
        print("the arm went on: the gyro and the accelerometer were enough")

    # the estimate says when it can be used again; the arm is told by a person, here by us
    good = robot.wait_for("observer/estimate", lambda e: e.valid and e.odometry_age < 0.1)
    print(f"{good.t:8.3f} s  the estimate is valid again, after {good.odometry_age * 1e3:.0f} ms")
    try:
        robot.request("arm", "resume")
        back = robot.wait_for("arm/status", lambda status: status.state == "running")
        print(f"{back.t:8.3f} s  the arm draws on, in node {back.node}")
    except Refused as refused:
        print(refused)
