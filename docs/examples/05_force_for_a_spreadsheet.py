"""Writes a second of what the arm does to force.csv: reference, force, distance to the limits.

First, in another terminal: steadyhand up whiteboard_moving
"""

import csv

from services import connect
from services.topics import ARM_STATUS

with connect() as robot, open("force.csv", "w", newline="") as file:
    table = csv.writer(file)
    table.writerow(["t_s", "node", "force_n", "wanted_n", "reach_margin_m", "joint_margin_rad"])
    begin = robot.latest(ARM_STATUS).t
    for status in robot.messages(ARM_STATUS):  # a row of the table of topics: its type is known
        row = (status.force, status.force_reference, status.reach_margin, status.joint_margin)
        table.writerow([f"{status.t:.3f}", status.node, *(f"{value:.5f}" for value in row)])
        if status.t > begin + 1.0:
            break
print(f"force.csv is written, up to {status.t:.3f} s")
