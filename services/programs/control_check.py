"""Whether transitions prepare and refine, judged from sampled runs.

The states at the transitions of each run (``control_check_sample``) are held against the domain
that the target's type claims and the goal region the source's type claims
(``arm/nodes/conditions.py``). Nothing is proved: what is found outside is a counter-example, what
is not found has a lower bound.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, Literal

from arm.hds import NodeType, Program
from arm.nodes.conditions import conditions_of, worst
from services.programs.control_check_sample import Sample

CONFIDENCE = 0.95
"""Of the one-sided Clopper-Pearson bounds."""
ENOUGH = 0.9
"""A transition without counter-example prepares if its bound is at least this."""
Verdict = Literal["prepares", "fails", "too few", "no claim"]
Refines = Literal["refines", "no", "too few", "no claim"]


@dataclass(frozen=True)
class Worst:
    """The state nearest to the edge of a region, or furthest outside."""

    seed: int
    margin: float
    of: str
    t: float


@dataclass
class Edge:
    """What was found about a transition.

    Attributes:
        samples: runs that took it; of several times in one run the worst counts.
        inside: of these, runs in which every state was in the target's domain.
        bound: lower bound of the share inside; None without samples or claim.
        verdict: on *prepares*.
        worst: smallest margin to the target's domain.
        in_goal: runs in which every state was in the source's goal region; None if the event is
            not the good one, or nothing is claimed.
        judged: runs in which it was seen how the target ended.
        went_on: of these, runs in which it always ended with a good event.
        stuck: a seed of a run in which it did not, None if there is none.
        kept: runs in which the state at the target's good event was still in the source's goal.
        kept_of: runs in which the target came to its good event.
        refines: verdict on *refines*.
        broken: smallest margin to the source's goal at the target's good event.
    """

    source: str
    event: str
    target: str
    samples: int = 0
    inside: int = 0
    bound: float | None = None
    verdict: Verdict = "too few"
    worst: Worst | None = None
    in_goal: int | None = None
    judged: int = 0
    went_on: int = 0
    stuck: int | None = None
    kept: int = 0
    kept_of: int = 0
    refines: Refines = "no claim"
    broken: Worst | None = None

    @property
    def share(self) -> float | None:
        """Share inside."""
        return self.inside / self.samples if self.samples else None

    @property
    def lacking(self) -> int:
        """Runs without counter-example that are still missing for a verdict on *prepares*."""
        return needed() - self.samples if self.verdict == "too few" else 0


@dataclass
class Report:
    """Every transition of a program, and what became of the runs."""

    edges: list[Edge]
    ends: dict[int, str] = field(default_factory=dict)

    @property
    def chains(self) -> list[list[str]]:
        """Longest chains of nodes each of which refines the one before it."""
        after = {e.source: e.target for e in self.edges if e.refines == "refines"}
        heads = [node for node in after if node not in after.values()]
        chains = []
        for head in heads:
            chain = [head]
            while (node := after.get(chain[-1])) is not None and node not in chain:
                chain.append(node)
            chains.append(chain)
        return chains

    @property
    def failed(self) -> list[Edge]:
        """Transitions with a counter-example to *prepares*."""
        return [edge for edge in self.edges if edge.verdict == "fails"]

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        edges = [asdict(edge) | {"share": edge.share} for edge in self.edges]
        return {"transitions": edges, "chains": self.chains, "runs": self.ends}


def lower_bound(inside: int, samples: int, confidence: float = CONFIDENCE) -> float:
    """One-sided lower Clopper-Pearson bound of a share."""
    from scipy.special import betaincinv  # takes a while to import

    if inside == 0:
        return 0.0
    return float(betaincinv(inside, samples - inside + 1, 1.0 - confidence))


def needed() -> int:
    """The least number of runs, all inside, for which the bound is ``ENOUGH``."""
    return math.ceil(math.log(1.0 - CONFIDENCE) / math.log(ENOUGH))


def judge(program: Program, types: Mapping[str, NodeType], samples: Iterable[Sample]) -> Report:
    """Hold sampled runs against what the types of a program claim."""
    report = Report([])
    edges: dict[tuple[str, str, str], Edge] = {}
    for node in program.nodes.values():
        ways = [*node.transitions.items(), *((g.text, g.target) for g in node.guards)]
        for event, target in ways:
            edges[node.name, event, target] = Edge(node.name, event, target)
    taken: dict[tuple[str, str, str], list[tuple[Sample, list[int]]]] = {}
    for sample in samples:
        report.ends[sample.seed] = sample.end
        mine: dict[tuple[str, str, str], list[int]] = {}
        for i, p in enumerate(sample.passages):
            mine.setdefault((p.source, p.event, p.target), []).append(i)
        for key, at in mine.items():
            taken.setdefault(key, []).append((sample, at))
    report.edges = list(edges.values())
    for key, edge in edges.items():
        _judge_edge(edge, program, types, taken.get(key, []))
    return report


def _judge_edge(
    edge: Edge,
    program: Program,
    types: Mapping[str, NodeType],
    taken: list[tuple[Sample, list[int]]],
) -> None:
    """Fill in what the runs say about a transition."""
    source, target = program.node(edge.source), program.node(edge.target)
    ours, theirs = conditions_of(types[source.type]), conditions_of(types[target.type])
    good = edge.event in ours.good and ours.goal is not None
    left = {guard.text for guard in target.guards}  # the program's way out, not the type's
    edge.samples = len(taken)
    edge.in_goal = 0 if good else None
    for sample, at in taken:
        in_domain = in_goal = kept = on = True
        reached = seen = False
        for i in at:
            passage = sample.passages[i]
            if theirs.domain is not None:
                margin, of = worst(theirs.domain(passage.state, target.parameters))
                in_domain &= margin >= 0.0
                edge.worst = _smaller(edge.worst, sample.seed, margin, of, passage.t)
            in_goal &= not good or bool(ours.in_goal(passage.state, source.parameters))
            event = _next_event(sample, i)
            if event is None or not theirs.good or event in left:
                continue
            seen = True
            on &= event in theirs.good
            if event in theirs.good and good and ours.goal is not None:
                reached = True
                after = sample.passages[i + 1]
                # the source's goal may speak of where the source was entered
                state = after.state.since(passage.state)
                margin, of = worst(ours.goal(state, source.parameters))
                kept &= margin >= 0.0
                edge.broken = _smaller(edge.broken, sample.seed, margin, of, after.t)
        edge.inside += in_domain
        edge.in_goal = None if edge.in_goal is None else edge.in_goal + in_goal
        edge.judged += seen
        edge.went_on += seen and on
        if seen and not on and edge.stuck is None:
            edge.stuck = sample.seed
        edge.kept_of += reached
        edge.kept += reached and kept
    if theirs.domain is None:
        edge.verdict, edge.inside = "no claim", 0
        return
    edge.bound = lower_bound(edge.inside, edge.samples) if edge.samples else None
    edge.verdict = _verdict(edge.inside, edge.samples, "prepares")
    if good and theirs.good:
        kept = _verdict(edge.kept, edge.kept_of, "refines")
        if "fails" in (kept, edge.verdict):
            edge.refines = "no"
        else:
            edge.refines = (
                "refines" if edge.verdict == "prepares" and kept == "refines" else "too few"
            )


def _smaller(old: Worst | None, seed: int, margin: float, of: str, t: float) -> Worst:
    return old if old is not None and old.margin <= margin else Worst(seed, margin, of, t)


def _verdict(inside: int, samples: int, word: Any) -> Any:
    if inside < samples:
        return "fails"
    return word if samples and lower_bound(inside, samples) >= ENOUGH else "too few"


def _next_event(sample: Sample, i: int) -> str | None:
    """What the node entered by a passage ended with; empty if it was stopped, None if not seen."""
    if i + 1 < len(sample.passages):
        return sample.passages[i + 1].event
    return None if sample.end == "time" else ""
