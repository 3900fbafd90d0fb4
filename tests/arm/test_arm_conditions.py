"""Goal regions and domains: what is claimed, what sampled runs say about it."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.stats import binomtest
from typer.testing import CliRunner

from arm.hds import Event, NodeType, Program, check_text, registry
from arm.nodes import REGISTRY
from arm.nodes.conditions import NO_CLAIM, Conditions, State, Values, conditions_of
from deploy.task import BoardPose
from services.cli.main import app
from services.messages import ArmStatus, Truth
from services.programs.control_check import Edge, judge, lower_bound, needed
from services.programs.control_check_sample import Passage, Sample, Watch, scenario_for, varied
from services.programs.control_check_text import render, write_replays
from services.topics import ARM_STATUS, TRUTH
from sim.scenario import load_scenario


def state(z: float = 0.0, force: float = 0.0, reach: float = 0.2, **fields: float) -> State:
    """A state with the tip ``z`` [m] in front of board and origin."""
    tip = np.array([fields.get("x", 0.0), fields.get("y", 0.0), z])
    return State(tip, z, force, 0.5, reach, np.zeros(3))


# --- synthetic types with a known answer ------------------------------------------------------


class Wide:
    """Its goal is the first 10 mm."""

    def __init__(self, values: Values) -> None: ...

    conditions = Conditions(
        goal=lambda s, v: {"height": 1.0 - abs(s.clearance) / 0.01},
        domain=lambda s, v: {"height": 1.0 - abs(s.clearance) / 0.02},
    )


class Inside(Wide):
    """Its goal is the first 5 mm, its domain all of the goal of ``Wide``."""

    conditions = Conditions(
        goal=lambda s, v: {"height": 1.0 - abs(s.clearance) / 0.005},
        domain=Wide.conditions.domain,
    )


class Narrow(Wide):
    """Its domain ends 8 mm away, within the goal of ``Wide``."""

    conditions = Conditions(
        goal=Wide.conditions.goal,
        domain=lambda s, v: {"height": 1.0 - abs(s.clearance) / 0.008},
    )


class Silent:
    """Says nothing."""

    def __init__(self, values: Values) -> None: ...


FINISHED = (Event("Finished"), Event("Lost"))
TYPES = registry(
    *(NodeType(c.__name__, events=FINISHED, make=c) for c in (Wide, Inside, Narrow, Silent))
)


def pair(second: str) -> Program:
    """``A`` of type Wide, then ``B``."""
    text = "INTERFACE = r1; INITIAL = A;"
    for name, kind, target in (("A", "Wide", "B"), ("B", second, "End")):
        text += f"BEGIN NAME = {name}; TYPE = {kind}; TRANSITION[Finished] = {target};"
        text += "TRANSITION[Lost] = End; END "
    made, findings = check_text(text, "test.hds", TYPES)
    assert made is not None, findings
    return made


def run(seed: int, first: float, second: float, event: str = "Finished") -> Sample:
    """A run that left A at height ``first`` and B at ``second`` [m]."""
    a = Passage(1.0, "A", "Finished", "B", state(first))
    return Sample(seed, (a, Passage(2.0, "B", event, "End", state(second))), "finished")


def edge(second: str, samples: Iterable[Sample]) -> Edge:
    """What is found about A to B."""
    return judge(pair(second), TYPES, samples).edges[0]


def heights(n: int) -> list[float]:
    """In the goal region of Wide [m]."""
    return np.random.default_rng(0).uniform(0.0, 0.0099, n).tolist()


def test_a_goal_within_the_domain_prepares_and_refines() -> None:
    """All of Wide's goal is in the domain of Inside, whose goal is in Wide's."""
    found = judge(pair("Inside"), TYPES, [run(i, z, 0.4 * z) for i, z in enumerate(heights(40))])
    first = found.edges[0]
    assert (first.verdict, first.refines, first.inside) == ("prepares", "refines", 40)
    assert first.in_goal == first.went_on == first.judged == first.kept == 40
    assert found.chains == [["A", "B"]] and not found.failed


def test_a_goal_that_leaves_the_domain_fails_with_its_worst_counter_example() -> None:
    """Of Wide's goal a fifth is outside the domain of Narrow."""
    z = heights(200)
    found = edge("Narrow", [run(1000 + i, h, h) for i, h in enumerate(z)])
    outside = sum(h > 0.008 for h in z)
    assert outside and found.inside == 200 - outside
    assert found.verdict == "fails" and found.refines == "no"
    assert found.worst is not None and found.worst.seed == 1000 + int(np.argmax(z))
    assert found.worst.margin == pytest.approx(1.0 - max(z) / 0.008)
    assert found.share == pytest.approx(0.8, abs=0.08)
    assert found.bound is not None and found.bound < found.inside / 200


def test_prepares_is_not_refines() -> None:
    """The second node leaves the goal of the first: said with the state that does."""
    found = edge("Inside", [run(i, z, 0.011 if i == 7 else z) for i, z in enumerate(heights(40))])
    assert (found.verdict, found.refines, found.kept) == ("prepares", "no", 39)
    assert found.broken is not None and found.broken.seed == 7


def test_few_samples_and_silent_types_get_no_verdict() -> None:
    """Without counter-example 29 runs are needed for a bound of 0.9."""
    assert edge("Inside", [run(i, 0.0, 0.0) for i in range(28)]).verdict == "too few"
    assert edge("Inside", [run(i, 0.0, 0.0) for i in range(29)]).verdict == "prepares"
    assert edge("Inside", []).verdict == "too few"
    assert needed() == 29
    silent = edge("Silent", [run(i, 0.0, 0.0) for i in range(40)])
    assert (silent.verdict, silent.refines, silent.judged) == ("no claim", "no claim", 0)


def test_what_is_missing_for_a_verdict_is_said() -> None:
    """How many runs there should be, from how many of these took the transition."""
    few = judge(pair("Inside"), TYPES, [run(i, 0.0, 0.0) for i in range(10)])
    assert few.edges[0].lacking == 19
    said = render(few, {})
    assert "too few runs; --samples 29 may be enough for: A -[Finished]-> B" in said
    assert "A -[Lost]-> End" not in said.split("bound of", 1)[1]  # End claims nothing
    none = judge(pair("Inside"), TYPES, [])
    assert "no run took, so nothing is known of: A -[Finished]-> B" in render(none, {})


def test_a_target_that_does_not_come_to_its_event_is_told() -> None:
    """By another event, or because it was stopped; unknown where the time was over."""
    stopped = Sample(5, run(5, 0.0, 0.0).passages[:1], "protective_stop: force limit")
    late = Sample(6, run(6, 0.0, 0.0).passages[:1], "time")
    found = edge("Inside", [run(3, 0.0, 0.0), run(4, 0.0, 0.0, "Lost"), stopped, late])
    assert (found.samples, found.judged, found.went_on, found.stuck) == (4, 3, 1, 4)


def test_of_several_times_in_a_run_the_worst_counts() -> None:
    """States of one run are not independent samples."""
    twice = Sample(0, (*run(0, 0.0, 0.0).passages, *run(0, 0.009, 0.0).passages), "finished")
    found = edge("Narrow", [twice])
    assert (found.samples, found.inside) == (1, 0)


@pytest.mark.parametrize(("k", "n"), [(0, 5), (1, 5), (5, 5), (29, 29), (180, 200)])
def test_bound_is_clopper_pearson(k: int, n: int) -> None:
    """As scipy has it."""
    exact = binomtest(k, n, alternative="greater").proportion_ci(0.95, method="exact")
    assert lower_bound(k, n) == pytest.approx(exact.low, abs=1e-12)


# --- the arm's types --------------------------------------------------------------------------


def values(**given: float) -> Values:
    """Parameters of a node of any of the types below [SI]."""
    stay = float("inf")
    return {"X": stay, "Y": stay, "Z": stay, "Force": 1.5, "FGain": 0.02, **given}


@pytest.mark.parametrize(
    ("kind", "at", "given", "inside"),
    [
        ("Goto_pose", state(0.02), {}, True),
        ("Goto_pose", state(0.0, 1.5), {"Z": 0.03}, True),
        ("Goto_pose", state(0.0, 1.5), {"Z": 0.03, "X": 0.2}, False),
        ("Retract", state(0.0, 1.5), {}, True),
        ("Retract", state(0.0, 1.5, reach=-0.01), {}, False),
        ("Whiteboard_approach", state(0.02), {}, True),
        ("Whiteboard_approach", state(-0.001, 1.0), {}, False),
        ("Whiteboard_line", state(-0.001, 2.0), {}, True),
        ("Whiteboard_line", state(0.02), {}, False),
        ("Hold", state(-0.001, 2.0), {}, False),
    ],
)
def test_domains(kind: str, at: State, given: dict[str, float], inside: bool) -> None:
    """As the docstrings say."""
    assert conditions_of(REGISTRY[kind]).in_domain(at, values(**given)) is inside


def test_goals() -> None:
    """A line ends where it ends, pressed; what a type does not claim is None."""
    line, given = conditions_of(REGISTRY["Whiteboard_line"]), values(Length=0.05, Direction=0.0)
    assert line.in_goal(state(-0.001, 1.5, x=0.05), given)
    assert not line.in_goal(state(-0.001, 1.5, x=0.02), given)
    assert not line.in_goal(state(0.001, 0.0, x=0.05), given)
    assert conditions_of(TYPES["Silent"]).in_goal(state(), values()) is None
    assert conditions_of(TYPES["Silent"]) is NO_CLAIM


@pytest.mark.parametrize(
    ("kind", "given", "there", "away"),
    [
        (
            "Goto_ground",
            {"X": 0.5, "Y": 0.1, "Z": 1.3},
            {"ground": (0.5, 0.1, 1.3)},
            {"ground": (0.5, 0, 1)},
        ),
        ("Goto_ground", {}, {"entered_ground": (0, 0, 0)}, {"ground": (0, 0.01, 0)}),
        # 0.6 m ahead of a platform at (1, 2) that faces +y is (1, 2.6)
        (
            "Goto_platform",
            {"X": 0.6, "Y": 0.0, "Z": 1.2},
            {"ground": (1, 2.6, 1.2), "platform": (1, 2, np.pi / 2)},
            {"ground": (1, 2.6, 1.2), "platform": (1, 2, 0)},
        ),
        # what is not given stays as it was aboard, wherever the platform went meanwhile
        (
            "Goto_platform",
            {"Z": 1.2},
            {
                "ground": (1, 2.6, 1.2),
                "platform": (1, 2, np.pi / 2),
                "entered_ground": (0.6, 0, 1),
            },
            {"ground": (0.6, 0, 1.2), "platform": (1, 2, 0), "entered_ground": (0.6, 0, 1)},
        ),
        (
            "Drive_to",
            {"X": 1.0, "Y": 2.0, "Heading": np.pi},
            {"platform": (1.01, 2, -3.13)},
            {"platform": (1.03, 2, np.pi)},
        ),
        ("Guarded_move", {}, {"force": 1.5}, {"force": 0.3}),
    ],
)
def test_goals_in_other_frames(
    kind: str, given: dict[str, float], there: dict[str, Any], away: dict[str, Any]
) -> None:
    """Of the ground, the platform, and of what is touched."""
    claim = conditions_of(REGISTRY[kind])

    def at(fields: dict[str, Any]) -> State:
        arrays = {k: np.array(v, dtype=float) if np.ndim(v) else v for k, v in fields.items()}
        return replace(state(), **arrays)

    assert claim.in_goal(at(there), values(**given)) is True
    assert claim.in_goal(at(away), values(**given)) is False


def test_what_is_watched_is_where_pen_and_platform_truly_are() -> None:
    """The board is 10 mm further than believed: the pen on it is behind the believed one."""
    watch = Watch(BoardPose(x=0.71), BoardPose(x=0.70))
    zero = dict.fromkeys(("velocity", "acceleration"), np.zeros(3)) | {
        "q": np.zeros(6),
        "qd": np.zeros(6),
    }
    for i, x in enumerate((0.0, 0.1)):
        pose = np.array([x, 0.0, 0.0])
        watch(TRUTH, Truth(t=0.0, pose=pose, tip=np.array([0.0, 0.2, 0.0]), force=1.0, **zero), 0.0)
        watch(ARM_STATUS, ArmStatus(t=0.0, state="running", node="AB"[i], transitions=i), 0.0)
    (passage,) = watch.passages
    np.testing.assert_allclose(passage.state.tip, (0.0, 0.2, -0.01), atol=1e-12)
    np.testing.assert_allclose(passage.state.at("ground"), (0.71, 0.0, 1.5), atol=1e-12)
    np.testing.assert_allclose(passage.state.at("platform"), (0.61, 0.0, 1.5), atol=1e-12)
    np.testing.assert_allclose(passage.state.entered_at("platform"), (0.71, 0.0, 1.5), atol=1e-12)


def test_every_type_of_the_arm_claims_a_goal_region_and_a_domain() -> None:
    """And its good events are events of it."""
    for kind in REGISTRY.values():
        if not kind.terminal:
            claim = conditions_of(kind)
            assert claim.goal is not None and claim.domain is not None, kind.name
            assert claim.good and {e.name for e in kind.events} >= set(claim.good), kind.name


# --- a real program ---------------------------------------------------------------------------

IN_THE_AIR = """
INTERFACE = r1; INITIAL = Over;
BEGIN NAME = Over; TYPE = Hold; Time = 50 ms; TRANSITION[Timeout] = Line; END
BEGIN NAME = Line; TYPE = Whiteboard_line; Length = 2; Direction = 0;
      TRANSITION[Finished] = Off; END
BEGIN NAME = Off; TYPE = Retract; Distance = 5; TRANSITION[Finished] = End; END
"""


def test_a_line_begun_in_the_air_is_found_and_can_be_replayed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two runs from the shell; the scenario written is the one that was run."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "air.hds").write_text(IN_THE_AIR)
    command = ["program", "check", "--control", "air.hds", "--samples", "2", "--seed", "3"]
    result = CliRunner().invoke(app, [*command, "--json"])
    assert result.exit_code == 1, result.output
    said = json.loads(result.stdout)["control"]["air.hds"]
    first, second, _ = said["transitions"]
    assert (first["verdict"], first["worst"]["of"]) == ("fails", "on the board")
    assert second["verdict"] == "too few" and second["inside"] == second["samples"] == 2
    seed = first["worst"]["seed"]
    replay = said["replays"][str(seed)].split()
    assert replay[:2] == ["steadyhand", "run"] and replay[3:] == ["--seed", str(seed)]
    written = load_scenario(tmp_path / replay[2])
    meant = varied(scenario_for(tmp_path / "air.hds"), seed)
    assert written.model_dump() == meant.model_dump()


@pytest.mark.parametrize("name", ["whiteboard_bumps", "whiteboard_push", "whiteboard_moving"])
def test_written_scenarios_are_read_back(name: str, tmp_path: Path) -> None:
    """With paths and disturbances; a variation follows from its seed alone."""
    scenario = load_scenario(name)
    assert varied(scenario, 4) == varied(scenario, 4) != varied(scenario, 5)
    report = judge(pair("Narrow"), TYPES, [run(4, 0.009, 0.009)])
    files = write_replays(report, scenario, tmp_path)
    assert load_scenario(files[4]).model_dump() == varied(scenario, 4).model_dump()
    text = render(report, files)
    assert f"steadyhand run {files[4]} --seed 4" in text and "no proof" in text
