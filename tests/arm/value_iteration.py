"""What learning is judged by: the best times of a grasp's graph, by value iteration."""

from __future__ import annotations

import numpy as np

from arm.grasping.graph import GOAL, LOST, STATES
from arm.grasping.learning import PENALTY, WORST, Process


def times_of(process: Process, rounds: int = 400) -> np.ndarray:
    """Expected time to the goal of every allowed action, then on by the best [s].

    Value iteration. Returns shape (states, actions), infinite where not allowed.
    """
    best = np.where([state == LOST for state in STATES], PENALTY, 0.0)
    for _ in range(rounds):
        q = np.where(process.allowed, process.seconds + process.leads @ best, np.inf)
        new = np.minimum(q.min(axis=1), WORST)
        new[[STATES.index(GOAL), STATES.index(LOST)]] = 0.0, PENALTY
        if float(np.abs(new - best).max()) < 1e-9:
            break
        best = new
    return q
