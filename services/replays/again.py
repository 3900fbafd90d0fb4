"""A service once more over what it heard in a recorded run, compared with what it said then."""

from __future__ import annotations

import itertools
import json
from collections import defaultdict
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np

from deploy.robot import ROBOTS
from services.components import build_service
from services.lockstep import TICK
from services.logs.file import BadLog
from services.logs.provenance import scenario_of
from services.logs.runlog import RunLog
from services.messages import ArmState, ArmStatus, Message
from services.service import Inbox, Service
from services.topics import ARM_COMMAND, ARM_STATE, ARM_STATUS, HEALTH, REQUEST, TOPICS, Topic

EXACT = ("lockstep", "paced")
"""Ways to run in which a message takes one tick: what was heard when is known to the tick."""
SERVICES = ("observer", "base", "arm")
"""Services that can be run again: what they do follows from what they hear."""


@dataclass
class Compared:
    """Messages of one topic then and now.

    Attributes:
        topic: its name.
        then: messages in the log.
        now: of these, how many were said again.
        same: and how many of those to the last bit.
        more: messages said now, of instants until the last one then, that were not said then; where
            arrivals are known to the tick and the log is full.
        largest: difference of any number of each field, with where it was: field to (size, t [s]).
    """

    topic: str
    then: int = 0
    now: int = 0
    same: int = 0
    more: int = 0
    largest: dict[str, tuple[float, float]] = field(default_factory=dict)

    @property
    def agrees(self) -> bool:
        """Every message was said again, to the last bit, and no other."""
        return self.same == self.then and not self.more


@dataclass(frozen=True)
class Transition:
    """A change of node or state of the arm: when [s], and what to."""

    t: float
    state: str
    node: str


@dataclass
class Again:
    """What came of it.

    Attributes:
        service: that was run.
        compared: by topic.
        transitions: of the arm, then and now.
        end: until when the log was used [s].
        notes: what people should know, in words.
        exact: whether arrivals are known to the tick, so that every bit should agree.
    """

    service: str
    compared: dict[str, Compared]
    transitions: tuple[list[Transition], list[Transition]]
    end: float
    notes: list[str]
    exact: bool

    @property
    def agrees(self) -> bool:
        """Every message of every topic was said again, to the last bit."""
        return all(c.agrees for c in self.compared.values())

    @property
    def decides_alike(self) -> bool:
        """The arm went through the same states and nodes, whenever."""
        then, now = ([(t.state, t.node) for t in side] for side in self.transitions)
        return then == now


def run_again(log: RunLog, about: Mapping[str, str], name: str) -> Again:
    """Run a service of a recorded run again and compare what it says.

    Of a run in lockstep every message arrives in the tick after it was sent, so all must agree to
    the last bit. Live nobody knows which message came in time for which step: the service steps
    where it stepped then, with what the recorder had heard by then; small differences are to be
    expected. Requests that people made are repeated when they were made.

    Args:
        log: of a run, full.
        about: its metadata.
        name: one of ``SERVICES``.

    Raises:
        ValueError: unknown service.
        BadFile, ProgramError: the log's scenario, robot or program cannot be used today.
        BadLog: the log lacks what the service hears.
    """
    if name not in SERVICES:
        raise ValueError(f"cannot run {name!r} again. Known: {', '.join(SERVICES)}")
    exact = about.get("mode", "lockstep") in EXACT
    notes = _changed(about)
    with _service(about, name, live=not exact) as service:
        _refuse_light(log, about, service)
        end = _restart(log, name, notes)
        steps = _by_ticks if exact else _as_it_stepped
        said: dict[str, list[Message]] = defaultdict(list)
        for topic, message in steps(log, service, end):
            said[topic.name].append(message)
    own = [t for t in TOPICS.values() if t.owner == name and log.series(t)]
    whole = exact and about.get("record") != "light"
    compared = {
        t.name: _compare(t, [m for m in log.series(t) if m.t < end], said[t.name], whole)
        for t in own
        if t not in (HEALTH[name], REQUEST[name]) and not t.name.endswith("/tick")
    }
    if not compared:
        raise BadLog(f"nothing that {name} said is in the log")
    statuses: Any = said[ARM_STATUS.name]
    then = [s for s in log.series(ARM_STATUS) if s.t < end]
    sides = (_transitions(then), _transitions(statuses)) if name == "arm" else ([], [])
    last = max((log.arrivals(t)[-1] for t in service.inputs if log.series(t)), default=0.0)
    return Again(name, compared, sides, min(end, last), notes, exact)


@contextmanager
def _service(about: Mapping[str, str], name: str, live: bool) -> Iterator[Service]:
    with scenario_of(about) as scenario:
        seed = int(about.get("seed", "0"))
        yield build_service(name, scenario, seed, about.get("observer", "ekf"), live=live)


def _changed(about: Mapping[str, str]) -> list[str]:
    """What is not as it was when the log was made."""
    from services.logs.provenance import git_hash

    out = []
    robot = about.get("robot", "")
    file: Path = ROBOTS / robot / "robot.toml"
    if robot and file.is_file() and file.read_text(encoding="utf-8") != about.get("robot_toml"):
        out.append(f"the description of robot {robot} has changed since the log was made")
    then, now = about.get("git", "unknown"), git_hash()
    if "unknown" not in (then, now) and then != now:
        out.append(f"made by code {then[:10]}, run again by {now[:10]}")
    if any("-dirty" in commit for commit in (then, now)):
        out.append("not all of the code was committed, then or now")
    return out


def _refuse_light(log: RunLog, about: Mapping[str, str], service: Service) -> None:
    thinned = [t.name for t in service.inputs if t.light_rate and log.series(t)]
    if about.get("record") == "light" and thinned:
        raise BadLog(
            f"a light log has not all that {service.name} heard ({', '.join(thinned)} are thinned);"
            ' record = "full" in the scenario keeps it'
        )
    if service.name == "arm" and not log.series(ARM_STATE):
        raise BadLog(f"nothing on {ARM_STATE.name}: no arm ran")


def _restart(log: RunLog, name: str, notes: list[str]) -> float:
    """When the process was restarted, for its successor knows nothing of before; inf if never."""
    beats = log.series(HEALTH[name])
    for before, after in itertools.pairwise(beats):
        if before.pid != after.pid:
            notes.append(f"{name} was restarted after {before.t:.2f} s: compared until then")
            return float(before.t)
    return float("inf")


def _by_ticks(log: RunLog, service: Service, end: float) -> Iterator[tuple[Topic, Message]]:
    """Step as in lockstep: what was sent in a tick is there in the next."""
    due: dict[int, list[tuple[Topic, Message]]] = defaultdict(list)
    last = 0
    for topic in (*service.inputs, REQUEST[service.name]):
        for arrival, message in zip(log.arrivals(topic), log.series(topic), strict=True):
            tick = round(arrival / TICK)
            # a request is said in the tick that heeds it
            due[tick + (topic is not REQUEST[service.name])].append((topic, message))
            last = max(last, tick)
    own = [
        log.arrivals(t)[-1] for t in TOPICS.values() if t.owner == service.name and log.series(t)
    ]
    last = max([last, *(round(arrival / TICK) for arrival in own)])
    inbox, every = Inbox(service.inputs), max(1, round(service.period / TICK))
    for tick in range(last + 1):
        now = tick * TICK
        if now > end + TICK:  # what it said of an instant, it said a tick later
            return
        for topic, message in due.get(tick, ()):
            _tell(service, inbox, topic, message)
        if tick % every == 0:
            yield from service.step(now, inbox)


def _as_it_stepped(log: RunLog, service: Service, end: float) -> Iterator[tuple[Topic, Message]]:
    """Step where it said something, with what had been heard by then."""
    own = (t for t in TOPICS.values() if t.owner == service.name and log.series(t))
    mark = {"arm": ARM_COMMAND}.get(service.name) or next(own, None)
    if mark is None:
        return
    heard = {t.name for t in (*service.inputs, REQUEST[service.name])}
    states: dict[float, ArmState] = {}
    if service.name == "arm":  # it answers one state; the recorder may have heard the next before
        heard.discard(ARM_STATE.name)
        states = {s.t: s for s in log.series(ARM_STATE)}
    inbox = Inbox(service.inputs)
    for _, name, message in log.merged():
        if name == mark.name:
            if message.t >= end:
                return
            if message.t in states:
                inbox.offer(ARM_STATE, states[message.t])
            yield from service.step(message.t, inbox)
        elif name in heard:
            _tell(service, inbox, TOPICS[name], message)


def _tell(service: Service, inbox: Inbox, topic: Topic, message: Any) -> None:
    """A message, or a request that was granted."""
    if topic is not REQUEST.get(service.name):
        inbox.offer(topic, message)
    elif message.accepted:
        service.prepare(message.verb, json.loads(message.args or "{}"))()


def _compare(topic: Topic, then: list[Message], now: list[Message], whole: bool) -> Compared:
    """Message by message, of one stamp each; of several with one stamp, in their order.

    Args:
        topic: of them.
        then, now: what was said.
        whole: all that was said then is there, so that what there is more of now counts.
    """
    out = Compared(topic.name, len(then))
    waiting: dict[float, list[Message]] = defaultdict(list)
    for message in now:
        waiting[message.t].append(message)
    for old in then:
        match = waiting.get(old.t)
        if not match:
            continue
        new = match.pop(0)
        out.now += 1
        differs = False
        for f in fields(old):
            size = _difference(getattr(old, f.name), getattr(new, f.name))
            if size > 0.0:
                differs = True
                out.largest[f.name] = max(out.largest.get(f.name, (0.0, 0.0)), (size, old.t))
        out.same += not differs
    if whole and then:
        last = max(message.t for message in then)
        out.more = sum(m.t <= last for rest in waiting.values() for m in rest)
    return out


def _difference(a: Any, b: Any) -> float:
    """Largest difference of numbers; infinite where something else differs."""
    if isinstance(a, dict) and isinstance(b, dict) and a.keys() == b.keys():
        return max((_difference(a[k], b[k]) for k in a), default=0.0)
    if isinstance(a, (str, bool)) or isinstance(b, (str, bool, dict)):
        return 0.0 if a == b else float("inf")
    try:
        x, y = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
    except (TypeError, ValueError):
        return 0.0 if a == b else float("inf")
    if x.shape != y.shape:
        return float("inf")
    return float(np.abs(x - y).max()) if x.size else 0.0


def _transitions(statuses: list[ArmStatus]) -> list[Transition]:
    out: list[Transition] = []
    for s in statuses:
        if not out or (s.state, s.node) != (out[-1].state, out[-1].node):
            out.append(Transition(s.t, s.state, s.node))
    return out
