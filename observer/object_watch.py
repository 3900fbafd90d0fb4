"""Watches an object to be grasped: what a camera sees of it, and what palms feel."""

from __future__ import annotations

from deploy.robot import TwoArmRobot, load_robot, robot_kind
from observer.object_estimator import ObjectEstimator
from observer.palm_touch import PalmTouch
from services.messages import ArmState, Estimate, ObjectEstimate, Vision

EVERY = 4
"""Steps of the observer between steps of the watch."""


class ObjectWatch:
    """Box estimator and palms of a robot.

    Args:
        robot: name of a two-armed robot with a camera.

    Raises:
        BadFile, ValueError: it is none, or has none.
    """

    def __init__(self, robot: str) -> None:
        description = load_robot(robot, TwoArmRobot)
        if description.vision is None:
            raise ValueError(f"robot {robot!r} has no camera to see a box with")
        self._estimator = ObjectEstimator(description.vision)
        self._palms = PalmTouch(robot)
        self._sightings: list[Vision] = []
        self._steps = 0
        self._begun = False

    def step(
        self, estimate: Estimate, sightings: list[Vision], arms: ArmState | None
    ) -> ObjectEstimate | None:
        """One step of the observer; returns a message when one is due."""
        self._begun = self._begun or estimate.valid
        if not self._begun:  # a sighting says nothing without a place it was seen from
            return None
        self._sightings += sightings
        self._steps += 1
        if self._steps % EVERY:
            return None
        usable = arms is not None and arms.of(14, 2)
        touch = self._palms.feel(arms, estimate.pose) if arms is not None and usable else None
        seen, self._sightings = self._sightings, []
        return self._estimator.step(estimate, seen, touch)


def watch_of(robot: str, box: bool) -> ObjectWatch | None:
    """The watch of a robot whose task has a box; None otherwise."""
    return ObjectWatch(robot) if box and robot_kind(robot) == "two_arm" else None
