"""Whether transitions prepare and refine, estimated from sampled runs in lockstep.

A run under variations drawn from its seed records the state at every transition. Each state is
held against the domain that the target's type claims and the goal region the source's type claims
(``arm/nodes/conditions.py``). Nothing is proved: what is found outside is a counter-example, what
is not found has a lower bound.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np

from arm.hds import NodeType, Program
from arm.nodes.conditions import State, conditions_of, worst
from deploy.task import BoardPose
from services.components import build_service
from services.lockstep import TICK, Lockstep
from services.messages import ArmStatus, Message, Truth
from services.run import without_collector
from services.topics import ARM_STATUS, SERVICES, TRUTH, Topic
from sim.scenario import SCENARIOS, Scenario, load_scenario

CONFIDENCE = 0.95
"""Of the one-sided Clopper-Pearson bounds."""
ENOUGH = 0.9
"""A transition without counter-example prepares if its bound is at least this."""
START = (0.02, 0.02, math.radians(1.0))
"""Most that the platform starts elsewhere than the scenario says: x, y [m], heading [rad]."""
BOARD = (0.005, 0.005, 0.005, math.radians(0.5))
"""Most that the board is elsewhere than the scenario says: x, y, z [m], yaw [rad]."""
SHIFT = 0.5
"""Most that a disturbance comes earlier or later [s]."""
OVER = ("safe_hold", "protective_stop", "idle")
"""States of the arm in which a program that ran has been given up."""

Verdict = Literal["prepares", "fails", "too few", "no claim"]
Refines = Literal["refines", "no", "too few", "no claim"]


@dataclass(frozen=True)
class Passage:
    """One transition of a run, with the state when it was taken."""

    t: float
    source: str
    event: str
    target: str
    state: State


@dataclass(frozen=True)
class Sample:
    """A run: its transitions in order, and how it ended.

    Attributes:
        seed: that replays it.
        passages: transitions in the order they were taken.
        end: ``finished``, ``time`` when its time was over, or what stopped it.
    """

    seed: int
    passages: tuple[Passage, ...]
    end: str


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


# --- judging --------------------------------------------------------------------------------


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
                state = State(**(vars(after.state) | {"entered": passage.state.entered}))
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


# --- sampling -------------------------------------------------------------------------------


def varied(scenario: Scenario, seed: int) -> Scenario:
    """The scenario with platform start, board and disturbances' times varied by a seed.

    The truth is varied, what the controllers believe stays. The mismatch of the simulated robot
    and the noise of the sensors follow the seed of the run.
    """
    rng = np.random.default_rng([seed, 0xC0])
    world = scenario.world
    start = np.array(world.platform_start) + rng.uniform(-1.0, 1.0, 3) * START
    keys = ("x", "y", "z", "yaw")
    moved = rng.uniform(-1.0, 1.0, 4) * BOARD
    board = {k: getattr(world.board, k) + float(d) for k, d in zip(keys, moved, strict=True)}
    shifted = tuple(
        d.model_copy(update={"t": max(d.t + float(rng.uniform(-SHIFT, SHIFT)), 0.0)})
        for d in scenario.disturbance
    )
    truth = world.model_copy(
        update={
            "platform_start": tuple(start.tolist()),
            "board": world.board.model_copy(update=board),
        }
    )
    return scenario.model_copy(update={"world": truth, "disturbance": shifted})


def scenario_for(program: Path, name: str | None = None) -> Scenario:
    """A scenario with its program replaced: the named one, or the first that runs the program.

    Raises:
        BadFile: there is no such scenario.
    """
    if name is None:
        known = {load_scenario(p).task.program: p.stem for p in sorted(SCENARIOS.glob("*.toml"))}
        name = known.get(program.name, "whiteboard")
    scenario = load_scenario(name)
    task = scenario.task.model_copy(update={"program": str(program.resolve()), "autostart": True})
    return scenario.model_copy(update={"task": task})


def sample(scenario: Scenario, seed: int, observer: str = "ekf") -> Sample:
    """Run a scenario, varied by the seed, and record its transitions."""
    scenario = varied(scenario, seed)
    watch = Watch(scenario.world.board, scenario.task.board)
    services = [build_service(name, scenario, seed, observer) for name in SERVICES]
    lockstep = Lockstep(services, listener=watch)
    limit = round(scenario.duration / TICK)
    try:
        with without_collector():
            while lockstep.tick < limit and not watch.end:
                lockstep.step()
    except ValueError as error:  # the program was refused
        return Sample(seed, tuple(watch.passages), f"refused: {error}")
    return Sample(seed, tuple(watch.passages), watch.end or "time")


class Watch:
    """Listens to a run and notes the state at every transition.

    Args:
        true: where the board is, X_WS.
        believed: where the controllers take it to be, X_OS.
    """

    def __init__(self, true: BoardPose, believed: BoardPose) -> None:
        self._R = believed.rotation().T @ true.rotation()
        self._p = believed.rotation().T @ (true.position() - believed.position())
        self._truth: Truth | None = None
        self._node = ""
        self._transitions = 0
        self._entered = np.zeros(3)
        self.passages: list[Passage] = []
        self.end = ""

    def __call__(self, topic: Topic, message: Message, now: float) -> None:
        """Hear a message."""
        if topic is TRUTH and isinstance(message, Truth):
            self._truth = message
        elif topic is ARM_STATUS and isinstance(message, ArmStatus):
            self._hear(message, now)

    def _hear(self, status: ArmStatus, now: float) -> None:
        if status.transitions > self._transitions:
            state = self._state(status)
            passage = Passage(now, self._node, status.event, status.node, state)
            self.passages.append(passage)
            self._entered = state.tip
        elif status.node and not self._node:
            self._entered = self._state(status).tip
        self._transitions = status.transitions
        self._node = status.node or self._node
        if status.state == "finished":
            self.end = "finished"
        elif status.state in OVER and self._node:
            self.end = f"{status.state}: {status.reason}"

    def _state(self, status: ArmStatus) -> State:
        assert self._truth is not None  # the simulation speaks first
        tip = self._R @ self._truth.tip + self._p
        return State(
            tip=tip,
            clearance=float(self._truth.tip[2]),
            force=self._truth.force,
            joint_margin=status.joint_margin,
            reach_margin=status.reach_margin,
            entered=self._entered,
        )


def sample_many(
    scenario: Scenario, seeds: Iterable[int], observer: str = "ekf", workers: int = 1
) -> Iterator[Sample]:
    """Runs for several seeds as they come, in this process or in several."""
    seeds = list(seeds)
    if workers <= 1 or len(seeds) <= 1:
        for seed in seeds:
            yield sample(scenario, seed, observer)
        return
    with ProcessPoolExecutor(max_workers=min(workers, len(seeds))) as pool:
        n = len(seeds)
        yield from pool.map(sample, [scenario] * n, seeds, [observer] * n)


# --- for people -----------------------------------------------------------------------------


def write_replays(report: Report, scenario: Scenario, folder: Path) -> dict[int, Path]:
    """Write the scenario of every worst counter-example, for ``steadyhand run FILE --seed S``.

    Returns:
        the file by seed.
    """
    seeds = {e.worst.seed for e in report.failed if e.worst is not None}
    seeds |= {e.stuck for e in report.edges if e.stuck is not None}
    files = {}
    for seed in sorted(seeds):
        folder.mkdir(parents=True, exist_ok=True)
        file = folder / f"{Path(scenario.task.program).stem}-{seed}.toml"
        data = varied(scenario, seed).model_dump(mode="json", exclude_none=True)
        file.write_text("\n".join(f"{key} = {_toml(value)}" for key, value in data.items()) + "\n")
        files[seed] = file
    return files


def _toml(value: Any) -> str:
    """A value as TOML, tables inline."""
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{k} = {_toml(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_toml(v) for v in value) + "]"
    return json.dumps(value)


def render(report: Report, files: Mapping[int, Path]) -> str:
    """The report as text: what was estimated, a table, counter-examples and chains."""
    head = ("transition", "samples", "inside", "bound", "prepares", "in g", "went on", "refines")
    rows = [(*head, "worst: margin, of, seed")]
    for e in report.edges:
        near = "-" if e.worst is None else f"{e.worst.margin:+.2f} {e.worst.of}, {e.worst.seed}"
        share = e.share if e.bound is not None else None
        rows.append(
            (
                f"{e.source} -[{e.event}]-> {e.target}",
                str(e.samples),
                "-" if share is None else f"{share:.2f}",
                "-" if e.bound is None else f"{e.bound:.2f}",
                e.verdict,
                "-" if e.in_goal is None else f"{e.in_goal}/{e.samples}",
                f"{e.went_on}/{e.judged}" if e.judged else "-",
                e.refines,
                near,
            )
        )
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    lines = ["  ".join(c.ljust(w) for c, w in zip(r, widths, strict=True)).rstrip() for r in rows]
    ends = list(report.ends.values())
    lines += [
        "",
        f"{len(ends)} sampled runs, {ends.count('finished')} finished. An estimate, no proof: "
        f"bound is the {100 * CONFIDENCE:.0f} %",
        f"Clopper-Pearson lower bound over the variations drawn; prepares needs none outside and "
        f"a bound of {ENOUGH:g}.",
    ]
    lines += [f"  seed {s}: {end}" for s, end in report.ends.items() if end != "finished"]
    for e in report.failed:
        if e.worst is not None:
            where = files.get(e.worst.seed)
            lines.append(
                f"counter-example: {e.source} -> {e.target} at {e.worst.t:.2f} s, outside by "
                f"{-e.worst.margin:.2f} of {e.worst.of}; steadyhand run {where} "
                f"--seed {e.worst.seed}"
            )
    for e in report.edges:
        if e.stuck is not None:
            lines.append(
                f"did not go on: {e.target} after {e.source} -[{e.event}]->; "
                f"steadyhand run {files.get(e.stuck)} --seed {e.stuck}"
            )
    lines += [f"refines: {' > '.join(chain)}" for chain in report.chains]
    return "\n".join(lines)
