"""Soft pads of the palms: what they do to a force, and what they leave as it was."""

from __future__ import annotations

import math

import numpy as np
import pytest

from deploy.robot import TwoArmRobot, load_robot
from deploy.skeleton import TWO_ARM_DOFS
from services.messages import Truth
from sim.effects import Effects
from sim.scenario import Box, Mismatch, Table, World
from sim.two_arm_physics import PADS, PALMS, TwoArmPhysics
from tests.sim.two_arm_loop import ROBOT, Squeezer, run, scenario

PAD = load_robot(ROBOT, TwoArmRobot).palms.pad


def test_a_squeezed_pad_gives_way_as_it_is_stiff() -> None:
    """Force and compression of a palm that holds a box agree with the description."""
    made = scenario(exact=False, platform_start=(-0.6, 0.0, 0.0))
    seen = run(made, 3.0, arms=Squeezer(np.array([0.6, 0.0, 0.839]), 0.1395, 25.0, 0.0))
    way = seen.simulator.physics._skeleton.getPositions()[PADS]
    last = seen.of(Truth)[-1]
    pressed = [math.hypot(*last.forces[name]) for name in ("left_palm", "right_palm")]
    assert min(pressed) > 15.0
    np.testing.assert_allclose(way * PAD.stiffness, pressed, rtol=0.1)


@pytest.mark.parametrize(("apart", "touches"), [(1e-6, True), (1e-4, False)])
def test_a_pad_that_is_pressed_does_not_lose_touch_by_rounding(apart: float, touches: bool) -> None:
    """One that has gone further has; thrown by its spring it would go through the box."""
    made = scenario(exact=False, platform_start=(-0.6, 0.0, 0.0))
    seen = run(made, 3.0, arms=Squeezer(np.array([0.6, 0.0, 0.839]), 0.1395, 25.0, 0.0))
    physics = seen.simulator.physics
    x = physics._skeleton.getPositions()
    deep = [0.0, 0.0]
    for contact in physics._world.getLastCollisionResult().getContacts():
        frames = (contact.collisionObject1, contact.collisionObject2)
        names = [physics._body_of(side.getShapeFrame()) for side in frames]
        for i, name in enumerate(PALMS):
            deep[i] = max(deep[i], contact.penetrationDepth * (name in names))
    x[PADS] += np.array(deep) + apart
    physics._skeleton.setPositions(x)
    assert "left_palm" not in physics._touching()
    assert physics._pads_touch() == [touches, touches]


def test_pads_weigh_nothing_extra_and_are_not_the_controllers_to_know() -> None:
    """The palm gives them their mass; the model that controls has no joint for them."""
    world = World(box=Box(), mismatch=Mismatch(inertia=0.0, payload=0.0))
    physics = TwoArmPhysics(ROBOT, world, (-2.0, 0.0, 0.0), np.random.default_rng(0))
    assert physics._skeleton.getNumDofs() == TWO_ARM_DOFS + 2
    assert physics._skeleton.getMass() == pytest.approx(139.4, abs=0.1)
    assert not any("pad" in name for name in physics.bodies)


def test_a_box_thrown_at_a_palm_is_stopped_over_the_pads_way() -> None:
    """1.5 kg at 1.1 m/s give less than 100 N against arms that do not give way themselves."""
    box, table = Box(x=0.34), Table(x=0.55)
    world = World(box=box, table=table, mismatch=Mismatch(inertia=0.0, payload=0.0))
    physics = TwoArmPhysics(ROBOT, world, (0.0, 0.0, 0.0), np.random.default_rng(0))
    # palms at rest are 0.12 m from its sides
    physics._box.getParentJoint().setVelocities([0.0, 0.0, 0.0, 0.0, 1.6, 0.0])
    physics.set_brakes(100.0)  # brakes: nothing but the pad gives way
    hardest, deepest = 0.0, 0.0
    for _ in range(60):
        physics.step(np.zeros(14), np.zeros(3), Effects())
        hardest = max(hardest, math.hypot(*physics.hardest_forces()["left_palm"]))
        deepest = max(deepest, float(physics._skeleton.getPositions()[PADS][0]))
    assert 0.008 < deepest < PAD.stroke
    assert 40.0 < hardest < 100.0


def test_a_pad_resists_no_harder_than_its_cells_buckle() -> None:
    """Twice the energy of the box above goes into more of the stroke, not into more force."""
    hardest, deepest = [], []
    for speed in (1.6, 2.4):
        box, table = Box(x=0.34), Table(x=0.55)
        world = World(box=box, table=table, mismatch=Mismatch(inertia=0.0, payload=0.0))
        physics = TwoArmPhysics(ROBOT, world, (0.0, 0.0, 0.0), np.random.default_rng(0))
        physics._box.getParentJoint().setVelocities([0.0, 0.0, 0.0, 0.0, speed, 0.0])
        physics.set_brakes(100.0)
        force = way = 0.0
        for _ in range(60):
            physics.step(np.zeros(14), np.zeros(3), Effects())
            force = max(force, math.hypot(*physics.hardest_forces()["left_palm"]))
            way = max(way, float(physics._skeleton.getPositions()[PADS][0]))
        hardest.append(force)
        deepest.append(way)
    assert max(hardest) < 1.1 * PAD.plateau  # the face is not without mass
    assert PAD.plateau / PAD.stiffness < deepest[1] < PAD.stroke


def test_the_hardest_force_since_it_was_last_asked_is_told() -> None:
    """An impact between two questions is not missed."""
    box, table = Box(x=0.34), Table(x=0.55)
    world = World(box=box, table=table, mismatch=Mismatch(inertia=0.0, payload=0.0))

    def hardest(every: int) -> float:
        physics = TwoArmPhysics(ROBOT, world, (0.0, 0.0, 0.0), np.random.default_rng(0))
        physics._box.getParentJoint().setVelocities([0.0, 0.0, 0.0, 0.0, 1.6, 0.0])
        physics.set_brakes(100.0)
        most = 0.0
        for k in range(60):
            physics.step(np.zeros(14), np.zeros(3), Effects())
            if k % every == every - 1:
                most = max(most, math.hypot(*physics.hardest_forces()["left_palm"]))
        return most

    assert hardest(30) == pytest.approx(hardest(1))
