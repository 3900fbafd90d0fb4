"""The observer's service: what it hears and what it says."""

from __future__ import annotations

from services.components import build_service
from services.lockstep import Lockstep
from services.logs.runlog import RunLog
from services.topics import BOARD, OBJECT, VISION
from sim.scenario import load_scenario


def test_board_and_box_may_be_watched_at_once() -> None:
    """One camera sees both: neither takes the other's sightings away."""
    scenario = load_scenario("move_to_grasp")
    task = scenario.task.model_copy(update={"watch_board": True})
    scenario = scenario.model_copy(update={"task": task})
    log = RunLog()
    lockstep = Lockstep(
        [build_service(name, scenario, 1) for name in scenario.services], listener=log
    )
    while lockstep.now < 1.0:
        lockstep.step()
    assert log.series(VISION)
    assert log.series(OBJECT)
    observer = next(s for s in lockstep.services if s.name == "observer")
    assert observer.inputs.count(VISION) == 1
    assert BOARD not in observer.inputs
