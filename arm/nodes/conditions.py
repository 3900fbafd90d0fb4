"""What a node type claims: where it raises its good event, and from where it gets there.

g is the goal region, D the domain of the paper on controller refinement: node i prepares node i+1
if g(i) lies within D(i+1). Both are regions of a small state, the same for every type, so that
the goal of one can be held against the domain of another. ``steadyhand program check --control``
does that on states it has sampled.

A type claims by an attribute ``conditions`` of the class that its ``make`` names.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from arm.hds import NodeType, ParameterValue

Array = NDArray[np.float64]
Values = Mapping[str, ParameterValue]

TOUCH = 0.3
"""A pen pressed less than this touches nothing [N]."""
ARRIVED = 5e-3
"""A pen this near to a point is there [m]: what control, odometry and arrival leave together."""


@dataclass(frozen=True)
class State:
    """What conditions may speak of: pen and platform as they truly are.

    Attributes:
        tip: p_ST_S against the board as it is believed to be, shape (3,) [m].
        clearance: of the tip in front of the board as it truly is [m]; negative pressed into it.
        force: of the pen on the board [N].
        joint_margin: smallest distance of a joint to its limit [rad].
        reach_margin: left before the arm is stretched out [m].
        entered: where ``tip`` was when the node now running was entered, shape (3,) [m].
        ground: p_OT, the pen in the ground frame, shape (3,) [m].
        platform: X_OB, shape (3,) [m, m, rad].
        entered_ground: what ``ground`` was on entry, shape (3,) [m].
        entered_platform: what ``platform`` was on entry, shape (3,) [m, m, rad].
    """

    tip: Array
    clearance: float
    force: float
    joint_margin: float
    reach_margin: float
    entered: Array
    ground: Array = field(default_factory=lambda: np.zeros(3))
    platform: Array = field(default_factory=lambda: np.zeros(3))
    entered_ground: Array = field(default_factory=lambda: np.zeros(3))
    entered_platform: Array = field(default_factory=lambda: np.zeros(3))

    def at(self, frame: str) -> Array:
        """The pen in a frame a node may work in, ``board``, ``ground`` or ``platform``, (3,) [m].

        Raises:
            KeyError: there is no such frame.
        """
        aboard = _from_platform(self.ground, self.platform)
        return {"board": self.tip, "ground": self.ground, "platform": aboard}[frame]

    def entered_at(self, frame: str) -> Array:
        """Where the pen was in a frame when the node was entered, shape (3,) [m]; as ``at``."""
        return replace(
            self, tip=self.entered, ground=self.entered_ground, platform=self.entered_platform
        ).at(frame)

    def since(self, entry: State) -> State:
        """This state, had its node been entered when that of ``entry`` was."""
        return replace(
            self,
            entered=entry.entered,
            entered_ground=entry.entered_ground,
            entered_platform=entry.entered_platform,
        )


def _from_platform(point: Array, pose: Array) -> Array:
    """p_BT from p_OT and X_OB, shape (3,) [m]."""
    x, y = point[:2] - pose[:2]
    c, s = math.cos(pose[2]), math.sin(pose[2])
    return np.array([c * x + s * y, c * y - s * x, point[2]])


Region = Callable[[State, Values], Mapping[str, float]]
"""Margins by what they are of, 1 being comfortable; inside where none is negative."""


@dataclass(frozen=True)
class Conditions:
    """Goal region and domain of a node type; what is None is not claimed.

    Attributes:
        goal: g, the states at which a node raises one of ``good``.
        domain: D, the states from which it gets there.
        good: events that say the node has done what it is for.
    """

    goal: Region | None = None
    domain: Region | None = None
    good: tuple[str, ...] = ("Finished",)

    def in_goal(self, state: State, values: Values) -> bool | None:
        """Whether a state is in g for a node's parameters; None without a claim."""
        return None if self.goal is None else worst(self.goal(state, values))[0] >= 0.0

    def in_domain(self, state: State, values: Values) -> bool | None:
        """Whether a state is in D for a node's parameters; None without a claim."""
        return None if self.domain is None else worst(self.domain(state, values))[0] >= 0.0


NO_CLAIM = Conditions(good=())


def conditions_of(kind: NodeType) -> Conditions:
    """What a type claims; ``NO_CLAIM`` if it says nothing."""
    made: Any = getattr(kind.make, "conditions", NO_CLAIM)
    return made if isinstance(made, Conditions) else NO_CLAIM


def worst(margins: Mapping[str, float]) -> tuple[float, str]:
    """The smallest margin and what it is of; infinite if there is none."""
    return min(((float(v), k) for k, v in margins.items()), default=(float("inf"), ""))


def able(state: State, values: Values) -> dict[str, float]:
    """The arm is within its limits."""
    return {"reach": state.reach_margin / 0.05, "joint range": (state.joint_margin - 0.02) / 0.1}


def free(state: State, values: Values) -> dict[str, float]:
    """Able, and the pen touches nothing."""
    return {**able(state, values), "off the board": (TOUCH - state.force) / TOUCH}


def stayed(state: State, values: Values) -> dict[str, float]:
    """The pen is where it was on entry."""
    return near(state.tip - state.entered)


def near(offset: Array) -> dict[str, float]:
    """``offset`` from where the pen should be [m] is no more than ``ARRIVED``."""
    return {"near the point": 1.0 - float(np.linalg.norm(offset)) / ARRIVED}
