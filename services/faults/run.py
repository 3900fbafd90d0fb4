"""One run with faults: draws while things go wrong, somebody resumes, and it is judged."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from arm.executive import Executive
from services.arm_service import ArmService
from services.base_service import BaseService
from services.components import build_service
from services.faults import kinds as k
from services.faults import timeline, verdict
from services.faults.plant import FaultyPlant
from services.logs.runlog import RunLog
from services.messages import AT_WORK, PROGRAM_ENDED
from services.run import without_collector
from services.service import Service
from services.sim_service import SimService
from sim.disturbance import Timed
from sim.scenario import Scenario
from sim.simulator import Simulator

PATIENCE = 0.3
"""A person resumes what has waited for so long [s], ..."""
RESUMES = 5
"""... so many times at most."""
SETTLED = 0.5
"""A run goes on for so long after its program has ended, and after the last fault [s]."""


@dataclass
class Faulty:
    """A run with faults.

    Attributes:
        row: verdicts and figures, as plain data.
        log: its messages; None unless it was to be kept.
    """

    row: dict[str, Any]
    log: RunLog | None


def run_faulty(
    scenario: Scenario,
    seed: int,
    faults: list[k.Fault],
    world: list[Timed],
    keep: bool = False,
) -> Faulty:
    """Run a scenario with faults in lockstep.

    Args:
        scenario: of an arm with a pen; its own disturbances happen too.
        seed: of the world and of the wire.
        faults: of messages and services.
        world: of the robot and its world.
        keep: keep the log.
    """
    scenario = scenario.model_copy(update={"disturbance": (*scenario.disturbance, *world)})
    services = [build_service(name, scenario, seed) for name in scenario.services]
    witness = verdict.Witness(scenario.robot, world)
    log = RunLog() if keep else None

    def listen(topic: Any, message: Any, now: float) -> None:
        witness(topic, message, now)
        if log is not None:
            log(topic, message, now)

    def rebuild(name: str) -> Service:
        return build_service(name, scenario, seed, live=True, restarted=True)

    rng = np.random.default_rng([seed, 7])
    plant = FaultyPlant(services, faults, rebuild, rng, listen)
    robot = next(s.simulator for s in services if isinstance(s, SimService))
    if not isinstance(robot, Simulator):
        raise ValueError(f"{scenario.robot} has no pen: faults are tried on an arm that draws")
    person = _Person(plant)
    last = max((f.t + f.duration for f in faults), default=0.0) + SETTLED
    ended = float("inf")
    with without_collector():
        while plant.now < min(scenario.duration, max(ended + SETTLED, last)):
            plant.step()
            witness.brakes(plant.now, robot.brakes.on)
            person.look()
            if witness.states and witness.states[-1][1] in PROGRAM_ENDED:
                ended = min(ended, plant.now)
    return Faulty(_row(seed, plant, witness, faults, world, person), log)


class _Person:
    """Resumes what can be resumed, after a look."""

    def __init__(self, plant: FaultyPlant) -> None:
        self._plant = plant
        self._since: float | None = None
        self.resumed = 0

    def look(self) -> None:
        """Resume arm and platform if they have waited for long enough."""
        arm, base = (self._plant.hosts[name].service for name in ("arm", "base"))
        assert isinstance(arm, ArmService) and isinstance(base, BaseService)
        now = self._plant.now
        executive: Executive = arm.executive
        if base.state()[0] == "stopped" and executive.state in AT_WORK:
            base.prepare("resume", {})()
        if executive.state != "safe_hold":
            self._since = None
            return
        self._since = now if self._since is None else self._since
        if now - self._since > PATIENCE and executive.sees and self.resumed < RESUMES:
            self._since = now
            self.resumed += arm.prepare("resume", {})().accepted


def _row(
    seed: int,
    plant: FaultyPlant,
    witness: verdict.Witness,
    faults: list[k.Fault],
    world: list[Timed],
    person: _Person,
) -> dict[str, Any]:
    well, words = verdict.ended_well(witness.states)
    after = [witness.safe_after(f) for f in faults if verdict.starves(f)]
    safe = [s for s in after if s is not None]
    refused = sum((host.refused for host in plant.hosts.values()), plant.refused)
    return {
        "seed": seed,
        "faults": [*map(verdict.told, faults), *map(verdict.told, world)],
        "used": {name: round(share, 4) for name, share in witness.limits.used.items()},
        "left_s": round(witness.limits.left, 3),
        "ended_well": well,
        "end": words,
        "finished": bool(witness.states) and witness.states[-1][1] == "finished",
        "restored": not plant.missing,
        "resumed": person.resumed,
        "safe_after_s": [round(s, 3) for s in safe if s < math.inf],
        "never_safe": safe.count(math.inf),
        "refused": dict(refused),
        "simulated_s": round(plant.now, 3),
    }


def drawn(scenario: Scenario, seed: int, keep: bool = False) -> Faulty:
    """A run with the faults of a seed."""
    faults, world = timeline.draw(seed)
    return run_faulty(scenario, seed, faults, world, keep)
