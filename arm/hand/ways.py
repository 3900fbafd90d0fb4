"""Ways of the arm between grasps: away from an object and to it again, and up with it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

from arm.hand.model import ARM, FLEX, SPREAD, HandModel, Placed
from arm.hand.plan import Plan
from arm.hand.reaching import Guess, Path, across, look, opened, solve

Array = NDArray[np.float64]

BACK = (0.16, 0.12, 0.08)
"""From where the fingers close to where the hand turns about the object, the first possible [m]."""
ROOM = 0.085
"""Of tips from the object's axis on a way around it; half of what a hand grasps, and a tip [m]."""
TALL = (-0.15, 0.10)
"""What is taken for the object: so far below and above the point to grasp [m]."""
DRAWS = 20
NEAR, FAR = 0.35, 0.6
"""Largest mean rate of joints where the object may be met, and elsewhere [rad/s]."""
FLOOR = -0.07
"""From the point to grasp downwards; there may be a table below [m]."""
CLEAR = 0.02
"""What backing off leaves above that; tips sink a little on the way around [m]."""


def elsewhere(
    model: HandModel,
    guess: Guess,
    plan: Plan,
    at: Placed,
    line: Array | None,
    rng: np.random.Generator,
) -> Path | None:
    """Open, back off, and come again as the plan wants further tries; None if no reach is found.

    On an object that is not round the fingers slide towards its narrow side, often too far around
    it for one reach. The next one of a plan that is ``level`` grasps along the line that the last
    one had come to, so that what it learned is kept.

    Args:
        model: as last placed at ``at``.
        guess: where the object is believed to stand.
        plan: how to grasp.
        at: the hand as it is.
        line: from finger 0 to the pair when the last try ended, shape (3,); None if it slid little.
        rng: draws the reach.
    """
    open_ = model.robot.hand.open
    wide = opened(at.q[ARM], at.q[SPREAD], min(0.3, open_))
    R, p = model.palm()
    lowest = float(((model.place(wide, np.zeros_like(wide)).x - guess.point) @ guess.axis).min())
    if lowest < FLOOR:
        # a finger that opens reaches down: the hand rises meanwhile by what it lacks
        risen = solve(model, R, p + (FLOOR - lowest) * guess.axis, rng, near=at.q[ARM])
        if risen is not None:
            wide[ARM], lowest, p = risen, FLOOR, p + (FLOOR - lowest) * guess.axis
    back = None
    for far in BACK:
        up = max(0.0, FLOOR + CLEAR - lowest + far * float(R[:, 2] @ guess.axis))
        to = p - far * R[:, 2] + up * guess.axis
        back = solve(model, R, to, rng, near=wide[ARM]) if back is None else back
    best, most = None, -np.inf
    for draw in range(2 * DRAWS):
        if draw == DRAWS:
            if best is not None:
                break
            line = None  # along no line rather than not at all
        tilt, side = rng.uniform(*plan.again), rng.uniform(-1.2, 1.2)
        yaw = rng.uniform(-np.pi, np.pi)
        if plan.level:
            yaw = np.copysign(np.pi / 2, yaw) + rng.uniform(-0.2, 0.2)
            if line is not None:
                side = across(guess, line)
        R, p = look(guess, tilt, side, yaw)
        there = solve(model, R, p, rng, near=back)
        if there is None:
            continue
        above = solve(model, R, p - BACK[0] * R[:, 2], rng, near=there)
        if above is None or np.abs(above - there).max() > 1.0:
            continue
        around = _around(model, guess, back, above, rng) if back is not None else []
        # wide until the fingers are clear of the object; slow wherever they may touch it
        points = [at.q, wide] + [opened(arm, wide[SPREAD], wide[FLEX][0]) for arm in around]
        points += [opened(above, plan.spread, open_), opened(there, plan.spread, open_)]
        path = Path(points, [NEAR, NEAR] + [FAR] * len(around) + [NEAR])
        room = _room(model, guess, path, len(around) + 2)
        if room > ROOM:
            return path
        if room > most:
            best, most = path, room
    return best


def upwards(model: HandModel, q: Array, height: float, rng: np.random.Generator) -> Path:
    """Straight up from joints q (11,), as far as the arm can, the fingers as they are [m]."""
    R, p, _ = model.palm_at(q)
    points = [q]
    for up in np.linspace(0.0, height, 4)[1:]:
        arm = solve(model, R, p + [0.0, 0.0, up], rng, near=points[-1][ARM])
        if arm is None or np.abs(arm - points[-1][ARM]).max() > 0.5:
            break
        points.append(np.concatenate([arm, q[SPREAD:]]))
    return Path(points, speed=0.25)


def _room(model: HandModel, guess: Guess, path: Path, last: int) -> float:
    """Least distance of a tip from the object's axis, between backing off and going in [m].

    Nothing at all where a tip comes down to what the object stands on.
    """
    least = np.inf
    for t in np.linspace(path.begins(2), path.begins(last), 25):
        q = path.at(t)[0]
        x = model.place(q, np.zeros_like(q)).x - guess.point
        high = x @ guess.axis
        if high.min() < FLOOR:
            return -np.inf
        high = np.clip(high, *TALL)
        least = min(least, float(np.linalg.norm(x - np.outer(high, guess.axis), axis=1).min()))
    return least


def _around(
    model: HandModel, guess: Guess, back: Array, above: Array, rng: np.random.Generator
) -> list[Array]:
    """Arm joints on a way around the object, from one to the other: a straight one cuts it."""
    from_, to = (model.palm_at(opened(arm, 0.0, 0.0))[:2] for arm in (back, above))
    turn = Slerp([0.0, 1.0], Rotation.from_matrix(np.array([from_[0], to[0]])))
    a, b = from_[1] - guess.point, to[1] - guess.point
    far = max(float(np.linalg.norm(a)), float(np.linalg.norm(b)))
    out = [back]
    for s in (0.25, 0.5, 0.75):
        way = (1.0 - s) * a / np.linalg.norm(a) + s * b / np.linalg.norm(b)
        way /= np.linalg.norm(way)
        R = turn(s).as_matrix()
        # the palm goes on looking at the object: else a finger meets it, or the table
        look_there, _ = Rotation.align_vectors(-way[None], R[None, :, 2])
        R = look_there.as_matrix() @ R
        arm = solve(model, R, guess.point + far * way, rng, near=out[-1])
        if arm is not None and np.abs(arm - out[-1]).max() < 1.2:
            out.append(arm)
    return out
