"""What the arm believes its robot to be: kinematics and dynamics, from the description."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dposv

from deploy.robot import Robot
from deploy.skeleton import ARM, PLATFORM, load_skeleton

Array = NDArray[np.float64]

_LINEAR_FIRST = np.array([3, 4, 5, 0, 1, 2])


@dataclass(slots=True, eq=False)
class Base:
    """Motion of the platform at one instant, in O.

    Attributes:
        pose: X_OB as x, y [m], heading [rad].
        velocity: V_OB_O, shape (3,).
        acceleration: A_OB_O, shape (3,).
        steady: what of the velocity the acceleration accounts for, shape (3,): smoother than the
            velocity, which is also bent so that the pose comes right; None is the velocity.
    """

    pose: Array
    velocity: Array
    acceleration: Array
    steady: Array | None = None

    def after(self, dt: float) -> Base:
        """The motion ``dt`` [s] later, with the acceleration kept."""
        return Base(
            self.pose + self.velocity * dt + self.acceleration * (0.5 * dt * dt),
            self.velocity + self.acceleration * dt,
            self.acceleration,
        )


STANDING = Base(np.zeros(3), np.zeros(3), np.zeros(3))


@dataclass(slots=True, eq=False)
class Kinematics:
    """Where the pen tip is and how joints and platform move it.

    Attributes:
        p: p_OT, shape (3,) [m].
        R: R_OT, shape (3, 3).
        J: of the tip (linear, then angular velocity) in O by joint rates, shape (6, n).
        drift: velocity of the tip in O that the platform alone causes, shape (6,).
        q: joint positions there, shape (n,) [rad].
        steady: the drift that the platform's ``steady`` velocity causes, for what is sensitive to
            velocity and not to pose; None is the drift.
    """

    p: Array
    R: Array
    J: Array
    drift: Array
    q: Array
    steady: Array | None = None


@dataclass(slots=True, eq=False)
class Inertia:
    """Of the arm on its platform, at one posture.

    Attributes:
        joints: M_aa, by acceleration of the joints, shape (n, n) [kg m^2].
        recoiling: the same for a platform that is free to recoil, M_aa - M_ab M_bb^-1 M_ba.
        platform: M_ab, by acceleration of the platform, shape (n, 3) [kg m, kg m, kg m^2].
        diagonal: of ``joints``, shape (n,) [kg m^2].
    """

    joints: Array
    recoiling: Array
    platform: Array
    diagonal: Array


class ArmModel:
    """Nominal kinematics and dynamics of arm on platform.

    Args:
        name: of the robot's folder in deploy/robots.

    Attributes:
        robot: its description.
        joints: of the arm; n in the shapes.
    """

    def __init__(self, name: str) -> None:
        self.robot: Robot
        self.robot, self._skeleton = load_skeleton(name)
        self._pen = self._skeleton.getBodyNode("pen")
        self.joints = len(self.robot.arm.joints)
        self._wrist = self._skeleton.getBodyNode(self.robot.arm.links[-1])
        self._tip = np.array([0.0, 0.0, self.robot.pen.tip_radius])
        self._positions = np.zeros(self._skeleton.getNumDofs())
        self._velocities = np.zeros(self._skeleton.getNumDofs())
        lower = self._skeleton.getPositionLowerLimits()[ARM]
        upper = self._skeleton.getPositionUpperLimits()[ARM]
        self.q_lower: Array = np.array(lower)
        self.q_upper: Array = np.array(upper)
        self._shoulder = self._skeleton.getBodyNode("link2")

    def place(self, base: Base, q: Array, qd: Array) -> Kinematics:
        """Set the model's state and return the kinematics of the pen tip there.

        Args:
            base: motion of the platform.
            q: joint positions, shape (n,) [rad].
            qd: joint velocities, shape (n,) [rad/s].
        """
        self._positions[PLATFORM] = base.pose
        self._positions[ARM] = q
        self._velocities[PLATFORM] = base.velocity
        self._velocities[ARM] = qd
        self._skeleton.setPositions(self._positions)
        self._skeleton.setVelocities(self._velocities)
        pose = self._pen.getWorldTransform().matrix()
        jacobian = self._skeleton.getWorldJacobian(self._pen, self._tip)  # angular rows first
        platform = jacobian[:, PLATFORM].take(_LINEAR_FIRST, axis=0)
        R = pose[:3, :3]
        return Kinematics(
            p=pose[:3, 3] + R.dot(self._tip),
            R=R,
            J=jacobian[:, ARM].take(_LINEAR_FIRST, axis=0),
            drift=platform.dot(base.velocity),
            q=q,
            steady=None if base.steady is None else platform.dot(base.steady),
        )

    def inertia(self) -> Inertia:
        """At the state last placed."""
        mass = self._skeleton.getMassMatrix()
        joints = np.ascontiguousarray(mass[ARM, ARM])
        platform = np.ascontiguousarray(mass[ARM, PLATFORM])
        recoil = dposv(mass[PLATFORM, PLATFORM], platform.T)[1]
        return Inertia(joints, joints - platform.dot(recoil), platform, joints.diagonal())

    def torque(
        self,
        inertia: Inertia,
        feedforward: Array,
        feedback: Array,
        base_acceleration: Array,
    ) -> Array:
        """Torque at the state last placed, shape (n,) [N m], without friction.

        Gravity, Coriolis, rotor inertia and the platform's acceleration are in it. The feedback
        goes through the inertia that the joints feel on a platform free to recoil: with M_aa
        alone the loop of joint 1 is half as fast again as meant, and goes unstable with the
        observer in it.

        Args:
            inertia: at that state or one near it.
            feedforward: joint accelerations of the reference, shape (n,) [rad/s^2].
            feedback: joint accelerations asked for by the joint error, shape (n,) [rad/s^2].
            base_acceleration: A_OB_O, recoil included, shape (3,).
        """
        tau: Array = inertia.joints.dot(feedforward)
        tau += inertia.recoiling.dot(feedback)
        tau += inertia.platform.dot(base_acceleration)
        tau += self._skeleton.getCoriolisAndGravityForces()[ARM]
        return tau

    def carried_momentum(self, qd: Array) -> Array:
        """What motion of the joints alone gives the robot, at the state last placed.

        Args:
            qd: joint rates, shape (n,) [rad/s].

        Returns:
            Momentum along x, y of O [N s] and about the vertical through B [N m s], shape (3,).
        """
        return np.asarray(self._skeleton.getMassMatrix()[PLATFORM, ARM] @ qd)

    def recoil(self, reaction: Array) -> Array:
        """Acceleration of a freely rolling platform with the arm on it, at the state last placed.

        Args:
            reaction: F_B in O, shape (3,) [N, N, N m].

        Returns:
            A_OB_O, shape (3,) [m/s^2, m/s^2, rad/s^2].
        """
        mass = self._skeleton.getMassMatrix()[PLATFORM, PLATFORM]
        return np.asarray(dposv(mass, reaction)[1])

    def stretch(self) -> float:
        """Distance from shoulder to wrist at the state last placed [m]."""
        wrist, shoulder = self.wrist_and_shoulder()
        return math.dist(wrist.tolist(), shoulder.tolist())

    def wrist_and_shoulder(self) -> tuple[Array, Array]:
        """Centres of wrist and shoulder in O at the state last placed, shapes (3,) [m]."""
        wrist, shoulder = (
            np.asarray(body.getWorldTransform().translation()).reshape(3)
            for body in (self._wrist, self._shoulder)
        )
        return wrist, shoulder

    def joint_margin(self, q: Array) -> float:
        """Smallest distance of ``q`` to a joint limit [rad]; negative beyond it."""
        above, below = (q - self.q_lower).tolist(), (self.q_upper - q).tolist()
        return float(min(above + below))
