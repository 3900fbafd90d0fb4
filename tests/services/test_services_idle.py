"""An arm without a program on a platform that goes on moving."""

from __future__ import annotations

import numpy as np
import pytest

from services.arm_service import ArmService
from services.components import build_service
from services.lockstep import Lockstep
from services.logs.runlog import RunLog
from services.topics import ARM_STATE
from sim.scenario import load_scenario


@pytest.mark.parametrize("at", [1.0, 3.5, 4.0, 7.5])
def test_a_stopped_arm_neither_hits_the_board_nor_leaves_its_joints(at: float) -> None:
    """Told to stop at any phase of the sway, it comes along, and keeps off the board."""
    scenario = load_scenario("whiteboard_moving")
    services = [build_service(name, scenario, 1, live=True) for name in scenario.services]
    arm = next(s for s in services if isinstance(s, ArmService)).executive
    log = RunLog()
    lockstep = Lockstep(services, listener=log)
    while lockstep.now < at:
        lockstep.step()
    arm.stop()
    while lockstep.now < at + 8.0:
        lockstep.step()
    assert arm.state == "idle", arm.reason
    forces = np.array([state.wrench[:3] for state in log.series(ARM_STATE)])
    assert np.linalg.norm(forces, axis=1).max() < 20.0  # the pen's weight, and no blow


def test_what_a_person_asked_for_is_not_started_over_by_the_scenario() -> None:
    """A start or a stop before the scenario's own start takes its place."""
    scenario = load_scenario("whiteboard")
    task = scenario.task.model_copy(update={"start_at": 0.2})
    scenario = scenario.model_copy(update={"task": task})
    services = [build_service(name, scenario, 1) for name in scenario.services]
    arm = next(s for s in services if isinstance(s, ArmService))
    lockstep = Lockstep(services)
    while lockstep.now < 0.1:
        lockstep.step()
    assert arm.prepare("start", {})().accepted
    assert arm.prepare("stop", {})().accepted
    while lockstep.now < 0.5:
        lockstep.step()
    assert arm.executive.state == "idle"
