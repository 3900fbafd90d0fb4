"""Takes the odometry away until the arm lets go, gives it back, and has the arm go on.

First, in another terminal: steadyhand up whiteboard_moving
"""

from services import connect

with connect() as robot:
    if robot.latest("arm/status").state not in ("idle", "finished"):
        robot.request("arm", "stop")
    robot.request("arm", "start")  # its task from the beginning, so that it lasts

    robot.disturb("dropout", sensor="odometry", duration=4)
    held = robot.wait_for("arm/status", lambda status: status.state == "safe_hold")
    print(f"{held.t:8.3f} s  the arm let go: {held.reason}")

    # the estimate says when it can be used again; the arm is told by a person, here by us
    good = robot.wait_for("observer/estimate", lambda e: e.valid and e.odometry_age < 0.1)
    print(f"{good.t:8.3f} s  the estimate is valid again, {1e3 * good.odometry_age:.0f} ms old")
    # it is drawn to where odometry has the platform now, and may be unsure again meanwhile
    robot.wait_for("observer/estimate", lambda e: e.valid and e.t > good.t + 1.0)
    robot.wait_for("arm/status", lambda status: status.t > good.t + 1.1)  # the arm knows, too
    robot.request("arm", "resume")
    back = robot.wait_for("arm/status", lambda status: status.state == "running")
    print(f"{back.t:8.3f} s  the arm goes on in node {back.node}")
