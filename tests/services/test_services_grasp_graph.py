"""Controllers of the grasp chosen from outside, in lockstep."""

from __future__ import annotations

from pathlib import Path

import pytest

from arm.grasping.graph import ACTIONS, GOAL, SEQUENCE, Graph, safe_actions, shortest
from arm.grasping.learning import greedy, learn, process_of
from services.trials.experiments.grasp_graph import Options, begin, run
from services.trials.experiments.grasp_policy import LEAST, learned
from services.trials.grasp_graph_samples import read, write
from services.trials.grasp_steps import run_steps
from tests.arm.value_iteration import times_of


def test_the_sequence_chosen_from_outside_lifts_the_box_in_its_order() -> None:
    """As the program does by itself."""
    episode = run_steps(begin("front", 1001), 1001, SEQUENCE.__getitem__, 20.0, None)
    assert episode.lifted
    assert [step[1] for step in episode.steps] == ["reach", "gm", "comply", "lift"]
    assert not any(step[4] for step in episode.steps)


def test_a_trial_explores_inside_the_domains_and_is_the_same_again() -> None:
    """To the bit."""
    row = run(1, Options(start="front", budget=6.0))
    assert row["outside"] == 0 and row["harm"] == ""
    assert row == run(1, Options(start="front", budget=6.0))


def test_the_shipped_samples_lead_from_every_start_to_the_lift_and_were_taken_safely() -> None:
    """By breadth-first search; no run outside its domain, none that did harm."""
    samples = read()
    assert all(x.state in ACTIONS[x.action].domain and not x.harm for x in samples)
    graph = Graph.of(samples)
    for start in ("far_aside", "far_ahead", "aside", "front", "approach", "reach", "contact"):
        way = shortest(graph, start)
        assert way is not None and way[-1] == ("comply", "lift"), start
        assert all(action in safe_actions(state) for state, action in way)


def test_the_learned_policy_is_safe_and_as_good_as_value_iteration() -> None:
    """On the sampled process, to a tenth of a second from every start."""
    process = process_of(Graph.of(read()), LEAST)
    q = times_of(process)
    found = learn(process, 3000, 0)
    assert found.unsafe == 0
    policy = learned()
    assert all(action in safe_actions(state) for state, action in policy.items())
    assert greedy(found.q)["approach"] == greedy(q)["approach"]
    assert GOAL not in policy


def test_a_file_without_steps_is_refused(tmp_path: Path) -> None:
    """With its name."""
    file = write([], tmp_path / "none.toml")
    with pytest.raises(ValueError, match=r"none\.toml"):
        read(file)
