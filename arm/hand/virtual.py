"""Virtual contacts: several fingers that act as one in the residuals (Platt, section 4.4.1).

Two fingers beside each other oppose a third as one. Three variants; ``groups`` says which contacts
form which virtual one, ``((0,), (1, 2))`` for the pair of a three-finger hand.

- ``averaged``, as printed (Eq 4.32 to 4.34): normals, moments and effectors are averaged. The mean
  of two unit normals is shorter than one, so that the residual of a perfect grasp around a
  cylinder is not zero, and descending it draws the two fingers together.
- ``renormalised``: mean position, mean normal brought back to length one; else the same.
- ``physical``: as renormalised for the force, but the moment is that of the physical contacts, a
  virtual contact's force shared equally among its members, and each member moves by its own
  moment gradient. Averaging does not see a couple between the members, a skew pair; this does.

Members of a virtual contact move alike, each on its own tangent plane.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from arm.hand.residuals import (
    ALPHA,
    R_C,
    Kind,
    blend,
    checked,
    cross,
    force_gradient,
    moment_gradient,
    step,
)

Array = NDArray[np.float64]
Groups = Sequence[Sequence[int]]
Variant = Literal["averaged", "renormalised", "physical"]

PAIR: Groups = ((0,), (1, 2))
"""The opposing finger, and the other two as one (the paper's contacts 1 and 23)."""


def weights(groups: Groups, k: int) -> Array:
    """By which a virtual contact is the mean of its members, (groups, k).

    A column's sum is the share of a contact in the force of its virtual contact.

    Raises:
        ValueError: the groups are not a partition of the k contacts.
    """
    if sorted(i for group in groups for i in group) != list(range(k)) or not all(groups):
        raise ValueError(f"each of {k} contacts is in one group, none is empty: {groups}")
    out = np.zeros((len(groups), k))
    for row, group in zip(out, groups, strict=True):
        row[list(group)] = 1.0 / len(group)
    return out


def combined(
    normals: ArrayLike, points: ArrayLike, groups: Groups, renormalise: bool = True
) -> tuple[Array, Array]:
    """Normals and points of the virtual contacts, (groups, 3) each (Eq 4.32).

    Args:
        normals: of the physical contacts, into the object, unit, (k, 3).
        points: of contact, in the same frame, (k, 3) [m].
        groups: which contacts form which virtual one.
        renormalise: unit normals; otherwise their mean, as printed.

    Raises:
        ValueError: shapes or groups do not fit.
    """
    n, x = checked(normals, points, R_C)
    mean = weights(groups, len(n))
    n, x = mean @ n, mean @ x
    if renormalise:
        # members that face each other have no common normal: leave the zero rather than divide
        n = n / np.maximum(np.linalg.norm(n, axis=1, keepdims=True), 1e-9)
    return n, x


def residuals(
    normals: ArrayLike,
    points: ArrayLike,
    groups: Groups,
    r_c: float = R_C,
    variant: Variant = "physical",
) -> tuple[Array, Array]:
    """Net force and moment of the virtual contacts, (3,) each, without unit.

    Args:
        normals, points, r_c: of the physical contacts, as of ``arm.hand.residuals.residuals``.
        groups: which contacts form which virtual one.
        variant: see the module.

    Raises:
        ValueError: shapes or groups do not fit.
    """
    n, x = checked(normals, points, r_c)
    virtual_n, virtual_x = combined(n, x, groups, renormalise=variant != "averaged")
    middle = virtual_x.mean(axis=0)
    if variant == "renormalised":
        moment = cross(virtual_x - middle, virtual_n).sum(axis=0)
    else:
        share = weights(groups, len(n)).sum(axis=0)
        moment = share @ cross(x - middle, n)
    return virtual_n.sum(axis=0), moment / r_c


def gradients(
    normals: ArrayLike,
    points: ArrayLike,
    groups: Groups,
    r_c: float = R_C,
    variant: Variant = "physical",
) -> tuple[Array, Array]:
    """Both gradients for the physical contacts, (k, 3) each; arguments as of ``residuals``."""
    n, x = checked(normals, points, r_c)
    rho, moment = residuals(n, x, groups, r_c, variant)
    mean = weights(groups, len(n))
    if variant == "averaged":
        force, turn = mean @ force_gradient(n, rho), mean @ moment_gradient(n, moment)
    else:
        virtual_n, _ = combined(n, x, groups)
        force, turn = force_gradient(virtual_n, rho), moment_gradient(virtual_n, moment)
    member = (mean > 0.0).T.astype(float)
    own = moment_gradient(n, moment) if variant == "physical" else _tangent(n, member @ turn)
    return _tangent(n, member @ force), own


def displacements(
    normals: ArrayLike,
    points: ArrayLike,
    groups: Groups,
    r_c: float = R_C,
    alpha: float = ALPHA,
    kind: Kind = "sum",
    variant: Variant = "physical",
    most: float = np.inf,
) -> Array:
    """How far each physical contact should slide now, (k, 3) [m].

    Args:
        normals, points, r_c, alpha, kind, most: as of ``arm.hand.residuals.displacements``. On
            virtual contacts ``null`` differs from ``sum``: averaging loses the orthogonality.
        groups: which contacts form which virtual one.
        variant: see the module.

    Raises:
        ValueError: shapes or groups do not fit, or there is no such kind.
    """
    force, moment = gradients(normals, points, groups, r_c, variant)
    return step(blend(force, moment, kind), r_c, alpha, most)


def _tangent(normals: Array, vectors: Array) -> Array:
    return vectors - normals * np.sum(normals * vectors, axis=1, keepdims=True)
