"""Pushes the platform and looks at how much of it the observer notices.

First, in another terminal: steadyhand up whiteboard_moving
"""

from services import connect
from services.script import Refused

with connect() as robot:
    before = robot.latest("observer/estimate")
    estimates = robot.messages("observer/estimate")  # all of them from now on
    print("accepted:", robot.disturb("push", force=200, direction=90, duration=0.2))

    fastest, acceleration, modes = 0.0, 0.0, set()
    for estimate in estimates:
        fastest = max(fastest, abs(estimate.velocity[1] - before.velocity[1]))
        acceleration = max(acceleration, abs(estimate.acceleration[1]))
        modes.add(estimate.mode)
        if estimate.t > before.t + 1.0:
            break
    print(f"sideways: {fastest:.3f} m/s faster or slower, up to {acceleration:.2f} m/s^2")
    print("the observer took the platform to be", " and ".join(sorted(modes)))

    # what makes no sense is refused, with what is allowed
    try:
        robot.disturb("push", force=1e6)
    except Refused as refused:
        print(str(refused).splitlines()[0])
