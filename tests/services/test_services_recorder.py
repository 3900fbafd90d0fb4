"""The recorder's file."""

from __future__ import annotations

from pathlib import Path

from services.logs.recorder import free_name


def test_a_log_that_is_there_is_never_written_over(tmp_path: Path) -> None:
    """A recorder that comes back takes the next free name, whatever the name ends in."""
    path = tmp_path / "run7.mcap"
    assert free_name(path) == path
    path.touch()
    assert free_name(path).name == "run7-2.mcap"
    free_name(path).touch()
    assert free_name(path).name == "run7-3.mcap"
