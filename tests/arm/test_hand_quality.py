"""Grasp quality has the values known for simple grasps."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from arm.hand.quality import epsilon

FRICTIONS = (0.3, 0.5, 0.8)


def _around(*degrees: float) -> tuple[np.ndarray, np.ndarray]:
    """Contacts around a cylinder of 10 cm."""
    a = np.radians(degrees)
    out = np.stack([np.cos(a), np.sin(a), 0.0 * a], axis=1)
    return -out, 0.05 * out


def _with_cap(y: float) -> tuple[np.ndarray, np.ndarray]:
    n, x = _around(0.0, 180.0)
    return np.vstack([n, [0.0, 0.0, -1.0]]), np.vstack([x, [0.0, y, 0.1]])


@pytest.mark.parametrize(
    ("contacts", "torsion", "values"),
    [
        (_around(0.0, 120.0, 240.0), 0.0, (0.162, 0.276, 0.435)),
        (_around(0.0, 180.0), 0.01, (0.162, 0.184, 0.193)),
        (_around(0.0, 157.0, 203.0), 0.0, (0.060, 0.100, 0.160)),
        (_with_cap(0.03), 0.0, (0.0, 0.093, 0.270)),
    ],
    ids=["three", "two soft", "one and a pair", "cap and two"],
)
def test_reference_values(
    contacts: tuple[np.ndarray, np.ndarray], torsion: float, values: tuple[float, ...]
) -> None:
    """Within 2 % of values computed elsewhere (L1, 8 edges, moments over 5 cm)."""
    for mu, value in zip(FRICTIONS, values, strict=True):
        found = epsilon(*contacts, mu, torsion=torsion)
        assert found == pytest.approx(value, rel=0.02, abs=1e-3)


def test_two_hard_contacts_are_never_force_closure() -> None:
    """Nothing resists a twist about their line."""
    assert epsilon(*_around(0.0, 180.0), 1.0) == 0.0


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_quality_does_not_depend_on_the_frame(seed: int) -> None:
    """A grasp moved and turned is worth nearly the same (pyramids are not quite cones)."""
    rng = np.random.default_rng(seed)
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    n, x = _around(0.0, 120.0, 240.0)
    found = epsilon(n @ turn.T, x @ turn.T + rng.normal(size=3), 0.5)
    assert found == pytest.approx(epsilon(n, x, 0.5), rel=0.08)


@pytest.mark.parametrize(
    ("friction", "torsion", "edges"), [(-0.1, 0.0, 8), (0.5, -1.0, 8), (0.5, 0.0, 2)]
)
def test_what_is_out_of_range_is_refused(friction: float, torsion: float, edges: int) -> None:
    """Friction, torsion and edges."""
    with pytest.raises(ValueError, match="friction"):
        epsilon(*_around(0.0, 180.0), friction, torsion=torsion, edges=edges)
