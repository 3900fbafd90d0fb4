"""What a supervisor is to run."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from pathlib import Path

from services.live.process import FACTORY
from services.topics import PROCESSES


@dataclass(frozen=True)
class Spread:
    """Which part of a hosts file runs here.

    Attributes:
        file: the hosts file.
        host: this host's name in it.
        keys: folder of this host's certificates.
        everywhere: the services of all hosts, in starting order.
    """

    file: Path
    host: str
    keys: Path
    everywhere: tuple[str, ...]


@dataclass
class Plan:
    """What to run.

    Attributes:
        run_dir: of sockets, lock and logs.
        scenario: its file.
        robot: its name, the first part of every key.
        seed: of everything random.
        observer: of ``observer.observer.KINDS``.
        mode: live or paced.
        rt: real-time priority and cores: auto, on or off.
        ticks: paced only: end after this many ticks.
        duration: live only: end after this long [s].
        hang: live only: a loop that stands still for so long, of time in which it could have gone
            on, is a hang [s].
        silent: a heartbeat that makes no progress for this long is one whatever the cause [s].
        recorder_silent: the same of recorder and console, which have no pulse: no control waits for
            them, and killing the recorder cuts the log [s].
        start: a service must be ready within this [s].
        until_finished: end when the arm's program has; without an arm, when the platform has
            done what it was to do.
        start_program: live only: have the arm start its program once every service is ready.
        log: file the recorder writes; None for its default.
        services: that are started here, in starting order.
        brought: live only: services that somebody else starts on this machine, as a real robot's
            ``sim``; their heartbeats are judged, and the program waits for them.
        spread: services on several hosts, this one among them; None if all run here.
        spares: live only: keep a process ready for each service, for it to be back sooner.
        console: port of the page; None for no page. Nothing waits for it, and without it the run
            goes on.
        factory: ``module:function`` that builds the services.
        epoch: local monotonic time of robot time 0 [s].
    """

    run_dir: Path
    scenario: Path
    robot: str = "r1"
    seed: int = 0
    observer: str = "ekf"
    mode: str = "live"
    rt: str = "auto"
    ticks: int | None = None
    duration: float | None = None
    hang: float = 0.4
    silent: float = 3.0
    recorder_silent: float = 10.0
    start: float = 30.0
    until_finished: bool = False
    start_program: bool = False
    log: Path | None = None
    services: tuple[str, ...] = PROCESSES
    brought: tuple[str, ...] = ()
    spread: Spread | None = None
    console: int | None = None
    spares: bool = True
    factory: str = FACTORY
    epoch: float = field(default_factory=time.monotonic)

    @property
    def everywhere(self) -> tuple[str, ...]:
        """The services of all hosts, those that are brought included, in starting order."""
        if self.spread is not None:
            return self.spread.everywhere
        return tuple(name for name in PROCESSES if name in (*self.services, *self.brought))
