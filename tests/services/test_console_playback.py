"""A log in the page: any instant of it, on and back, and logs that are none."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from mcap.writer import Writer

from services.console.playback import Playback, open_log
from services.console.server import Server
from services.logs.runlog import BadLog
from services.run import run_lockstep, write
from services.topics import ARM_STATUS, ESTIMATE, TRUTH
from sim.scenario import load_scenario


@pytest.fixture(scope="module", params=["whiteboard", "move_to_grasp"])
def recorded(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three seconds of one robot and of the other."""
    folder = tmp_path_factory.mktemp(request.param)
    write(run_lockstep(load_scenario(request.param), 1, duration=3.0), folder)
    return folder / "run.mcap"


@pytest.fixture(scope="module")
def server() -> Iterator[Server]:
    """On a port that is free."""
    server = Server(0, "test")
    yield server
    server.stop()


def test_any_instant_shows_what_was_true_then(recorded: Path, server: Server) -> None:
    """Forward or back to an instant gives the same picture; nothing of later is left."""
    log, scenario = open_log(recorded)
    player = Playback(server, log, scenario)

    def picture(t: float) -> tuple[float, float, list[str], float, float]:
        player.seek(t)
        feed = player.feed
        truth, estimate, arm = feed.latest(TRUTH), feed.latest(ESTIMATE), feed.latest(ARM_STATUS)
        assert truth is not None and estimate is not None and arm is not None
        assert max(truth.t, estimate.t, arm.t) <= t
        assert t - truth.t < 0.02 and t - estimate.t < 0.02
        row = feed.tracks["error"].window(0.0, 10.0)
        assert row[0][-1] <= t
        words = [text for _, text in feed.events]
        return truth.t, estimate.t, words, float(np.nansum(row[1])), feed.ink.length

    early, late = picture(1.0), picture(2.9)
    assert late != early
    assert picture(1.0) == early
    assert picture(2.9) == late


def test_the_page_plays_by_itself_and_holds_at_the_end(recorded: Path, server: Server) -> None:
    """At ten times the speed it comes to the end, and stays there."""
    import threading
    import time

    log, scenario = open_log(recorded)
    player = Playback(server, log, scenario)
    player._speed.value = 10.0
    stop = threading.Event()
    thread = threading.Thread(target=player.run, args=(stop,))
    thread.start()
    deadline = time.monotonic() + 60
    while player.now < player.end and time.monotonic() < deadline:
        time.sleep(0.05)
    stop.set()
    thread.join(20)
    assert player.now == player.end
    assert player._time.value == pytest.approx(player.end, abs=0.01)


def test_what_is_no_log_is_refused_with_a_way_on(tmp_path: Path) -> None:
    """No file, an empty one, a foreign one, one cut short: which, and what to do."""
    with pytest.raises(BadLog, match="gone"):
        open_log(tmp_path / "gone.mcap")
    (tmp_path / "empty.mcap").write_bytes(b"")
    with pytest.raises(BadLog, match="empty"):
        open_log(tmp_path / "empty.mcap")
    (tmp_path / "notes.mcap").write_text("not a log at all")
    with pytest.raises(BadLog, match="notes"):
        open_log(tmp_path / "notes.mcap")
    with (tmp_path / "foreign.mcap").open("wb") as file:
        writer = Writer(file)
        writer.start(library="somebody else")
        writer.finish()
    with pytest.raises(BadLog, match="somebody else"):
        open_log(tmp_path / "foreign.mcap")


def test_a_log_cut_short_says_how_to_recover_it(recorded: Path, tmp_path: Path) -> None:
    """The command that gives back what is whole."""
    (tmp_path / "cut.mcap").write_bytes(recorded.read_bytes()[:-5000])
    with pytest.raises(BadLog, match=r"steadyhand log recover"):
        open_log(tmp_path / "cut.mcap")
