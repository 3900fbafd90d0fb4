"""The hand's model and the palm's way on a platform that moves."""

from __future__ import annotations

import math

import numpy as np
import pytest

from arm.hand.carrier import Carrier
from arm.hand.model import HandModel
from arm.hand.moving import MovingHandModel, turned
from arm.hand.reaching import opened
from arm.model import Base

ROBOT = "platform_hand"
DT = 0.002


def posture(model: HandModel) -> np.ndarray:
    """Somewhere in the middle of the reach."""
    return opened(np.array([0.1, 0.7, -0.1, 1.8, 0.1, 0.5, 0.2]), 1.0, 0.9)


def swaying(t: float) -> Base:
    """A platform that turns and sways, with its derivatives."""
    amplitude, w = np.array([0.08, 0.12, 0.07]), np.array([1.7, 1.3, 1.1])
    return Base(
        amplitude * np.sin(w * t),
        amplitude * w * np.cos(w * t),
        -amplitude * w * w * np.sin(w * t),
    )


def palm_in_world(model: HandModel, reference: np.ndarray, base: Base) -> np.ndarray:
    """p_OH [m]."""
    _, p, _ = model.palm_at(reference)
    return np.asarray(turned(base) @ p + [base.pose[0], base.pose[1], 0.0])


def test_a_platform_that_accelerates_is_felt_as_gravity_the_other_way() -> None:
    """Equivalence: h of a platform with acceleration a is h under gravity g - a."""
    model = MovingHandModel(ROBOT)
    q, still = posture(model), np.zeros(11)
    heading, a = 0.4, np.array([0.7, -0.5])
    acceleration = np.array([*a, 0.0])
    model.move(Base(np.array([2.0, 1.0, heading]), np.zeros(3), acceleration))
    moving = model.place(q, still).h
    plain = HandModel(ROBOT)
    c, s = math.cos(heading), math.sin(heading)
    in_base = np.array([c * a[0] + s * a[1], c * a[1] - s * a[0]])
    plain._skeleton.setGravity([-in_base[0], -in_base[1], -9.81])
    assert moving == pytest.approx(plain.place(q, still).h, abs=1e-9)
    assert not np.allclose(moving, HandModel(ROBOT).place(q, still).h, atol=0.1)


def test_the_palm_stays_in_the_world_while_the_platform_sways() -> None:
    """0.1 mm, where not making up for the platform costs 10 cm and more."""
    worst = {}
    for compensate in (True, False):
        model = MovingHandModel(ROBOT)
        reference, carrier = posture(model), Carrier(model)
        start = swaying(0.0)
        carrier.capture(reference, start, compensate)
        at = palm_in_world(model, reference, start)
        away = 0.0
        for i in range(1, 2000):
            base = swaying(i * DT)
            reference, _ = carrier.follow(DT, base, np.zeros(3), reference)
            if i > 250:  # the platform starts with a jump of velocity
                off = palm_in_world(model, reference, base) - at
                away = max(away, float(np.linalg.norm(off)))
        worst[compensate] = away
    assert worst[True] < 1e-4
    assert worst[False] > 0.1


def test_the_palm_keeps_its_orientation_on_a_way_through_the_world() -> None:
    """Upright as it was, and where the way leads, on a platform that turns."""
    model = MovingHandModel(ROBOT)
    reference, carrier = posture(model), Carrier(model)
    carrier.capture(reference, swaying(0.0))
    R = carrier.R.copy()
    to = carrier.p + [0.0, 0.1, 0.05]
    for i in range(1, 1001):
        velocity = np.array([0.0, 0.05, 0.025])
        reference, _ = carrier.follow(DT, swaying(i * DT), velocity, reference)
    base = swaying(1000 * DT)
    R_BH, _, _ = model.palm_at(reference)
    assert palm_in_world(model, reference, base) == pytest.approx(to, abs=2e-4)
    assert turned(base) @ R_BH == pytest.approx(R, abs=1e-3)
