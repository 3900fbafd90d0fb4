"""The grasp's graph as a Markov decision process: what a policy takes, and learning by safe trial.

Minimises the expected time to the goal. Unsafe actions are pruned (Platt et al., section II-A):
the learner never has them to choose from.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from arm.grasping.graph import ACTIONS, GOAL, LOST, RUNNING, STATES, Graph, safe_actions

Policy = Mapping[str, str]
"""The controller of every state that has one."""

PENALTY = 60.0
"""What it costs to lose the box [s]."""
WORST = 120.0
"""No state is taken to be farther from the goal [s]."""


@dataclass(frozen=True)
class Process:
    """A Markov decision process as sampled.

    Attributes:
        leads: P(next state) by state and action, shape (states, actions, states); a row of zeros
            where the action may not be run, or never was.
        seconds: mean time of an action, shape (states, actions) [s].
        allowed: which may be run and were, shape (states, actions).
    """

    leads: np.ndarray
    seconds: np.ndarray
    allowed: np.ndarray


def process_of(graph: Graph, least: int = 1) -> Process:
    """The process of what was sampled inside domains, of actions run at least so often.

    An action that has always led back to where it began is left out: it would be a way to wait for
    nothing, and one that took no time a way to wait for ever.
    """
    shape = len(STATES), len(ACTIONS)
    leads, seconds = np.zeros((*shape, shape[0])), np.zeros(shape)
    allowed = np.zeros(shape, dtype=bool)
    names = list(ACTIONS)
    for i, state in enumerate(STATES):
        for action in graph.known(state, least):
            if graph.leads(state, action).get(state) == 1.0:
                continue
            a = names.index(action)
            for after, p in graph.leads(state, action).items():
                leads[i, a, STATES.index(after)] = p
            seconds[i, a] = graph.seconds(state, action)
            allowed[i, a] = True
    return Process(leads, seconds, allowed)


def times_by(process: Process, policy: Policy, rounds: int = 2000) -> dict[str, float]:
    """Expected time to the goal by a policy, by state [s]; ``WORST`` where it never comes there."""
    value = np.zeros(len(STATES))
    value[STATES.index(LOST)] = PENALTY
    names = list(ACTIONS)
    for _ in range(rounds):
        new = value.copy()
        for state, action in policy.items():
            i, a = STATES.index(state), names.index(action)
            if process.allowed[i, a]:
                new[i] = min(process.seconds[i, a] + process.leads[i, a] @ value, WORST)
            else:
                new[i] = WORST
        value = new
    return {state: float(value[STATES.index(state)]) for state in policy}


def greedy(q: np.ndarray) -> dict[str, str]:
    """The policy of least expected time, for states in which anything is allowed.

    Args:
        q: shape (states, actions) [s], infinite where not allowed.
    """
    names = list(ACTIONS)
    return {
        state: names[int(np.argmin(q[i]))]
        for i, state in enumerate(STATES)
        if state in RUNNING and bool(np.isfinite(q[i]).any())
    }


@dataclass
class Learned:
    """What Q-learning came to.

    Attributes:
        q: expected times, shape (states, actions) [s]; infinite where not allowed.
        executions: controllers run while it learned; unsafe: of those, outside their domain.
        times: of the episodes to the goal, in their order [s]; not a number if it was not reached.
    """

    q: np.ndarray
    executions: int
    unsafe: int
    times: list[float]


def learn(process: Process, episodes: int, seed: int, prune: bool = True) -> Learned:
    """Q-learning with exploration among safe actions only.

    Args:
        process: to draw from; where an action is not allowed it has no effect, and takes 1 s.
        episodes: from a random state each, of 40 controllers at most.
        seed: of everything random.
        prune: unsafe actions are not to be chosen from. False shows what that is good for.

    Raises:
        ValueError: no episodes.
    """
    if episodes < 1:
        raise ValueError(f"{episodes} episodes; there is nothing to learn from")
    rng = np.random.default_rng(seed)
    names = list(ACTIONS)
    safe = np.array([[name in safe_actions(state) for name in names] for state in STATES])
    starts = [i for i, s in enumerate(STATES) if s in RUNNING and process.allowed[i].any()]
    open_ = process.allowed if prune else np.ones_like(process.allowed)
    q = np.where(open_, 0.0, np.inf)  # as if all were near: whatever is untried is tried
    tried = np.zeros(q.shape)
    out = Learned(q, 0, 0, [])
    ends = {STATES.index(GOAL): 0.0, STATES.index(LOST): PENALTY}
    for episode in range(episodes):
        explore = max(0.05, 1.0 - 2.0 * episode / episodes)
        state, took = int(rng.choice(starts)), 0.0
        for _ in range(40):
            choices = np.flatnonzero(open_[state])
            if not len(choices):
                break
            if rng.random() < explore:
                action = int(rng.choice(choices))
            else:
                action = int(np.argmin(q[state]))
            out.executions += 1
            out.unsafe += not safe[state, action]
            if process.allowed[state, action]:
                after = int(rng.choice(len(STATES), p=process.leads[state, action]))
                seconds = float(process.seconds[state, action])
            else:
                after, seconds = state, 1.0
            took += seconds
            rest = ends.get(after)
            least = float(q[after].min()) if rest is None else rest
            target = min(seconds + (least if math.isfinite(least) else WORST), WORST)
            tried[state, action] += 1.0
            q[state, action] += tried[state, action] ** -0.7 * (target - q[state, action])
            state = after
            if rest is not None:
                break
        out.times.append(took if state == STATES.index(GOAL) else math.nan)
    return out
