"""Lets the tests, and the processes they start, import what is beside them; one running robot."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

HERE = str(Path(__file__).parent)
sys.path.insert(0, HERE)
os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, [HERE, os.environ.get("PYTHONPATH", "")]))


@pytest.fixture(scope="module")
def shared_robot() -> Iterator[Path]:
    """Home of one robot for all who only talk to it; a short path, for its sockets are in it.

    It runs as fast as it can, and so not longer than the module that needs it.
    """
    from live_robot import running

    with TemporaryDirectory(prefix="sh", ignore_cleanup_errors=True) as home, running(Path(home)):
        yield Path(home)


@pytest.fixture
def robot_home(shared_robot: Path) -> Path:
    """The same, whatever the test before did to it: it sways, and has just begun to draw."""
    from live_robot import begin_anew

    begin_anew(shared_robot)
    return shared_robot
