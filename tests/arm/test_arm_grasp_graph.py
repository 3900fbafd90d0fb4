"""The grasp's graph: domains, search, and learning that never leaves them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from arm.grasping.graph import (
    ACTIONS,
    GOAL,
    RUNNING,
    SEQUENCE,
    STATES,
    Facts,
    Graph,
    Sample,
    prepares,
    safe_actions,
    shortest,
    state_of,
)
from arm.grasping.learning import WORST, greedy, learn, process_of, times_by
from tests.arm.value_iteration import times_of

IN_FRONT = Facts(True, "approach", 0.6, 0.0, 0.0, 0, False)

CHAIN = [
    *[Sample("approach", "reach", "reach", 1.0)] * 3,
    *[Sample("reach", "gm", "contact", 1.0)] * 3,
    *[Sample("contact", "comply", "comply", 1.0)] * 2,
    Sample("contact", "comply", "reach", 1.0),
    *[Sample("approach", "parallel", "comply", 2.0)] * 3,
    *[Sample("comply", "lift", GOAL, 2.0)] * 3,
    *[Sample("front", "close", "approach", 4.0)] * 3,
    *[Sample("far_aside", "close", "approach", 1.0)] * 9,
]
"""A box that parallel lifts sooner; and an unsafe short cut, sampled by whoever dared."""


def test_every_state_has_a_safe_controller_and_the_fixed_sequence_is_safe() -> None:
    """Whoever prunes is never left without anything to do."""
    for state in RUNNING:
        assert SEQUENCE[state] in safe_actions(state)
    assert safe_actions(GOAL) == ()


def test_a_state_is_the_innermost_region_and_else_tells_what_may_be_done() -> None:
    """Touching where nothing should be touched is told apart."""
    assert state_of(IN_FRONT) == "approach"
    assert state_of(Facts(True, "approach", 0.6, 0.0, 0.0, 1, False)) == "touch"
    assert state_of(Facts(True, "comply", 0.6, 0.0, 2.0, 2, True)) == "comply"
    assert state_of(Facts(True, "reach", 0.6, 0.0, 2.0, 1, True)) == "astray"
    assert state_of(Facts(True, "", 2.2, 0.9, 0.0, 0, False)) == "far_aside"
    assert state_of(Facts(True, "", 1.5, 0.0, 0.0, 0, False)) == "front"
    assert state_of(Facts(True, "", 1.0, 0.0, 2.0, 0, False)) == "unstowed"
    assert state_of(Facts(False, "", math.inf, 0.0, 0.0, 0, False)) == "lost"


def test_breadth_first_search_finds_the_fewest_controllers_and_no_unsafe_one() -> None:
    """By parallel rather than by three; not by a short cut outside a domain."""
    graph = Graph.of(CHAIN)
    assert shortest(graph, "front") == [
        ("front", "close"),
        ("approach", "parallel"),
        ("comply", "lift"),
    ]
    assert shortest(graph, "far_aside") is None
    with pytest.raises(ValueError, match="no state 'nowhere'"):
        shortest(graph, "nowhere")


def test_prepares_counts_runs_that_end_where_the_next_may_begin() -> None:
    """Two of three compliances ended where a lift may begin."""
    graph = Graph.of(CHAIN)
    assert prepares(graph, "comply", "lift") == (2, 3)
    assert prepares(graph, "close", "reach") == (3, 3)


def test_value_iteration_is_the_time_worked_out_by_hand() -> None:
    """4 s to the box, 2 s at once, 2 s up; in sequence, comply fails one time in three."""
    process = process_of(Graph.of(CHAIN))
    q = times_of(process)
    assert q[STATES.index("front")].min() == pytest.approx(8.0)
    assert greedy(q)["approach"] == "parallel"
    # from contact: c = 1 + 2/3 * 2 + 1/3 * (1 + c)
    assert times_by(process, SEQUENCE)["contact"] == pytest.approx(4.0)
    assert times_by(process, SEQUENCE)["far_aside"] == WORST


def test_q_learning_finds_the_best_policy_without_one_unsafe_execution() -> None:
    """Whereas one that may choose from all runs most of its controllers outside their domain."""
    process = process_of(Graph.of(CHAIN))
    safe = learn(process, 2000, seed=1)
    free = learn(process, 2000, seed=1, prune=False)
    assert safe.unsafe == 0 and safe.executions > 2000
    assert free.unsafe > 2000
    assert greedy(safe.q) == greedy(times_of(process))
    first, last = np.nanmean(safe.times[:200]), np.nanmean(safe.times[-200:])
    assert last < first


def test_learning_is_the_same_again_by_its_seed() -> None:
    """And another by another."""
    process = process_of(Graph.of(CHAIN))
    assert np.array_equal(learn(process, 50, 3).q, learn(process, 50, 3).q)
    assert not np.array_equal(learn(process, 50, 3).q, learn(process, 50, 4).q)


def test_unsafe_runs_are_not_part_of_the_process() -> None:
    """Whoever sampled them."""
    process = process_of(Graph.of(CHAIN))
    close = list(ACTIONS).index("close")
    assert not process.allowed[STATES.index("far_aside"), close]


def test_an_action_that_changes_nothing_is_no_way_to_wait_for_ever() -> None:
    """Though it takes no time."""
    idle = [Sample("front", "rest", "front", 0.0)] * 5
    process = process_of(Graph.of([*CHAIN, *idle]))
    assert greedy(learn(process, 500, 1).q)["front"] == "close"
