"""The spare's side of ``spares``: get ready without being in the way, and wait."""

from __future__ import annotations

import os
import resource
from pathlib import Path

from services.live.realtime import be_nice

_LOW = 10
"""Below ordinary programs; at 19, those that never rest would keep a spare from getting ready."""
_LEAVES_IT = 20  # an RLIMIT_NICE that allows to come back to nice value 0


def wait_for_turn(pipe: Path) -> None:
    """Say that it is ready, and wait; end if it is not wanted any more."""
    reader = os.open(pipe, os.O_RDONLY)  # at once: the supervisor has it open for writing
    ready_mark(pipe).touch()
    wanted = os.read(reader, 1)
    os.close(reader)
    if not wanted:  # the supervisor has closed the pipe
        os._exit(0)


def step_back() -> None:
    """Leave the processor to the others, if one may come back from that."""
    may_return = resource.getrlimit(resource.RLIMIT_NICE)[0] >= _LEAVES_IT
    if os.geteuid() == 0 or may_return:
        be_nice(_LOW)
    else:
        os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))


def step_forward() -> None:
    """Be an ordinary process again."""
    if os.sched_getscheduler(0) == os.SCHED_BATCH:
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    else:
        be_nice(0)


def ready_mark(pipe: Path) -> Path:
    """A file that is there once the spare waits."""
    return pipe.with_suffix(".ready")
