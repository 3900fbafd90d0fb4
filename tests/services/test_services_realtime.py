"""What is asked of the scheduler takes effect where it counts."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ASK = """
import os
from pathlib import Path
from services.live import realtime, standby
{calls}
print(os.nice(0), Path("/proc/self/autogroup").read_text().split()[-1])
"""


AUTOGROUP = Path("/proc/self/autogroup")


def nice_values(calls: str, own_session: bool = True) -> list[int]:
    """Of a process, and of its session, after some calls."""
    if not AUTOGROUP.exists() or os.geteuid() != 0:
        pytest.skip("needs root, and a kernel with CONFIG_SCHED_AUTOGROUP")
    argv = [sys.executable, "-c", ASK.format(calls=calls)]
    said = subprocess.run(
        argv, capture_output=True, text=True, check=True, start_new_session=own_session
    ).stdout
    return [int(word) for word in said.split()]


def test_a_service_is_favoured_before_other_sessions() -> None:
    """Its nice value would count among its own threads only: its session's is set as well."""
    assert nice_values("realtime.favour('auto')") == [-10, -10]
    assert nice_values("realtime.favour('auto', realtime.RECORDER_NICE)") == [-5, -5]
    assert nice_values("realtime.favour('off')")[1] == 0


def test_a_spare_steps_back_behind_other_sessions_and_forward_again() -> None:
    """Getting ready takes from nobody; taking over is not held back."""
    assert nice_values("standby.step_back()") == [10, 10]
    assert nice_values("standby.step_back(); standby.step_forward()") == [0, 0]


def test_a_session_of_others_is_left_alone() -> None:
    """A process that does not lead its session speaks for itself only."""
    before = AUTOGROUP.read_text().split() if AUTOGROUP.exists() else []
    if not before:
        pytest.skip("the session of these tests is in no group, as in some containers")
    assert nice_values("realtime.favour('auto')", own_session=False) == [-10, int(before[-1])]
