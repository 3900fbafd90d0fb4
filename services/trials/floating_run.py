"""One grasp of floating contacts: no hand, no friction, the ceiling of what a controller can do."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from arm.hand import angles, curvature, virtual
from arm.hand import residuals as plain
from arm.hand.probing import Probing
from arm.hand.quality import epsilon
from sim.surfaces import OBJECTS, Surface, outwards, scatter, touch

Array = NDArray[np.float64]
Controller = Literal[
    "sum", "null", "curvature", "C*", "C* fallback", "force", "printed", "corrected", "probing"
]
Fingers = Literal["two", "three", "virtual"]
Start = Literal["rays", "area", "hand"]

GOAL = 0.1
"""Of |rho| and of |M| / r_c."""
STAY = 5
"""Updates for which both must be within the goal."""
WINDOW, STILL = 50, 2e-4
"""Stuck: farthest that any contact came in so many updates [m]."""
EVERY = 4
"""Updates from one point of a curve to the next."""
FRICTIONS = (0.3, 0.5, 0.8)


@dataclass(frozen=True)
class Setting:
    """What is the same for every trial.

    Attributes:
        updates: the most there are.
        alpha: step along the gradient.
        r_c: characteristic radius [m].
        tip: radius of the tips; 0 for points [m].
        noise: standard deviation of a normal felt [rad].
        variant: of virtual contacts.
        start: independent contacts where ``rays`` from the middle leave the object, or even over
            its ``area``; as ``rays``, but a ``hand`` has the two of a virtual one 4 cm apart.
        most: farthest slide in one update [m].
    """

    updates: int = 400
    alpha: float = plain.ALPHA
    r_c: float = 0.05
    tip: float = 0.0
    noise: float = 0.0
    variant: virtual.Variant = "renormalised"
    start: Start = "rays"
    most: float = 0.002


def grasp(
    thing: str, fingers: Fingers, controller: Controller, seed: int, setting: Setting
) -> dict[str, Any]:
    """Slide contacts from a random start until the residuals are lost, or all updates are used.

    Args:
        thing: one of ``sim.surfaces.OBJECTS``.
        fingers: two, three, or one against a virtual one of two.
        controller: what moves them.
        seed: of start and noise; controllers start alike.
        setting: all else.

    Returns:
        Plain data: ``success``, ``updates`` until then (None), ``seconds`` of probing (None), |rho|
        and |M| / r_c at the end and in ``curve``, by how much |rho| ever ``rise``s over its least
        before, ``angle`` before and after [rad], ``epsilon`` by friction.
    """
    surface = OBJECTS[thing]
    rng = np.random.default_rng([seed, 17])
    centres, x, n = touch(surface, _start(surface, fingers, setting.start, rng), 0.0)
    centres, x, n = touch(surface, centres - setting.tip * n, setting.tip)
    groups = virtual.PAIR if fingers == "virtual" else tuple((i,) for i in range(len(x)))
    before = _angle(x, groups)
    law = _law(controller, fingers, groups, setting)
    curve: list[tuple[float, float]] = []
    held, done, seconds, was = 0, None, 0.0, centres + 1.0
    probing = Probing() if controller == "probing" else None
    for update in range(setting.updates):
        true = _residuals(n, x, groups, fingers, setting)
        if update % EVERY == 0:
            curve.append(true)
        held = held + 1 if max(true) < GOAL else 0
        if held == (1 if probing else STAY):
            done = update + 1 - held
            break
        if update % WINDOW == 0:
            if np.abs(centres - was).max() < STILL:
                break
            was = centres
        felt = _disturbed(n, setting.noise, rng)
        dx = law(felt, x, centres)
        if probing:
            way = probing.path(x, felt, dx)
            centres, again, n = touch(surface, way[1] + probing.lift * felt, setting.tip)
            seconds += probing.seconds(x, way, again)
            x = again
        else:
            centres, x, n = touch(surface, centres + dx, setting.tip)
    end = _residuals(n, x, groups, fingers, setting)
    curve.append(end)
    sizes = np.array([point[0] for point in curve])
    soft = 0.01 if fingers == "two" else 0.0
    return {
        "success": done is not None,
        "updates": done,
        "seconds": seconds if probing else None,
        "rho": end[0],
        "moment": end[1],
        "rise": float(np.max(sizes - np.minimum.accumulate(sizes))),
        "angle": [before, _angle(x, groups)],
        "epsilon": [epsilon(n, x, mu, setting.r_c, torsion=soft) for mu in FRICTIONS],
        "curve": [[round(v, 5) for v in point] for point in curve],
    }


def _start(surface: Surface, fingers: Fingers, start: Start, rng: np.random.Generator) -> Array:
    k = 2 if fingers == "two" else 3
    if start != "hand" or fingers != "virtual":
        return (scatter if start == "area" else outwards)(surface, k, rng)
    p = outwards(surface, 2, rng)
    n = touch(surface, p[1:])[2][0]
    across = np.cross(n, rng.normal(size=3))
    across *= 0.02 / np.linalg.norm(across)
    return np.stack([p[0], p[1] + across, p[1] - across])


def _law(
    controller: Controller, fingers: Fingers, groups: virtual.Groups, s: Setting
) -> Callable[[Array, Array, Array], Array]:
    """What displaces the contacts, of normals and points felt and centres of the tips."""
    if controller in ("printed", "corrected"):
        if fingers == "virtual":
            raise ValueError(f"{controller} is for physical contacts")
        fixed = controller == "corrected"
        return lambda n, x, c: angles.displacements(n, x, s.r_c, s.alpha, "null", fixed, s.most)
    if controller == "curvature":
        if fingers == "virtual":
            raise ValueError("curvature is for physical contacts")
        feelers = [curvature.Curvature(s.r_c, noise=s.noise) for group in groups for _ in group]

        def felt(n: Array, x: Array, c: Array) -> Array:
            for feeler, normal, centre in zip(feelers, n, c, strict=True):
                feeler.feel(normal, centre)
            shapes = [feeler.estimate() for feeler in feelers]
            return curvature.displacements(n, x, shapes, s.r_c, s.alpha, s.most)

        return felt
    stages = plain.Sequential(fallback=controller == "C* fallback")

    def slid(n: Array, x: Array, c: Array) -> Array:
        kind: plain.Kind
        if controller in ("C*", "C* fallback"):
            rho = virtual.residuals(n, x, groups, s.r_c, s.variant)[0]
            kind = stages.choose(rho)
        elif controller == "probing":
            kind = "sum"
        else:
            kind = controller  # type: ignore[assignment]  # what is left are kinds
        if fingers != "virtual":
            return plain.displacements(n, x, s.r_c, s.alpha, kind, s.most)
        return virtual.displacements(n, x, groups, s.r_c, s.alpha, kind, s.variant, s.most)

    return slid


def _residuals(
    n: Array, x: Array, groups: virtual.Groups, fingers: Fingers, s: Setting
) -> tuple[float, float]:
    if fingers == "virtual":
        rho, moment = virtual.residuals(n, x, groups, s.r_c, s.variant)
    else:
        rho, moment = plain.residuals(n, x, s.r_c)
    return float(np.linalg.norm(rho)), float(np.linalg.norm(moment))


def _disturbed(n: Array, noise: float, rng: np.random.Generator) -> Array:
    if noise == 0.0:
        return n
    out = n + rng.normal(0.0, noise, n.shape)
    unit: Array = out / np.linalg.norm(out, axis=1, keepdims=True)
    return unit


def _angle(x: Array, groups: virtual.Groups) -> float:
    """Between the object's axis and the line of two contacts, or the normal of three's plane."""
    points = virtual.weights(groups, len(x)) @ x
    line = points[1] - points[0]
    if len(points) == 3:
        line = np.cross(line, points[2] - points[0])
    size = float(np.linalg.norm(line))
    return float(np.arccos(min(1.0, abs(line[2]) / size))) if size > 0.0 else 0.0
