"""Keeps palms off what the box stands on: an arm that was thrown must not come back through it."""

from __future__ import annotations

from typing import Any

import numpy as np

from arm.control.objective import Objective, Rows
from arm.grasping.model import JOINTS
from arm.grasping.scene import Scene

_NOTHING = Rows(np.zeros((0, JOINTS)), np.zeros(0), 0.0)


class Above(Objective):
    """No corner of a palm nearer to the plane under the box than ``MARGIN``, and ``DOUBT`` of how
    well its height is known.

    Of the table the arms know only that the box stands on it. Above the lower edge of the box there
    is nothing to hit, so the plane is taken to go on in all directions.
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
            return _NOTHING
        box = scene.box
        table = float(box.p[2]) - 0.5 * float(box.size[2])
        margin = self.MARGIN + self.DOUBT * float(box.sd[2])
        J, rate = [], []
        for p, R, jacobian in zip(scene.palms.p, scene.palms.R, scene.palms.J, strict=True):
            corner = R @ (-np.sign(R[2]) * scene.half_palm)
            short = table + margin - float(p[2] + corner[2])
            if short > 0.0:
                # velocity of the corner: v + w x r
                J.append(jacobian[2] + corner[1] * jacobian[3] - corner[0] * jacobian[4])
                rate.append(min(self.gain * short, self.fastest))
        return Rows(np.array(J), np.array(rate)) if J else _NOTHING
