"""The console's process: hears the robot, shows it, and asks it for what people press.

``python -m services.console.live``; ``up`` starts it beside the services, ``steadyhand console``
alone. It may come up before, after or without them.
"""

from __future__ import annotations

import argparse
import contextlib
import logging
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import zenoh

from services.console.asking import Asking
from services.console.controls import Controls
from services.console.feed import INPUTS, Feed
from services.console.page import Page
from services.console.server import PORT, PortInUse, Server
from services.console.words import WAITING
from services.live import realtime
from services.live.loop import FixedRate
from services.live.runner import Heart
from services.requests import ask
from services.service import Inbox, Reply
from services.topics import CONSOLE, Topic
from services.wire.bus import Bus, open_bus
from services.wire.endpoints import Endpoints, local, make_run_dir, scenario_file
from sim.scenario import Scenario, load_scenario

PERIOD = 1 / 30  # [s]
NICE = 5
"""How far it stands back: on a busy machine the page stutters, not the robot."""

log = logging.getLogger("steadyhand")


class Console:
    """Hears, shows and asks, thirty times a second.

    Args:
        robot: its name.
        run_dir: where its sockets are, or will be.
        server: of the page.
        scenario: to draw; None for the one that the supervisor says it runs.
        endpoints: where to reach a robot on several hosts, as a person; None for this host.
    """

    name = CONSOLE
    inputs: tuple[Topic, ...] = ()  # for the heartbeat: it depends on nobody

    def __init__(
        self,
        robot: str,
        run_dir: Path,
        server: Server,
        scenario: Scenario | None = None,
        endpoints: Endpoints | None = None,
    ) -> None:
        self._robot, self._server, self._given = robot, server, scenario
        self._endpoints = endpoints
        self._run_dir = make_run_dir(run_dir)
        self._file = scenario_file(self._run_dir)
        self._read = -1
        self._note = server.gui.add_markdown(WAITING)
        self.feed = Feed()
        self._page: Page | None = None
        self._controls: Controls | None = None

    def state(self) -> tuple[str, str]:
        """Where the page is, and how many look at it."""
        looking = len(self._server.get_clients())
        return "serving", f"{self._server.url}, {looking} looking"

    def run(self, stop: threading.Event) -> None:
        """Until ``stop`` is set."""
        pace = FixedRate(PERIOD)
        with self._bus() as bus:

            def send(service: str, verb: str, args: dict[str, Any]) -> Reply:
                return ask(bus.session, self._robot, service, verb, args)

            asking, inbox = Asking(send), Inbox(INPUTS)
            heart = Heart(self, bus, pace.statistics)  # type: ignore[arg-type]
            while not stop.is_set():
                now = pace.wait()
                # no age is judged: a paced robot's time goes at any speed, and old is worth seeing
                for topic, message, at in bus.drain(inbox, None):
                    self.feed.hear(topic, message, at)
                self._look_for_scenario(asking)
                if self._page is not None and self._controls is not None:
                    self._page.show(self.feed, now)
                    self._controls.show()
                heart.beat(self.feed.t, inbox)

    @contextlib.contextmanager
    def _bus(self) -> Iterator[Bus]:
        """With a socket of its own: who is started later connects to it, as among services.

        A second console finds it taken; it then hears only who was there before it.
        """
        with contextlib.ExitStack() as stack:
            if self._endpoints is not None:
                opened = open_bus(self._endpoints, self._robot, CONSOLE, INPUTS)
                yield stack.enter_context(opened)
                return
            try:
                opened = open_bus(local(self._run_dir, CONSOLE), self._robot, CONSOLE, INPUTS)
                bus = stack.enter_context(opened)
            except zenoh.ZError:
                log.warning("console: another one of this robot was there first")
                opened = open_bus(local(self._run_dir), self._robot, CONSOLE, INPUTS)
                bus = stack.enter_context(opened)
            yield bus

    def _look_for_scenario(self, asking: Asking) -> None:
        """Build the page when it is known what to draw, and anew when that has changed."""
        if self._given is not None:
            if self._page is None:
                self._build(self._given, asking)
            return
        with contextlib.suppress(FileNotFoundError):
            written = self._file.stat().st_mtime_ns
            if written == self._read:
                return
            self._read = written
            try:
                scenario = load_scenario(self._file.read_text(encoding="utf-8").strip())
            except ValueError as error:
                log.warning("console: %s", error)
                return
            self._build(scenario, asking)

    def _build(self, scenario: Scenario, asking: Asking) -> None:
        log.info("console: drawing %s", scenario.name)
        self.feed = Feed()
        self._page = Page(self._server, scenario)
        self._controls = Controls(self._page, self.feed, asking)


def main(argv: list[str] | None = None) -> None:
    """Serve until told to end."""
    parser = argparse.ArgumentParser(prog="services.console.live", description=__doc__)
    parser.add_argument("--robot", default="r1")
    parser.add_argument("--run-dir", type=Path, required=True)
    parser.add_argument("--port", type=int, default=PORT)
    parser.add_argument("--scenario")
    parser.add_argument("--parent", type=int, help="die with this process")
    options = parser.parse_args(argv)
    if options.parent:
        realtime.die_with_parent(options.parent)
    logging.basicConfig(
        stream=sys.stderr, level=logging.INFO, format="%(asctime)s %(levelname)s %(message)s"
    )
    os.dup2(2, 1)
    try:
        serve(options.robot, options.run_dir, options.port, options.scenario)
    except PortInUse as error:
        sys.exit(str(error))
    sys.stderr.flush()
    os._exit(0)


def serve(
    robot: str,
    run_dir: Path,
    port: int,
    scenario: str | None = None,
    say: Callable[[str], None] = lambda url: log.info("console: the page is %s", url),
    endpoints: Endpoints | None = None,
) -> None:
    """Serve the page of a robot until SIGINT or SIGTERM; ``say`` is told its address.

    With ``endpoints`` that of a robot on several hosts; it then needs a scenario.

    Raises:
        PortInUse: somebody listens there.
        BadFile: no such scenario.
        BadEndpoint: the run directory cannot be used.
    """
    given = load_scenario(scenario) if scenario else None
    os.nice(NICE)
    stop = threading.Event()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: stop.set())
    server = Server(port, f"steadyhand {robot}")
    console = Console(robot, run_dir, server, given, endpoints)
    say(server.url)
    try:
        console.run(stop)
    finally:
        server.stop()


if __name__ == "__main__":
    main()
