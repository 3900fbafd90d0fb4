"""Reads what the observer believes of the platform: where it is, and how sure it is of that.

First, in another terminal: steadyhand up whiteboard_moving
"""

import math

from services import connect

with connect() as robot:
    newest = robot.latest("observer/estimate")
    print(f"at {newest.t:.3f} s the estimate is", "valid" if newest.valid else newest.reason)

    # every estimate of the next second of robot time; there are 500
    estimates = []
    for estimate in robot.messages("observer/estimate"):
        estimates.append(estimate)
        if estimate.t > newest.t + 1.0:
            break

    for e in estimates[::100]:
        x, y, heading = e.pose
        sigma = 1e3 * math.sqrt(e.covariance[1, 1])
        print(f"{e.t:8.3f} s  x {1e3 * x:+7.1f} mm  y {1e3 * y:+7.1f} +- {sigma:.1f} mm  ", end="")
        print(f"heading {math.degrees(heading):+6.2f} deg  NIS {e.odometry_nis:5.2f}")
    print(f"{len(estimates)} estimates, {robot.lost.get('observer/estimate', 0)} missed")
