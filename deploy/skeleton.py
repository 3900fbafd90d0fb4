"""Builds a robot's DART skeleton from its description: one model for simulation, control, pictures.

Degrees of freedom, in order: platform x, y [m] and heading [rad] of B in O; then, of a one-armed
robot, six or seven arm joints [rad] and the pen spring [m]; of a two-armed one, seven joints of the
left arm and seven of the right one [rad]; of one with a hand, seven arm joints and eight of the
hand, which ``hand_coupling`` gives from the eleven that are driven.
"""

from __future__ import annotations

from typing import Any

import dartpy as dart
import numpy as np

from deploy.robot import HandRobot, Robot, TwoArmRobot, load_robot, urdf_text

PLATFORM = slice(0, 3)
ARM = slice(3, -1)
"""The arm of a one-armed robot, however many joints it has."""
PEN = -1

LEFT, RIGHT = slice(3, 10), slice(10, 17)
BOTH = slice(3, 17)
"""Both arms of a two-armed robot, left then right."""
TWO_ARM_DOFS = 17


def load_skeleton(name: str) -> tuple[Robot, Any]:
    """Load a robot's description and its skeleton, with rotor inertia and pen spring added.

    DART has no armature parameter, so each reflected rotor inertia is added to its link about the
    joint axis (docs/decisions.md says what that costs).

    Raises:
        BadFile: no such robot, or a wrong entry in its description.
    """
    robot = load_robot(name)
    skeleton = _parse(name)
    for joint, rotor in zip(robot.arm.joints, robot.arm.rotor_inertia, strict=True):
        add_inertia(skeleton.getJoint(joint).getChildBodyNode(), np.diag([0.0, 0.0, rotor]))
    spring = skeleton.getJoint("pen_spring")
    spring.setSpringStiffness(0, robot.pen.stiffness)
    spring.setDampingCoefficient(0, robot.pen.damping)
    spring.setRestPosition(0, 0.0)
    return robot, skeleton


def load_two_arm_skeleton(name: str) -> tuple[TwoArmRobot, Any]:
    """Load a two-armed robot's description and its skeleton, with rotor inertia added.

    Raises:
        BadFile: no such robot, another kind of robot, or a wrong entry in its description.
    """
    robot = load_robot(name, TwoArmRobot)
    skeleton = _parse(name)
    for joint, rotor in zip(robot.arms.joints, robot.arms.rotor_inertia * 2, strict=True):
        moved = skeleton.getJoint(joint)
        # link frames are parallel to their joint's frame
        axis = np.asarray(moved.getAxis()).reshape(3)
        add_inertia(moved.getChildBodyNode(), rotor * np.outer(axis, axis))
    return robot, skeleton


def load_hand_skeleton(name: str) -> tuple[HandRobot, Any]:
    """Load the description and skeleton of a robot with a hand; its coupled joints are mimics.

    Raises:
        BadFile: no such robot, another kind of robot, or a wrong entry in its description.
    """
    return load_robot(name, HandRobot), _parse(name)


def hand_coupling(robot: HandRobot, skeleton: Any) -> tuple[list[int], np.ndarray]:
    """Which degrees of freedom are driven, and how all move with them.

    Returns:
        Indices of the eleven driven ones, arm then hand; S with rates of all = S rates of the
        driven ones, shape (dofs, 11), zero for the platform.
    """
    names = [skeleton.getDof(i).getName() for i in range(skeleton.getNumDofs())]
    leaders = [*robot.arm.joints, *robot.hand.drives]
    S = np.zeros((len(names), len(leaders)))
    for column, leader in enumerate(leaders):
        S[names.index(leader), column] = 1.0
    for follower, leader, ratio in robot.hand.followers:
        S[names.index(follower), leaders.index(leader)] = ratio
    return [names.index(leader) for leader in leaders], S


def _parse(name: str) -> Any:
    skeleton = dart.utils.DartLoader().parseSkeletonString(urdf_text(name), dart.common.Uri(""))
    skeleton.setGravity([0.0, 0.0, -9.81])
    return skeleton


def add_inertia(body: Any, moment: np.ndarray, mass: float = 0.0) -> None:
    """Add a moment of inertia (3, 3) [kg m^2] and a mass [kg] at a body's centre of mass."""
    old = body.getInertia()
    body.setInertia(
        dart.dynamics.Inertia(old.getMass() + mass, old.getLocalCOM(), old.getMoment() + moment)
    )
