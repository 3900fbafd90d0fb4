"""The arm's benchmark: late commands, stiffness, and goals that every run meets or none."""

from __future__ import annotations

import pytest

from services.bench.arm import CASES, GOALS, Goal, stiffness, timed
from services.cli.bench_arm import summary
from services.lockstep import Lockstep
from services.messages import Clock
from services.service import Inbox, Outbox
from services.topics import ARM_COMMAND, TOPICS, Topic
from sim.scenario import load_scenario


class Speaker:
    """Says on two topics at every tick; remembers when it hears what."""

    name = "speaker"
    period = 0.001
    verbs: tuple[str, ...] = ()

    def __init__(self, topics: tuple[Topic, ...]) -> None:
        self.inputs = topics
        self.ages: list[tuple[float, ...]] = []

    def step(self, now: float, inbox: Inbox) -> Outbox:
        self.ages.append(
            tuple(round(1e3 * inbox.age(t, now)) if inbox.latest(t) else -1 for t in self.inputs)
        )
        return [(t, Clock(t=now)) for t in self.inputs]


def test_late_topic_is_late_and_no_other() -> None:
    """Commands 3 ticks late arrive 4 ticks old, everything else 1 tick old, in order."""
    other = next(t for t in TOPICS.values() if t.name != ARM_COMMAND.name and t.depth == 1)
    speaker = Speaker((ARM_COMMAND, other))
    run = Lockstep([speaker], late={ARM_COMMAND.name: 3})  # type: ignore[list-item]
    for _ in range(20):
        run.step()
    assert speaker.ages[:2] == [(-1, -1), (-1, 1)]
    assert speaker.ages[6:] == [(4, 1)] * 14
    with pytest.raises(ValueError, match="before"):
        Lockstep([], late={ARM_COMMAND.name: -1})


def test_push_finds_the_stiffness_of_the_torque_law() -> None:
    """In motion the tip gives way as the gains say: between 8 and 60 kN/m."""
    assert 8e3 < stiffness(load_scenario("whiteboard_moving"), 1, "truth") < 60e3


def test_goal_is_met_only_if_every_run_meets_and_ends() -> None:
    """The worst run counts, and one that did not finish meets nothing."""
    goal = GOALS[0]
    runs = [{"case": goal.case, "outcome": "finished", goal.figure: x} for x in (0.01, 0.04)]
    assert summary(runs)[0]["met"] is True
    assert summary([*runs, {**runs[0], goal.figure: 0.06}])[0]["met"] is False
    assert summary([*runs, {**runs[0], "outcome": "safe_hold: no"}])[0]["met"] is False
    assert summary([])[0]["met"] is None
    assert Goal("x", "y", "z", 5.0, least=True).met([7.0, 4.0]) is False
    assert {g.case for g in GOALS} == set(CASES)


def test_cost_is_counted_around_the_arm_alone() -> None:
    """The arm's step is between a tenth and nine tenths of what a tick of the system costs."""
    scenario = load_scenario("whiteboard").model_copy(update={"duration": 1.0})
    scenario._path = load_scenario("whiteboard").path
    run, cost = timed(scenario, 1, "ekf", {})
    tick = 1e6 * run.result["processor_s"] / 1000
    assert 0.1 * tick < cost["arm_step_us"] < 0.9 * tick
    assert cost["arm_step_us"] <= cost["arm_step_p99_us"]
