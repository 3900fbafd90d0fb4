"""The recorder's file."""

from __future__ import annotations

import resource
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from services.logs.recorder import Recorder, free_name
from services.logs.runlog import read_run
from services.messages import ArmState
from services.service import Inbox
from services.topics import ARM_STATE


def test_a_log_that_is_there_is_never_written_over(tmp_path: Path) -> None:
    """A recorder that comes back takes the next free name, whatever the name ends in."""
    path = tmp_path / "run7.mcap"
    assert free_name(path) == path
    path.touch()
    assert free_name(path).name == "run7-2.mcap"
    free_name(path).touch()
    assert free_name(path).name == "run7-3.mcap"


@contextmanager
def room_for(size: int) -> Iterator[None]:
    """No file can become larger than so many bytes: to who writes it, as a disk that is full."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def half_seconds(recorder: Recorder, first: int, count: int) -> None:
    """Let it hear so many times half a second of joint states, one a millisecond."""
    inbox, rng = Inbox(recorder.inputs), np.random.default_rng(first)
    topic = next(t for t in recorder.inputs if t.name == ARM_STATE.name)
    for step in range(10 * first, 10 * (first + count)):
        for k in range(50):
            t = 0.05 * step + 0.001 * k
            inbox.offer(topic, ArmState(t, *rng.standard_normal((4, 6))), at=t)
        assert recorder.step(t, inbox) == []


@pytest.mark.parametrize("when", ["while it records", "at its end"])
def test_a_full_disk_ends_the_log_and_nothing_else(tmp_path: Path, when: str) -> None:
    """What was written before is kept; the recorder says so, goes on hearing, and ends in order."""
    recorder = Recorder(tmp_path / "run.mcap", {"record": "full"})
    half_seconds(recorder, 0, 6)
    assert recorder.state()[0] == "recording"
    kept = (tmp_path / "run.mcap").stat().st_size
    with room_for(kept + 1000):
        if when == "while it records":
            half_seconds(recorder, 6, 4)
            state, detail = recorder.state()
            assert state == "stopped"
            assert "File too large" in detail and "run.mcap" in detail
            assert "lacks 2000 messages" in detail  # from the last write that went well
        recorder.close({}, {})
    log, _, notes = read_run(tmp_path)
    times = [m.t for m in log.series(ARM_STATE)]
    assert 2.9 < times[-1] < 3.5  # 3 s were written, but for the last step, which waited
    assert times == pytest.approx([0.001 * k for k in range(len(times))])
    assert any("run.mcap" in note for note in notes)
