"""Builds a robot's DART skeleton from its description: one model for simulation, control, pictures.

Degrees of freedom, in order: platform x, y [m] and heading [rad] of B in O; six arm joints [rad];
pen spring [m].
"""

from __future__ import annotations

from typing import Any

import dartpy as dart
import numpy as np

from deploy.robot import Robot, load_robot, urdf_text

PLATFORM = slice(0, 3)
ARM = slice(3, 9)
PEN = 9
DOFS = 10


def load_skeleton(name: str) -> tuple[Robot, Any]:
    """Load a robot's description and its skeleton, with rotor inertia and pen spring added.

    DART has no armature parameter, so each reflected rotor inertia is added to its link about the
    joint axis (docs/decisions.md says what that costs).

    Raises:
        BadFile: no such robot, or a wrong entry in its description.
    """
    robot = load_robot(name)
    skeleton = dart.utils.DartLoader().parseSkeletonString(urdf_text(name), dart.common.Uri(""))
    skeleton.setGravity([0.0, 0.0, -9.81])
    for joint, rotor in zip(robot.arm.joints, robot.arm.rotor_inertia, strict=True):
        add_inertia(skeleton.getJoint(joint).getChildBodyNode(), np.diag([0.0, 0.0, rotor]))
    spring = skeleton.getJoint("pen_spring")
    spring.setSpringStiffness(0, robot.pen.stiffness)
    spring.setDampingCoefficient(0, robot.pen.damping)
    spring.setRestPosition(0, 0.0)
    return robot, skeleton


def add_inertia(body: Any, moment: np.ndarray, mass: float = 0.0) -> None:
    """Add a moment of inertia (3, 3) [kg m^2] and a mass [kg] at a body's centre of mass."""
    old = body.getInertia()
    body.setInertia(
        dart.dynamics.Inertia(old.getMass() + mass, old.getLocalCOM(), old.getMoment() + moment)
    )
