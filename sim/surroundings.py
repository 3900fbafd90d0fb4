"""What the platform has around it: obstacles, how they push back, and the sensors that see them.

Obstacles are geometry alone, not bodies of the DART world: exact circles instead of meshes, no
contact to attribute, and nothing to pay for where there are none. The arm passes through them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from deploy.robot import Robot
from services.messages import Message
from sim.bumpers import BumperSensor
from sim.effects import Effects
from sim.laser import LaserSensor
from sim.obstacles import Obstacles
from sim.scenario import Scenario
from sim.vision import VisionSensor

Array = NDArray[np.float64]

STIFFNESS = 5e5
"""Of the rubber around the platform [N/m]; its damping is critical."""
QUICKEST = 2.5
"""No platform comes nearer to something that stands faster than this [m/s]."""


class Surroundings:
    """Obstacles and the sensors that notice them.

    Args:
        robot: description, already overlaid with the scenario's sensors.
        scenario: world and sensors.
        noise_factor: on the stated noise of the sensors.
        streams: sources of randomness of laser, bumpers and camera.
    """

    def __init__(
        self,
        robot: Robot,
        scenario: Scenario,
        noise_factor: float,
        streams: Sequence[np.random.Generator],
    ) -> None:
        world, sensors = scenario.world, scenario.sensors
        self._obstacles = Obstacles(world.obstacle)
        self._radius = robot.chassis.radius
        self._look_again = self._due = -math.inf
        self._sensors: list[LaserSensor | BumperSensor | VisionSensor] = []
        if robot.laser is not None and sensors.laser.enabled:
            self._sensors.append(
                LaserSensor(
                    robot.laser, self._obstacles, sensors.laser.dropout, noise_factor, streams[0]
                )
            )
        if robot.bumper is not None and sensors.bumper.enabled:
            self._sensors.append(
                BumperSensor(
                    robot.bumper,
                    self._radius,
                    self._obstacles,
                    sensors.bumper.dropout,
                    streams[1],
                )
            )
        if robot.vision is not None and sensors.vision.enabled:
            self._sensors.append(
                VisionSensor(
                    robot.vision,
                    world.board.rotation(),
                    world.board.position(),
                    world.board.markers,
                    self._obstacles,
                    sensors.vision.dropout,
                    noise_factor,
                    streams[2],
                )
            )

    def step(self, now: float, pose: Array, effects: Effects) -> list[Message]:
        """Messages arriving at ``now`` [s]; ``pose`` is X_WB as (x, y, heading)."""
        if now + 1e-9 < self._due:
            return []
        out: list[Message] = [m for s in self._sensors for m in s.step(now, pose, effects)]
        self._due = min((s.channel.due for s in self._sensors), default=math.inf)
        return out

    def clearance(self, now: float, pose: Array) -> float:
        """From the platform's edge to the nearest obstacle [m], negative where they overlap."""
        return self._obstacles.clearance(now, pose, self._radius)

    def push(self, now: float, mass: float, pose: Array, velocity: Array) -> Array | None:
        """Force of what is touched on the platform in B, (3,) [N, N, N m]; None without contact.

        Args:
            now: robot time [s].
            mass: of what is pushed [kg].
            pose: X_WB, (3,).
            velocity: V_WB_W, (3,).
        """
        if now < self._look_again or not len(self._obstacles):
            return None
        distance, toward = self._obstacles.at(now).nearest(pose[:2])
        gaps = distance - self._radius
        smallest = float(gaps.min())
        if smallest > 0.0:
            # nothing is touched any sooner, so there is no need to look
            self._look_again = now + smallest / (QUICKEST + self._obstacles.fastest)
            return None
        damping = 2.0 * math.sqrt(STIFFNESS * mass)
        closing = np.sum((velocity[:2] - self._obstacles.velocities(now)) * toward, axis=1)
        force = np.maximum(-STIFFNESS * gaps + damping * closing, 0.0)
        fx, fy = (-np.where(gaps < 0.0, force, 0.0) @ toward).tolist()
        c, s = math.cos(pose[2]), math.sin(pose[2])
        return np.array([c * fx + s * fy, -s * fx + c * fy, 0.0])
