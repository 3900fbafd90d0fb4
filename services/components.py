"""Builds the services by name."""

from __future__ import annotations

from pathlib import Path

from deploy.robot import robot_kind
from services.service import Service
from services.topics import SERVICES
from sim.scenario import Scenario, load_scenario


def build_service(
    name: str,
    scenario: str | Path | Scenario,
    seed: int,
    observer: str = "ekf",
    live: bool = False,
    restarted: bool = False,
) -> Service:
    """Build a service.

    Args:
        name: one of ``topics.SERVICES``.
        scenario: name, path, or a scenario already read.
        seed: of the simulation.
        observer: kind of observer.
        live: runs in real time.
        restarted: the process died before; come up waiting for a person.

    Raises:
        BadFile, ProgramError, ValueError: the scenario, its program or a name is wrong.
    """
    if not isinstance(scenario, Scenario):
        scenario = load_scenario(scenario)
    # imported as needed: a restarted process is back sooner without what it does not use
    if name == "sim":
        from services.sim_service import SimService

        return SimService(scenario, seed)
    if name == "observer":
        from services.observer_service import ObserverService

        watched = scenario.task.board if scenario.task.watch_board else None
        box = scenario.task.box is not None
        return ObserverService(observer, scenario.robot, watched, box)
    if name == "base":
        from services.base_service import BaseService

        return BaseService(scenario, restarted)
    if name == "arm":
        kind = robot_kind(scenario.robot)
        if kind == "hand":
            from services.hand_service import HandService

            return HandService(scenario, live, restarted, seed)
        if kind == "two_arm":
            from services.two_arm_service import TwoArmService

            return TwoArmService(scenario, live, restarted)
        from services.arm_service import ArmService

        return ArmService(scenario, live, restarted, seed)
    raise ValueError(f"unknown service {name!r}. Known: {', '.join(SERVICES)}")
