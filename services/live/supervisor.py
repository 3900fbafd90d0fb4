"""Starts the services, watches that they work, restarts those that do not.

What counts as alive is what a service's own loop says: live its pulse (``pulse.py``), and always a
heartbeat whose progress counter advances. That a process exists, or with which code it ended, says
nothing. When one is taken to hang, ``watched.py`` says.
"""

from __future__ import annotations

import asyncio
import fcntl
import os
import signal
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

from services.live.brought import Brought
from services.live.notify import notify
from services.live.plan import Plan
from services.live.pool import Pool
from services.live.pulse import Pulses
from services.live.service_states import service_states
from services.live.spares import Spares
from services.live.watched import Watched
from services.messages import BASE_ENDED, PROGRAM_ENDED, Health
from services.requests import NoAnswer, ask
from services.topics import CONSOLE, HEALTH, RECORDER
from services.wire.bus import open_bus
from services.wire.endpoints import local, make_run_dir, scenario_file

POLL = 0.05  # [s]


class AlreadyRunning(RuntimeError):
    """Another supervisor has this robot."""


class StartFailed(RuntimeError):
    """A service did not come up; the text says where its log is and how it ended."""


@dataclass(frozen=True)
class Event:
    """Something people want to know.

    Attributes:
        at: robot time [s].
        service: whom it is about; empty for all.
        kind: started, restarted, ready, died, hung, given up, waiting, refused, ended, or the
            state that a service has gone into.
        detail: more about it.
    """

    at: float
    service: str
    kind: str
    detail: str = ""


def backoff(failures: int) -> float:
    """How long to wait before a restart after this many failures in a row [s]."""
    return 0.0 if failures <= 1 else min(8.0, 0.25 * 2 ** (failures - 2))


HEALTHY = 10.0  # [s] without failure forgives the earlier ones
CONSOLE_START = 6.0  # [s] for the page to come up before the program is started without it
CALM = 5.0  # [s] after the last start, spares are got ready
SILENT_START = 3.0  # [s] in which a program may be refused before anybody is told
STARTS = 3  # failures in a row before a service that never was ready is given up


class Supervisor:
    """Runs a plan; ``report`` is told of every event."""

    def __init__(self, plan: Plan, report: Callable[[Event], None]) -> None:
        self.plan = plan
        self.health: dict[str, Health] = {}
        self._report = report
        beside = () if plan.console is None else (CONSOLE,)
        self._watched = {name: Watched(service_states(name)) for name in (*plan.services, *beside)}
        self._brought = Brought(plan.brought, plan.silent, self._tell)
        self._stop = asyncio.Event()
        self._success = True

    def run(self) -> bool:
        """Run until told to end (SIGINT, SIGTERM), or the plan does; True if all went well.

        Raises:
            AlreadyRunning: another supervisor has this robot.
            StartFailed: a service did not come up.
        """
        run_dir = make_run_dir(self.plan.run_dir)
        with _lock(run_dir):
            scenario_file(run_dir).write_text(str(self.plan.scenario), encoding="utf-8")
            return asyncio.run(self._main(run_dir))

    async def _main(self, run_dir: Path) -> bool:
        loop = asyncio.get_running_loop()
        for number in (signal.SIGINT, signal.SIGTERM):
            loop.add_signal_handler(number, self._stop.set)
        self._pool = Pool(run_dir)
        self._spares = Spares(self._pool, run_dir)
        endpoints = local(run_dir, "supervisor")
        try:
            with (
                open_bus(
                    endpoints, self.plan.robot, "supervisor", HEALTH.values(), lossless=True
                ) as bus,
                Pulses(run_dir) as self._pulses,
            ):
                self._bus = bus
                for name in self.plan.services:
                    await self._bring_up(name)
                if self.plan.console is not None:
                    await self._start(CONSOLE, restarted=False)
                    await self._let_console_in()
                await self._wait_for_brought()
                if self.plan.start_program and not self._stop.is_set():
                    await self._start_program()
                notify("READY=1")
                end = time.monotonic() + (self.plan.duration or float("inf"))
                while not self._stop.is_set() and time.monotonic() < end:
                    await self._watch()
        finally:
            notify("STOPPING=1")
            await self._pool.stop_all(last=RECORDER)
            self._tell("", "ended")
        return self._success

    async def _bring_up(self, name: str) -> None:
        watched = self._watched[name]
        if not self._stop.is_set():
            await self._start(name, restarted=False)
        while not watched.ready and not self._stop.is_set():
            await self._watch()
            if watched.failures >= STARTS:
                raise StartFailed(self._why(name))

    async def _let_console_in(self) -> None:
        """Nothing needs the page, but its coming up takes a core: nothing moves meanwhile."""
        console, deadline = self._watched[CONSOLE], time.monotonic() + CONSOLE_START
        while console.states.state == "starting" and time.monotonic() < deadline:
            if self._stop.is_set():
                break
            await self._watch()

    async def _wait_for_brought(self) -> None:
        """Whoever starts them may take as long as it takes."""
        for name in self._brought.missing:
            self._tell(name, "waiting", f"for somebody to start it: {HEALTH[name].name}")
        while self._brought.missing and not self._stop.is_set():
            await self._watch()

    async def _start_program(self) -> None:
        """Ask the arm; try again while what it needs is on its way."""
        reason, deadline = "", time.monotonic() + self.plan.start
        tell_at = time.monotonic() + SILENT_START
        while time.monotonic() < deadline and not self._stop.is_set():
            await self._watch()
            if time.monotonic() > tell_at:
                tell_at = deadline
                self._tell("arm", "waiting", f"to start its program: {reason}")
            try:
                reply = await asyncio.to_thread(
                    ask, self._bus.session, self.plan.robot, "arm", "start", {}
                )
            except NoAnswer as error:
                reason = str(error)
                continue
            if reply.accepted:
                return
            reason = reply.reason
        if not self._stop.is_set():
            self._tell("arm", "refused", f"to start its program: {reason}")
            self._success = False
            if self.plan.until_finished:
                self._stop.set()

    def _why(self, name: str) -> str:
        log = self._pool.log_file(name)
        lines = log.read_text(errors="replace").splitlines()[-15:] if log.exists() else []
        return "\n".join([f"{name} did not come up; the end of {log}:", *lines])

    def _page(self) -> list[str]:
        """What the console is started with."""
        plan = self.plan
        args = ["-m", "services.console.live", "--robot", plan.robot, "--port", str(plan.console)]
        return [*args, "--run-dir", str(plan.run_dir), "--parent", str(os.getpid())]

    def _last_words(self, name: str) -> str:
        log = self._pool.log_file(name)
        lines = log.read_text(errors="replace").splitlines() if log.exists() else []
        return lines[-1] if lines else f"it said nothing; log: {log}"

    async def _start(self, name: str, restarted: bool) -> None:
        watched = self._watched[name]
        watched.states.fire("Due")
        watched.progress = -1
        watched.started = watched.advanced = time.monotonic()
        watched.restarts += restarted
        spare = await self._spares.take(name) if restarted else None
        args = self._page() if name == CONSOLE else self._args(name, watched.restarts)
        watched.pid = spare or await self._pool.start(name, args)
        self._tell(name, "started", f"process {watched.pid}{', a spare' if spare else ''}")

    def _args(self, name: str, restarts: int) -> list[str]:
        """What a service is started with, that was restarted so often."""
        plan = self.plan
        args = ["-m", "services.live.process", "--service", name, "--scenario", str(plan.scenario)]
        args += ["--seed", str(plan.seed), "--mode", plan.mode, "--run-dir", str(plan.run_dir)]
        args += ["--robot", plan.robot, "--observer", plan.observer, "--rt", plan.rt]
        args += ["--epoch", repr(plan.epoch), "--factory", plan.factory]
        args += ["--parent", str(os.getpid())]
        args += ["--services", ",".join(n for n in plan.everywhere if n != RECORDER)]
        if plan.spread is not None:
            args += ["--hosts", str(plan.spread.file), "--host", plan.spread.host]
            args += ["--keys", str(plan.spread.keys)]
        args += ["--log", str(plan.log)] if plan.log is not None else []
        args += ["--ticks", str(plan.ticks)] if plan.ticks is not None else []
        return [*args, "--restarted", str(restarts)] if restarts else args

    async def _keep_spares(self, now: float) -> None:
        """One for every service that others wait for, while all is calm."""
        mine = [self._watched[name] for name in self.plan.services]  # the page may be given up
        calm = all(w.ready and now - w.started > CALM for w in mine)
        if calm and self.plan.spares and self.plan.mode == "live":
            for name in self.plan.services:
                if name != RECORDER:
                    await self._spares.keep(
                        name, self._args(name, self._watched[name].restarts + 1)
                    )

    async def _watch(self) -> None:
        """One round: sleep, listen, look after the dead, the hung and those due for a restart."""
        before = time.monotonic()
        notify("WATCHDOG=1")
        await asyncio.sleep(POLL)
        now = time.monotonic()
        if now - before > self.plan.silent / 2:  # we were the ones who stood still
            for watched in self._watched.values():
                watched.advanced = now
            self._brought.excuse(now)
        self._listen(now)
        self._brought.judge(now)
        for name, code in self._pool.reap().items():
            if name in self._watched:
                await self._died(name, code, now)
            else:
                self._spares.forget(name)
        await self._keep_spares(now)
        pulses = self._pulses.heard()
        for name, watched in self._watched.items():
            state = watched.states.state
            if state == "waiting" and watched.failures and now >= watched.due:
                await self._start(name, restarted=watched.was_ready)
            if state not in ("starting", "ready"):
                continue
            why = watched.hangs(name, self.plan, watched.pid in pulses, now)
            if why:
                watched.lost = now
                watched.states.fire("Hung")
                self._tell(name, "hung", f"{why}; killed")
                self._pool.kill(name)
            elif watched.ready and watched.failures and now - watched.started > HEALTHY:
                watched.failures = 0

    def _listen(self, now: float) -> None:
        for name, watched in self._watched.items():
            for _, health in self._bus.take(HEALTH[name]):
                if health.pid != watched.pid:
                    continue  # the last words of its predecessor
                self._state_of(name, health)
                self.health[name] = health
                if health.progress > watched.progress:
                    watched.progress, watched.advanced = health.progress, now
                if watched.states.state == "starting":
                    took = now - (watched.lost if watched.was_ready else watched.started)
                    kind = "restarted" if watched.was_ready else "ready"
                    watched.was_ready = True
                    where = f", {health.detail.split(',')[0]}" if name == CONSOLE else ""
                    self._tell(name, kind, f"in {took:.2f} s{where}")
                watched.states.fire("Heard")
        for name in self._brought.names:
            for _, health in self._bus.take(HEALTH[name]):
                self._brought.hear(name, health, now)
                self._state_of(name, health)
                self.health[name] = health

    def _state_of(self, name: str, health: Health) -> None:
        """Tell of a change of state, and end the run with the program if that is the plan."""
        before = self.health.get(name)
        if before is not None and before.state != health.state and before.pid == health.pid:
            self._tell(name, health.state, health.detail)
        armed = "arm" in self.plan.services
        teller, endings = ("arm", PROGRAM_ENDED) if armed else ("base", BASE_ENDED)
        if name == teller and self.plan.until_finished and health.state in endings:
            self._stop.set()

    async def _died(self, name: str, code: int, now: float) -> None:
        watched = self._watched[name]
        watched.pid = 0
        if name == CONSOLE and not watched.was_ready:
            watched.states.fire("Ended")
            self._tell(name, "given up", self._last_words(name))
            return
        # what is lost of a paced run cannot be regained bit for bit
        if name != CONSOLE and self.plan.mode == "paced":
            finished = code == 0 and self.plan.ticks is not None
            self._success &= finished
            lost_at_start = not finished and not watched.ready
            watched.states.fire("Ended")
            why = "" if finished else f": {self._last_words(name)}"
            self._tell(name, "ended" if finished else "died", _meaning(code) + why)
            if lost_at_start:
                raise StartFailed(self._why(name))
            if not finished or not any(
                w.pid for n, w in self._watched.items() if n not in (RECORDER, CONSOLE)
            ):
                self._stop.set()
            return
        if watched.ready:
            watched.lost = now
        watched.failures += 1
        watched.states.fire("Died")
        wait = backoff(watched.failures)
        watched.due = now + wait
        detail = f"{_meaning(code)}; restart in {wait:.2f} s, log: {self._pool.log_file(name)}"
        self._tell(name, "died", detail)

    def _tell(self, service: str, kind: str, detail: str = "") -> None:
        self._report(Event(time.monotonic() - self.plan.epoch, service, kind, detail))


def _meaning(code: int) -> str:
    return f"exit code {code}" if code >= 0 else f"signal {signal.Signals(-code).name}"


class _lock:
    """Holds the robot: a lock the kernel releases when we die."""

    def __init__(self, run_dir: Path) -> None:
        self._path = run_dir / "supervisor.lock"
        self._file: TextIO | None = None

    def __enter__(self) -> None:
        self._file = self._path.open("a+")
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            self._file.seek(0)
            pid = self._file.read().strip() or "unknown"
            raise AlreadyRunning(
                f"process {pid} already supervises this robot ({self._path.parent}). "
                f"End it first (Ctrl-C where it runs, or kill -INT {pid}), or use another --robot "
                "or --run-dir"
            ) from None
        self._file.truncate(0)
        self._file.write(str(os.getpid()))
        self._file.flush()

    def __exit__(self, *_: object) -> None:
        if self._file is not None:
            self._file.close()
