"""The grasp as a graph: discrete states, controllers with domains, what leads where as sampled.

A state says in which goal regions the robot is, and coarsely where it is if in none. A controller
may be run where its stated domain has the state (Platt et al., Eq 1: all else is unsafe, and pruned
from the decision process, section II-A). Where it leads is sampled.
"""

from __future__ import annotations

import math
from collections import defaultdict, deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

GOAL, LOST = "lifted", "lost"
STATES = (
    "far_aside",
    "far_ahead",
    "aside",
    "front",
    "unstowed",
    "near",
    "astray",
    "touch",
    "approach",
    "reach",
    "contact",
    "comply",
    GOAL,
    LOST,
)
"""From 1.8 m on, off or on the way to come at the box; nearer, so too; arms not at rest; too near
to drive there, arms free; the same, touching; before the box and touching, or not; the four goal
regions."""

DRIVABLE = frozenset({"far_aside", "far_ahead", "aside", "front"})
FAR, NEAR = 1.8, 0.9
"""Of the box [m]."""
AHEAD, CORRIDOR = 0.45, 0.15
"""Off the box's own axis, as seen from the box: far, and before it [rad]."""
STOWED = 0.6
"""Joints this near to their posture at rest do not touch anything when the platform turns [rad]."""


@dataclass(frozen=True)
class Action:
    """A controller as an action.

    Attributes:
        node: of ``grasp_actions.hds``.
        domain: states it may be run in.
        through: states it may pass, besides those, without being thrown out.
        limit: it is given up after this [s].
    """

    node: str
    domain: frozenset[str]
    through: frozenset[str]
    limit: float


def _action(node: str, domain: Iterable[str], through: Iterable[str], limit: float) -> Action:
    return Action(node, frozenset(domain), frozenset(through), limit)


_DRIVE = DRIVABLE | {"near", "approach", "unstowed"}
ACTIONS: Mapping[str, Action] = {
    "towards": _action("Towards", {"far_aside", "far_ahead"}, _DRIVE, 15.0),
    "in_front": _action("In_front", DRIVABLE, _DRIVE, 15.0),
    "close": _action("Close", {"far_ahead", "front"}, _DRIVE, 15.0),
    "rest": _action("Rest", DRIVABLE | {"unstowed"}, (), 6.0),
    "back": _action("Back_off", {"near", "approach"}, _DRIVE, 10.0),
    "open": _action(
        "Open", {"astray", "touch", "reach", "contact", "comply"}, {"approach", "near"}, 3.0
    ),
    "reach": _action("Reach", {"approach", "touch"}, (), 8.0),
    "gm": _action("Guarded_move", {"reach"}, (), 8.0),
    "comply": _action("Comply", {"contact"}, (), 8.0),
    "parallel": _action(
        "Parallel", {"approach", "reach", "contact"}, {"touch", "approach", "reach", "contact"}, 8.0
    ),
    "lift": _action("Lift", {"comply"}, {"reach", "contact"}, 10.0),
}
SEQUENCE: Mapping[str, str] = {
    "far_aside": "towards",
    "far_ahead": "towards",
    "aside": "in_front",
    "front": "close",
    "unstowed": "rest",
    "near": "back",
    "astray": "open",
    "touch": "reach",
    "approach": "reach",
    "reach": "gm",
    "contact": "comply",
    "comply": "lift",
}
"""Table III with its ways back, as ``move_to_grasp.hds`` has it: the fixed sequence."""
RUNNING = tuple(SEQUENCE)
"""States in which there is something to decide."""


@dataclass(frozen=True)
class Facts:
    """What tells the state, all of it believed, not true.

    Attributes:
        seen: the box is known.
        regions: the innermost goal region, empty if in none.
        distance: of the box from the platform's middle [m].
        angle: off the way to come at the box (``BoxPlace.approach``), as seen from it [rad].
        unstowed: of the joint farthest from its posture at rest [rad].
        touching: palms that touch.
        held: the box is off the table.
    """

    seen: bool
    regions: str
    distance: float
    angle: float
    unstowed: float
    touching: int
    held: bool


def state_of(facts: Facts) -> str:
    """The discrete state; ``GOAL`` is not told by facts but by the lift's own event."""
    if not facts.seen:
        return LOST
    if facts.held and facts.touching < 2:
        return "astray"
    if facts.regions in ("reach", "contact", "comply"):
        return facts.regions
    if facts.regions == "approach":
        return "touch" if facts.touching else "approach"
    if facts.touching:
        return "astray"
    if facts.distance < NEAR:
        return "near"
    if facts.unstowed > STOWED:
        return "unstowed"
    if facts.distance >= FAR:
        return "far_ahead" if facts.angle <= AHEAD else "far_aside"
    return "front" if facts.angle <= CORRIDOR else "aside"


def safe_actions(state: str) -> tuple[str, ...]:
    """Controllers whose domain has the state, in the order of ``ACTIONS``."""
    return tuple(name for name, action in ACTIONS.items() if state in action.domain)


@dataclass(frozen=True)
class Sample:
    """A controller run once: from where, to where, how long [s], and whether it did harm."""

    state: str
    action: str
    next: str
    seconds: float
    harm: bool = False


@dataclass
class Graph:
    """What was sampled, by state and action."""

    runs: dict[tuple[str, str], list[Sample]] = field(default_factory=lambda: defaultdict(list))

    @classmethod
    def of(cls, samples: Iterable[Sample]) -> Graph:
        """From samples, in their order."""
        graph = cls()
        for sample in samples:
            graph.runs[sample.state, sample.action].append(sample)
        return graph

    def leads(self, state: str, action: str) -> dict[str, float]:
        """Share of the runs that ended in each state; empty if there are none."""
        runs = self.runs.get((state, action), [])
        ends = [run.next for run in runs]
        return {s: ends.count(s) / len(ends) for s in STATES if s in ends}

    def seconds(self, state: str, action: str) -> float:
        """Mean time of a run [s]; not a number if there is none."""
        runs = self.runs.get((state, action), [])
        return sum(run.seconds for run in runs) / len(runs) if runs else math.nan

    def known(self, state: str, least: int = 1) -> tuple[str, ...]:
        """Safe actions that were run there at least so often."""
        return tuple(
            a for a in safe_actions(state) if len(self.runs.get((state, a), [])) >= max(least, 1)
        )


def prepares(graph: Graph, first: str, then: str) -> tuple[int, int]:
    """How often a run of ``first`` from its domain ended in the domain of ``then``, of how many.

    Eq 1, sampled: a run prepares what comes next if it ends where that may begin.

    Raises:
        KeyError: there is no such controller.
    """
    ends = [
        run.next
        for (state, action), runs in graph.runs.items()
        if action == first and state in ACTIONS[first].domain
        for run in runs
    ]
    return sum(end in ACTIONS[then].domain for end in ends), len(ends)


def shortest(
    graph: Graph, start: str, goal: str = GOAL, share: float = 0.5, least: int = 2
) -> list[tuple[str, str]] | None:
    """Breadth-first search for the fewest controllers from a state to the goal.

    Args:
        graph: as sampled.
        start: a state.
        goal: another.
        share: an edge is a way only if at least this share of its runs took it [1].
        least: and it was run at least so often.

    Returns:
        State and action, in order; None if there is no way.

    Raises:
        ValueError: no such state.
    """
    for name in (start, goal):
        if name not in STATES:
            raise ValueError(f"no state {name!r}; there are: {', '.join(STATES)}")
    came: dict[str, tuple[str, str] | None] = {start: None}
    queue = deque([start])
    while queue:
        state = queue.popleft()
        if state == goal:
            way: list[tuple[str, str]] = []
            step = came[state]
            while step is not None:
                way.insert(0, step)
                step = came[step[0]]
            return way
        for action in graph.known(state, least):
            for after, p in graph.leads(state, action).items():
                if p >= share and after not in came:
                    came[after] = (state, action)
                    queue.append(after)
    return None
