"""The page without a browser: what is sent to one, for either robot, and how much piles up."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
import viser
from websockets.sync.client import connect

from services.components import build_service
from services.console.feed import INPUTS, Feed
from services.console.page import Page
from services.console.server import Server
from services.console.words import plain
from services.lockstep import Lockstep
from services.topics import BASE_STATUS, TRUTH
from sim.scenario import load_scenario

HEARD = {topic.name for topic in INPUTS}


@pytest.fixture
def server(monkeypatch: pytest.MonkeyPatch) -> Iterator[Server]:
    """One that takes it that somebody looks."""
    server = Server(0, "test")
    monkeypatch.setattr(server, "get_clients", lambda: {0: None})
    yield server
    server.stop()


def played(server: Server, name: str, frames: int) -> Iterator[tuple[Page, Feed, int]]:
    """A run in lockstep, shown thirty times a second; after each frame what waits to be sent."""
    scenario, feed = load_scenario(name), Feed()
    page = Page(server, scenario)

    def hear(topic: Any, message: Any, at: float) -> None:
        if topic.name in HEARD:
            feed.hear(topic, message, at)

    lockstep = Lockstep([build_service(s, scenario, 1) for s in scenario.services], listener=hear)
    for _ in range(frames):
        for _ in range(33):
            lockstep.step()
        page._plots._next = 0.0
        page._next_words = 0.0
        page.show(feed, lockstep.now)
        yield page, feed, len(server._websock_server._broadcast_buffer.message_from_id)


@pytest.mark.parametrize("name", ["whiteboard_moving", "move_to_grasp"])
def test_the_robot_is_drawn_where_it_is_and_plots_move(server: Server, name: str) -> None:
    """Its platform's node stands at the true pose; a plot holds what came last."""
    for page, feed, _ in played(server, name, 40):
        truth = feed.latest(TRUTH)
        assert truth is not None
        frame = page._robot._frames["platform"]
        assert np.allclose(frame.position[:2], truth.pose[:2], atol=1e-6)
        plot, handle = page._plots._drawn[0]
        assert plot.track == "velocity"
    assert handle.data[0][-1] == pytest.approx(feed.t, abs=0.05)
    assert np.isfinite(handle.data[1]).all()
    base = feed.latest(BASE_STATUS)
    assert base is not None and base.votes
    assert f"**{base.state}**" in page._platform.content
    for behaviour in base.votes:
        assert f"</span> {plain(behaviour)} | " in page._platform.content


def test_a_browser_that_stands_still_lets_nothing_pile_up(server: Server) -> None:
    """Its lid is closed: it reads nothing. What waits for it stays as much as one picture."""
    protocol: Any = f"viser-v{viser.__version__}"
    with connect(server.url.replace("http", "ws"), subprotocols=[protocol]):
        waiting = [count for *_, count in played(server, "whiteboard_moving", 90)]
    assert waiting[-1] < 1.1 * waiting[20]
