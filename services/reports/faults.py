"""What went wrong in a run, and what was done about it."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from services.logs.runlog import RunLog
from services.messages import ArmStatus, BaseStatus, Estimate
from services.reports.curves import hermite, known
from services.topics import ARM_STATUS, BASE_STATUS, ESTIMATE, HEALTH, REQUEST, TRUTH, Topic

GAP = 0.5
"""A disturbance that is away for less goes on [s]."""
AFTER = 2.0
"""What happens so long after a fault is taken to answer it [s]."""
QUIET = ("idle", "running", "finished")
"""States of the arm that need no explanation."""
FIGURES = re.compile(r"\d+(\.\d+)?")
"""What may differ in a reason that goes on."""
SILENT = 0.3
"""A gap in the truth that is longer is one in the log [s]."""


@dataclass(frozen=True)
class Span:
    """Something that was so from ``start`` to ``end`` [s]."""

    start: float
    end: float
    what: str


@dataclass(frozen=True)
class Fault:
    """What went wrong, and what was done about it by whom, in words.

    Attributes:
        span: what, from when to when.
        observer: what it said, ``arm`` and ``base`` likewise.
        error: largest error of the estimate meanwhile [m], None without truth.
    """

    span: Span
    observer: str
    arm: str
    base: str
    error: float | None


@dataclass(frozen=True)
class Lanes:
    """A run as spans: what acted on it, and what observer, arm and base were at."""

    disturbances: list[Span]
    observer: list[Span]
    arm: list[Span]
    base: list[Span]


def lanes_of(log: RunLog) -> Lanes:
    """Disturbances, what the observer found wrong, states of arm and platform."""
    return Lanes(
        disturbances_of(log),
        [s for s in _spans(log, ESTIMATE, _said_by_observer) if s.what],
        _spans(log, ARM_STATUS, lambda s: _state(s, QUIET)),
        _spans(log, BASE_STATUS, lambda s: _state(s, ())),
    )


HOLE = "nothing in the log"
"""Stands among the disturbances where nothing was recorded."""


def disturbances_of(log: RunLog) -> list[Span]:
    """Every disturbance that acted, by name, and holes in the log."""
    out: list[Span] = []
    open_: dict[str, Span] = {}
    truth = log.series(TRUTH)
    for before, m in itertools.pairwise([None, *truth]):
        if before is not None and m.t - before.t > SILENT:
            out.append(Span(before.t, m.t, HOLE))
        for name in m.disturbances:
            last = open_.get(name)
            if last is not None and m.t - last.end < GAP:
                open_[name] = Span(last.start, m.t, name)
            else:
                out += [last] if last else []
                open_[name] = Span(m.t, m.t, name)
    return sorted([*out, *open_.values()], key=lambda s: s.start)


def faults_of(log: RunLog) -> list[Fault]:
    """Each disturbance with what was said and done from its start until shortly after."""
    lanes, out = lanes_of(log), []
    t, error = _estimate_error(log)
    for span in lanes.disturbances:
        end = span.end + AFTER
        meanwhile = error[(t >= span.start) & (t <= end)]
        out.append(
            Fault(
                span,
                _in_words(lanes.observer, span.start, end) or "nothing to report",
                _in_words(lanes.arm, span.start, end, changes=True) or "went on",
                _in_words(lanes.base, span.start, end, changes=True) or "went on",
                float(meanwhile.max()) if len(meanwhile) else None,
            )
        )
    return out


def events_of(log: RunLog) -> list[tuple[float, str, str]]:
    """When [s], who, what: requests, restarts, and changes of state that have a reason."""
    out: list[tuple[float, str, str]] = []
    for service, topic in REQUEST.items():
        for same in _runs(log.series(topic)):
            first, times = same[0], f", {len(same)} times" if len(same) > 1 else ""
            answer = "granted" if first.accepted else f"refused: {first.reason}"
            what = f"asked to {first.verb} {first.args if first.args != '{}' else ''}".rstrip()
            out.append((first.t, service, f"{what}{times}: {answer}"))
    for service, health in HEALTH.items():
        for a, b in itertools.pairwise(log.series(health)):
            if a.pid != b.pid:
                out.append((b.t, service, f"restarted; silent since {a.t:.2f} s"))
    for a, b in itertools.pairwise(log.series(ARM_STATUS)):
        if a.state != b.state and (b.reason or b.state not in QUIET):
            out.append((b.t, "arm", _state(b, ())))
    for a, b in itertools.pairwise(log.series(BASE_STATUS)):
        if a.state != b.state and b.reason:
            out.append((b.t, "base", _state(b, ())))
    return sorted(out)


def _runs(requests: Sequence[Any]) -> Iterable[list[Any]]:
    """Requests that were repeated with the same answer, together."""
    for _, same in itertools.groupby(requests, lambda r: (r.verb, r.args, r.accepted, r.reason)):
        yield list(same)


def _said_by_observer(e: Estimate) -> str:
    reason = e.reason.split(":")[0]
    if not e.valid:
        return f"invalid ({reason})" if reason else "invalid"
    return reason or ("disturbed" if e.mode == "disturbed" else "")


def _state(status: ArmStatus | BaseStatus, quiet: Sequence[str]) -> str:
    if status.state in quiet or not status.reason:
        return status.state
    return f"{status.state}: {status.reason}"


def _spans(log: RunLog, topic: Topic, words: Any) -> list[Span]:
    """Stretches over which the same is said, in the words of the first, but for figures."""
    out: list[Span] = []
    for m in log.series(topic):
        what = words(m)
        if out and FIGURES.sub("", out[-1].what) == FIGURES.sub("", what):
            out[-1] = Span(out[-1].start, m.t, out[-1].what)
        else:
            if out:
                out[-1] = Span(out[-1].start, m.t, out[-1].what)
            out.append(Span(m.t, m.t, what))
    return out


def _in_words(spans: list[Span], start: float, end: float, changes: bool = False) -> str:
    """What spans say between two instants, each once, in order; only changes if asked."""
    inside = [s for s in spans if s.start <= end and s.end >= start]
    if changes:
        inside = [s for s in inside if s.start > start]
    words = dict.fromkeys(f"{s.what} (at {s.start:.2f} s)" if changes else s.what for s in inside)
    shown = list(words)[:4]
    return "; ".join([*shown, f"and {len(words) - 4} more"] if len(words) > 4 else shown)


def _estimate_error(log: RunLog) -> tuple[Any, Any]:
    """Instants [s] and distances between estimate and truth [m]."""
    truth, estimates = log.series(TRUTH), log.series(ESTIMATE)
    if len(truth) < 2 or not estimates:
        return np.zeros(0), np.zeros(0)
    t = np.array([e.t for e in estimates])
    stamps = np.array([m.t for m in truth])
    rates = np.array([m.velocity for m in truth])
    true = hermite(t, stamps, np.array([m.pose for m in truth]), rates)
    away = np.array([e.pose for e in estimates]) - true
    kept = known(t, stamps) & np.array([e.valid for e in estimates])
    return t[kept], np.hypot(away[kept, 0], away[kept, 1])


def timeline(log: RunLog, title: str) -> Figure | None:
    """Disturbances, observer, arm and platform over one time axis; None of an empty log."""
    lanes = lanes_of(log)
    rows = [
        ("disturbances", lanes.disturbances, "#b3261e"),
        ("observer", lanes.observer, "#e08a1e"),
        ("arm", lanes.arm, "#1f4e9c"),
        ("platform", lanes.base, "#2e7d32"),
    ]
    rows = [(name, spans, colour) for name, spans, colour in rows if spans]
    if not rows:
        return None
    figure, axis = plt.subplots(figsize=(13, 0.9 + 0.75 * len(rows)), layout="constrained")
    whole = max(s.end for _, spans, _ in rows for s in spans)
    for k, (_, spans, colour) in enumerate(rows):
        for i, s in enumerate(spans):
            width = max(s.end - s.start, 0.003 * whole)
            axis.broken_barh(
                [(s.start, width)], (-k - 0.35, 0.7), facecolor=colour, alpha=(0.75, 0.45)[i % 2]
            )
            if width > 0.012 * whole * len(text := s.what.partition(":")[0]):
                axis.text(s.start + 0.5 * width, -k, text, ha="center", va="center", fontsize=8)
    axis.set_yticks([-k for k in range(len(rows))], [name for name, _, _ in rows])
    axis.set(xlabel="t [s]", xlim=(0.0, whole))
    axis.grid(axis="y", visible=False)
    figure.suptitle(title)
    return figure
