"""Real services killed, stopped or stuck while the robot draws: how soon it is safe and whole.

The faults come from outside, by signals, except the interpreter's lock
held for ever, which a service started by ``build`` does to itself on ``SIGUSR2``.
"""

from __future__ import annotations

import itertools
import math
import os
import re
import signal
import subprocess
import threading
import time
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import psutil

from services.bench.live_robot import START, robot, to_work
from services.components import build_service
from services.messages import AT_WORK, Truth
from services.script import Connection, Silent
from services.service import Service
from services.topics import ARM_STATUS, HEALTH, SERVICES, TRUTH

KINDS = ("kill", "stop", "lock", "slow")
"""Killed; stopped by a signal; stuck with the interpreter's lock; given half of the time."""
SLOW = 1.0
"""How long a service is slowed [s], ..."""
SLICE = 0.03
"""... stopped for so long, and going on for as long [s]."""
PATIENCE = 1.0
"""Who is not safe after so long [s] counts as never safe."""
AT_REST = 0.02
"""Joints slower than this rest [rad/s]."""
_STUCK = re.compile(r"(a+)+$")


@dataclass(frozen=True)
class Found:
    """What came of one fault.

    Attributes:
        kind: of ``KINDS``.
        service: whom it happened to.
        safe: until the arm held, or its joints rested (looked at every 5 ms) if it was the arm [s];
            None if it need not, or had let go before, or never did.
        by_clock: the same in the robot's time, as stamped where it happened [s]: without the way of
            the message to us, and without what the simulation stood still.
        woken: how late a sleeping thread of this process was woken meanwhile, at most [s].
        ready: until the service was ready again [s]; None if it never was gone, or never was back.
        never: which of ``safe`` (within ``PATIENCE``) and ``ready`` was waited for in vain.
        whole: the arm is at work again, or says why not.
        end: its state and reason then.
    """

    kind: str
    service: str
    safe: float | None
    by_clock: float | None
    woken: float | None
    ready: float | None
    never: tuple[str, ...]
    whole: bool
    end: str


def build(name: str, scenario: str, *args: Any, **options: Any) -> Service:
    """A service that can be made to hold the interpreter's lock for ever, by ``SIGUSR2``."""

    def stuck(*_: object) -> None:
        _STUCK.match("a" * 60 + "b")  # a C function that never comes back and lets nobody else in

    signal.signal(signal.SIGUSR2, stuck)
    return build_service(name, scenario, *args, **options)


def orphans(up: psutil.Popen, signal_number: int, patience: float) -> int:
    """End the supervisor by a signal; how many of its processes are left after so long [s]."""
    family = up.children(recursive=True)
    up.send_signal(signal_number)
    with suppress(subprocess.TimeoutExpired):
        up.wait(patience)
    _, alive = psutil.wait_procs(family, timeout=patience)
    return len([p for p in alive if p.is_running() and p.status() != psutil.STATUS_ZOMBIE])


class Session:
    """Faults on one running robot, one after the other.

    Args:
        line: to the robot.
        run_dir: of the robot.
        rng: when, what and whom.
    """

    def __init__(self, line: Connection, run_dir: Path, rng: np.random.Generator) -> None:
        self._line, self._run_dir, self._rng = line, run_dir, rng
        self.worst_force = 0.0
        """Greatest force of the pen on the board so far [N]."""

    def fault(self, kind: str, service: str) -> Found:
        """Have the robot draw, let something happen once all is calm, and look how it goes on."""
        calm = time.monotonic() + START
        while len(list(self._run_dir.glob("*.ready"))) < len(SERVICES) and time.monotonic() < calm:
            self._watch(0.1)
        to_work(self._line)
        self._watch(float(self._rng.uniform(0.5, 2.0)))
        pid = self._line.latest(HEALTH[service]).pid
        at_work = self._line.latest(ARM_STATUS).state in AT_WORK  # or it has let go by itself
        since = self._watch(0.0)
        began = time.monotonic()
        with Sleeper() as sleeper:
            _do(kind, pid)
            safe = by_clock = woken = ready = None
            never: tuple[str, ...] = ()
            if at_work and kind != "slow" and service != "base":  # without base the arm goes on
                safe_at = self._safe(service)
                woken = sleeper.latest
                if safe_at is None:
                    never += ("safe",)
                else:
                    safe, by_clock = time.monotonic() - began, safe_at - since
        if kind != "slow":
            ready = self._ready(service, pid, began)
            never += ("ready",) if ready is None else ()
        whole, end = self._whole()
        return Found(kind, service, safe, by_clock, woken, ready, never, whole, end)

    def _watch(self, duration: float) -> float:
        """Look at the pen's force for so long [s]; returns the robot's time [s]."""
        until = time.monotonic() + duration
        for truth in self._line.messages(TRUTH, START):
            self.worst_force = max(self.worst_force, float(truth.recent[:, 3].max()))
            if time.monotonic() > until:
                break
        return float(truth.t)

    def _safe(self, service: str) -> float | None:
        """When the arm says that it holds; without the arm, when its joints rest [robot's s].

        None if that does not come to be within ``PATIENCE``.
        """
        with suppress(Silent):
            if service == "arm":
                return self._line.wait_for(TRUTH, _rests, PATIENCE).t
            return self._line.wait_for(ARM_STATUS, lambda s: s.state not in AT_WORK, PATIENCE).t
        return None

    def _ready(self, service: str, pid: int, began: float) -> float | None:
        try:
            self._line.wait_for(HEALTH[service], lambda h: h.pid != pid, START)
        except Silent:
            return None
        return time.monotonic() - began

    def _whole(self) -> tuple[bool, str]:
        """Resume what can be resumed; the arm is at work again, or says why not."""
        with suppress(Silent):
            to_work(self._line, 10.0)
        status = self._line.latest(ARM_STATUS, START)
        words = f"{status.state}: {status.reason}" if status.reason else status.state
        return status.state in AT_WORK or bool(status.reason), words


def campaign(run_dir: Path, scenario: str, seed: int, count: int, each: int = 10) -> dict[str, Any]:
    """So many faults, ``each`` of them on one robot; then its supervisor is ended or killed.

    Returns:
        ``found``: of every fault; ``orphans`` after an orderly end and after the supervisor was
        killed; ``force``: greatest of the pen [N]; ``never``: how often ``safe`` and ``ready`` were
        waited for in vain; ``safe``: 99th percentile of how long it took to be safe [s], beside
        ``safe_by_clock``, the same in the robot's time: None if nothing was to be made safe, or not
        even 99 of 100 were; ``noise``, that of how late a sleeping thread was woken meanwhile.
    """
    rng = np.random.default_rng([seed, 11])
    found: list[Found] = []
    left, force = {"ended": 0, "killed": 0}, 0.0
    for number in itertools.count():
        if len(found) >= count:
            break
        options = ("--factory", "services.faults.processes:build", "--seed", str(seed + number))
        home = run_dir / str(number)
        with robot(home, scenario, *options) as (up, line):
            session = Session(line, home, rng)
            for _ in range(min(each, count - len(found))):
                service = str(rng.choice(("observer", "arm", "base")))
                found.append(session.fault(str(rng.choice(KINDS)), service))
            force = max(force, session.worst_force)
            how = "killed" if number % 2 else "ended"
            by = signal.SIGKILL if how == "killed" else signal.SIGTERM
            left[how] += orphans(up, by, 1.0 if how == "killed" else 5.0)
    return {
        "found": [asdict(f) for f in found],
        "orphans": left,
        "force": force,
        **summary(found),
    }


def summary(found: list[Found]) -> dict[str, Any]:
    """``never``, ``safe``, ``safe_by_clock`` and ``noise`` of a campaign."""
    unsafe = sum("safe" in f.never for f in found)
    return {
        "never": {"safe": unsafe, "ready": sum("ready" in f.never for f in found)},
        "safe": _p99([f.safe for f in found], unsafe),
        "safe_by_clock": _p99([f.by_clock for f in found], unsafe),
        "noise": _p99([f.woken for f in found]),
    }


def _p99(values: list[float | None], never: int = 0) -> float | None:
    known = [v for v in values if v is not None] + never * [math.inf]
    worst = float(np.quantile(known, 0.99, method="higher")) if known else math.inf
    return worst if math.isfinite(worst) else None


def _rests(truth: Truth) -> bool:
    return bool(np.abs(truth.qd).max() < AT_REST)


def _do(kind: str, pid: int) -> None:
    match kind:
        case "kill":
            os.kill(pid, signal.SIGKILL)
        case "stop":
            os.kill(pid, signal.SIGSTOP)
        case "lock":
            os.kill(pid, signal.SIGUSR2)
        case "slow":
            for _ in range(round(SLOW / SLICE / 2)):
                os.kill(pid, signal.SIGSTOP)
                time.sleep(SLICE)
                os.kill(pid, signal.SIGCONT)
                time.sleep(SLICE)


class Sleeper:
    """A thread that sleeps for a millisecond again and again, as long as the ``with``.

    Attributes:
        latest: so much longer than asked for it slept, at most [s].
    """

    def __init__(self) -> None:
        self.latest = 0.0
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._sleep, daemon=True)

    def _sleep(self) -> None:
        while not self._stop.is_set():
            before = time.monotonic()
            time.sleep(0.001)
            self.latest = max(self.latest, time.monotonic() - before - 0.001)

    def __enter__(self) -> Sleeper:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join()
