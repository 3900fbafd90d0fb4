"""A log in the page: a slider for the time, and a speed; nothing there can be asked of a robot."""

from __future__ import annotations

import tempfile
import threading
import time
from pathlib import Path
from typing import Any

from services.console.feed import INPUTS, Feed
from services.console.page import Page
from services.console.server import Server
from services.live.loop import FixedRate
from services.logs.runlog import BadLog, RunLog, read_run
from services.topics import TOPICS
from sim.scenario import Scenario, load_scenario

PERIOD = 1 / 30  # [s]


def open_log(path: Path) -> tuple[RunLog, Scenario]:
    """What a page needs of a log, or of all logs in a run's folder.

    Raises:
        BadLog: it cannot be read, is empty, or does not say what ran.
    """
    log, about, _ = read_run(path, [TOPICS[topic.name] for topic in INPUTS])
    if not log.messages:
        raise BadLog(f"{path}: no messages that could be shown; steadyhand log info {path}")
    text = about.get("scenario_toml", "")
    if not text:
        raise BadLog(f"{path}: does not say which scenario ran, so there is no robot to draw")
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / f"{about.get('scenario', 'scenario')}.toml"
        file.write_text(text, encoding="utf-8")
        try:
            return log, load_scenario(file)
        except ValueError as error:
            raise BadLog(f"{path}: its scenario is of another version: {error}") from None


class Playback:
    """Plays a log.

    Args:
        server: of the page.
        log: with the topics of ``INPUTS``.
        scenario: that ran.
    """

    def __init__(self, server: Server, log: RunLog, scenario: Scenario) -> None:
        self._messages = log.merged()
        self.start, self.end = self._messages[0][0], self._messages[-1][0]
        self.now = self.start
        self.feed = Feed()
        self._next = 0
        self._wanted: float | None = None
        self._page = Page(server, scenario)
        gui: Any = server.gui
        with self._page.controls:
            gui.add_markdown("**A log is played.** Nothing moves but this picture.")
            self._time = gui.add_slider(
                "time [s]", self.start, max(self.end, self.start + 0.1), 0.01, self.start
            )
            self._plays = gui.add_checkbox("play", True)
            self._speed = gui.add_slider("speed ×", 0.1, 10.0, 0.1, 1.0)
        self._page.program.remove()
        self._page.platform_controls.remove()
        self._time.on_update(self._moved)

    def _moved(self, event: Any) -> None:
        if event.client is not None:  # not by ourselves
            self._wanted = float(event.target.value)

    def seek(self, t: float) -> None:
        """Show the instant ``t`` [s]: on from here, or from the beginning if it was before."""
        if t < self.now:
            services = self.feed.services
            self.feed = Feed()
            self.feed.services = services if t > self.start else {}
            self._next = 0
        while self._next < len(self._messages) and self._messages[self._next][0] <= t:
            at, name, message = self._messages[self._next]
            self.feed.hear(TOPICS[name], message, at)
            self._next += 1
        self.now = t

    def run(self, stop: threading.Event) -> None:
        """Play until ``stop`` is set; at the end of the log it holds."""
        pace = FixedRate(PERIOD)
        last = time.monotonic()
        while not stop.is_set():
            now = pace.wait()
            passed, last = now - last, now
            wanted, self._wanted = self._wanted, None
            if wanted is None and self._plays.value:
                wanted = min(self.now + passed * self._speed.value, self.end)
            if wanted is not None and wanted != self.now:
                self.seek(wanted)
                self._time.value = round(wanted, 2)
            self._page.show(self.feed, self.now)
