"""What two palms know of the box between them: their geometry, by joint angles and load cells.

A palm on a face knows where the face is along its own normal, and, lying flat, which way the face
looks. It does not know where on the face it is: flat palms cannot see along the box.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from deploy.skeleton import BOTH, PLATFORM, TWO_ARM_DOFS, load_two_arm_skeleton
from services.messages import ArmState

Array = NDArray[np.float64]

TOUCHES = 4.0
"""Force along the normal from which a palm touches [N]."""
GRIPS = 10.0
"""... from which two palms take a box along that stands on a table [N]."""
CARRIES = 5.0
"""Weight on the palms from which they carry it [N]."""
FLAT = 0.4
"""Middle of pressure within this share of the half palm: it lies flat [1]."""
SD = 5e-3
"""Deviation of the box's middle between two palms, every 40 ms: 1 mm, alike for a second [m]."""
NORMAL_SD = 0.04
"""Of the faces' normal between palms that lie flat, likewise [rad]."""


@dataclass(frozen=True)
class Touch:
    """What the palms feel at one instant, in O.

    Attributes:
        points: middle of pressure of the left and of the right palm [m], None if it touches not.
        lifted: the palms carry weight: what they hold goes up and down with them.
        grip: when both press harder than the table holds the box, the point half way between the
            palms [m] and a frame (3, 3) that turns with the line between them.
        normal: of the face under the left palm, as palms that lie flat show it, unit vector; only
            when both touch.
        sd: of the middle between ``points`` along the normal [m].
        normal_sd: of ``normal`` [rad].
    """

    points: tuple[Array | None, Array | None] = (None, None)
    grip: tuple[Array, Array] | None = None
    lifted: bool = False
    normal: Array | None = None
    sd: float = SD
    normal_sd: float = NORMAL_SD


class PalmTouch:
    """Turns joint angles and load cells into ``Touch``.

    Args:
        robot: name of a two-armed robot.

    Raises:
        BadFile: no such robot, or one of another kind.
    """

    def __init__(self, robot: str) -> None:
        description, self._skeleton = load_two_arm_skeleton(robot)
        self._palms: list[Any] = [
            self._skeleton.getBodyNode(link) for link in description.palms.links
        ]
        self._half = 0.5 * np.array(description.palms.size)
        self._positions = np.zeros(TWO_ARM_DOFS)
        self._felt = np.zeros(12)

    def feel(self, state: ArmState, pose: Array) -> Touch:
        """What the palms feel.

        Args:
            state: of the arms.
            pose: X_OB at that instant, shape (3,) [m, m, rad].
        """
        self._felt += 0.3 * (state.wrench - self._felt)
        # of the world on the palm: the left one is pushed along +y of its P
        force = np.array([self._felt[1], -self._felt[7]])
        if force.max() < TOUCHES:
            return Touch()
        self._positions[PLATFORM] = pose
        self._positions[BOTH] = state.q
        self._skeleton.setPositions(self._positions)
        points: list[Array | None] = []
        middles, normals, flat = [], [], True
        for i, (palm, f) in enumerate(zip(self._palms, force, strict=True)):
            X = palm.getWorldTransform().matrix()
            R, p = X[:3, :3], X[:3, 3]
            middles.append(p)
            normals.append(R[:, 1])
            if f < TOUCHES:
                points.append(None)
                continue
            w = self._felt[6 * i : 6 * i + 6]
            inward = -1.0 if i == 0 else 1.0
            y = inward * self._half[1]
            # m = r x f with r in the plane of the palm's face
            x, z = (w[5] + y * w[0]) / w[1], (y * w[2] - w[3]) / w[1]
            x = min(max(x, -self._half[0]), self._half[0])
            z = min(max(z, -self._half[2]), self._half[2])
            flat &= abs(x) < FLAT * self._half[0] and abs(z) < FLAT * self._half[2]
            points.append(p + R @ np.array([x, y, z]))
        first, second = points
        if first is None or second is None:
            return Touch((first, second))
        across = middles[0] - middles[1]
        heading = math.atan2(-across[0], across[1])
        c, s = math.cos(heading), math.sin(heading)
        frame = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        normal = normals[0] + normals[1]
        length = float(np.linalg.norm(normal))
        shown = normal / length if flat and length > 1.9 else None
        grip = (0.5 * (middles[0] + middles[1]), frame) if force.min() > GRIPS else None
        weight = -sum(
            float((palm.getWorldTransform().matrix()[:3, :3] @ self._felt[6 * i : 6 * i + 3])[2])
            for i, palm in enumerate(self._palms)
        )
        return Touch((first, second), grip, weight > CARRIES, shown)
