"""Above: the palms keep off the table, and off the top of the box, from above."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from arm.control.objective import Objective, Rows
from arm.grasping.rows import NOTHING
from arm.grasping.scene import BoxPlace, Scene

Array = NDArray[np.float64]


class Above(Objective):
    """No corner of a palm nearer to what is below it than ``MARGIN``, and ``DOUBT`` of how well
    its height is known.

    Of the table the arms know only that the box stands on it. Above the lower edge of the box there
    is nothing to hit, so the plane is taken to go on in all directions. What is below a palm over
    the box is the box.
    """

    name = "above"
    gain = 8.0
    fastest = 0.5
    MARGIN = 0.015
    """[m]"""
    DOUBT = 2.0
    """Deviations of the box's height [1]."""

    def rows(self, kinematics: Any, dt: float) -> Rows:
        """Up, of the lowest corner of each palm that is too near."""
        scene: Scene = kinematics
        if scene.box is None:
            return NOTHING
        margin = self.MARGIN + self.DOUBT * float(scene.box.sd[2])
        J, rate = [], []
        for p, R, jacobian in zip(scene.palms.p, scene.palms.R, scene.palms.J, strict=True):
            corner = R @ (-np.sign(R[2]) * scene.half_palm)
            extent = np.abs(scene.box.R.T @ R) @ scene.half_palm
            short = below(scene.box, p, extent) + margin - float(p[2] + corner[2])
            if short > 0.0:
                # velocity of the corner: v + w x r
                J.append(jacobian[2] + corner[1] * jacobian[3] - corner[0] * jacobian[4])
                rate.append(min(self.gain * short, self.fastest))
        return Rows(np.array(J), np.array(rate)) if J else NOTHING


def below(box: BoxPlace, p: Array, extent: Array) -> float:
    """Height in B of what is below a palm: table or box [m].

    Args:
        box: as believed.
        p: p_BP of the palm's middle [m].
        extent: of the palm from there, along x, y, z of the box [m].
    """
    off = np.abs(box.R.T @ (p - box.p))
    over = (off[:2] < 0.5 * box.size[:2] + extent[:2]).all()
    half = 0.5 * float(box.size[2])
    top = float(box.p[2]) + half
    return top if over and float(p[2]) > top else top - 2.0 * half
