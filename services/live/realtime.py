"""Real-time set-up: everything is tried, every result is said, nothing of it is required.

Call it after the whole tick was run a few hundred times. Pages are locked as they are touched:
locking all that is mapped would fault in five times the memory and cost a tenth of a second.
"""

from __future__ import annotations

import ctypes
import gc
import os
import resource
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Literal

Mode = Literal["auto", "on", "off"]

PRIORITY = 50
NICE = -10
RECORDER_NICE = -5
"""After the loops, before what merely starts up: who sends does not wait, and a unix socket holds
but 0.2 s of what is said."""
ENOUGH_CORES = 4  # below, a spinning or real-time loop would starve the processes it talks to
SPIN = 150e-6  # [s]
BLAS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
_AUTOGROUP = Path("/proc/self/autogroup")
_PR_SET_PDEATHSIG = 1
_MCL = 1 | 2 | 4  # current and future pages, each locked when first touched


def one_blas_thread() -> None:
    """Ask for one BLAS thread; only heard before numpy is imported."""
    for name in BLAS:
        os.environ.setdefault(name, "1")


def die_with_parent(parent: int) -> None:
    """Have the kernel kill this process when its parent dies, even if it hangs.

    Args:
        parent: process id of the parent; if it is already gone this process ends at once.
    """
    libc = ctypes.CDLL(None, use_errno=True)
    libc.prctl(_PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
    if os.getppid() != parent:
        os._exit(1)


def cores() -> int:
    """Cores this process may use."""
    return len(os.sched_getaffinity(0))


def wanted(mode: Mode) -> bool:
    """Whether priority, pinning and spinning are to be tried."""
    return mode == "on" or (mode == "auto" and cores() >= ENOUGH_CORES)


def spin(mode: Mode, period: float) -> float:
    """How long a loop of this period may busy-wait before its deadline [s]."""
    return SPIN if wanted(mode) and period <= 0.002 else 0.0


def favour(mode: Mode, nice: int = NICE) -> str:
    """Ask to be served before ordinary programs; called before threads start, which inherit it.

    Unlike real-time priority it starves nobody, so it is tried on machines with few cores too.
    """
    if mode == "off":
        return "nice value: default, as asked"
    return _try(f"nice value {nice}", lambda: be_nice(nice))


def be_nice(nice: int) -> None:
    """Set the nice value of the calling thread, and of the session if the process leads one.

    Where Linux groups processes by session (``sched_autogroup_enabled``, as on desktops), a nice
    value counts only among those of one session, and sessions are weighed by values of their own.
    The supervisor starts each service in a session of its own.

    Raises:
        OSError: not permitted.
    """
    os.setpriority(os.PRIO_PROCESS, 0, nice)
    if os.getsid(0) == os.getpid() and _AUTOGROUP.exists():
        _AUTOGROUP.write_text(str(nice))


def set_up(mode: Mode, index: int) -> list[str]:
    """Try everything for the calling thread.

    Args:
        mode: ``auto`` uses priority and pinning only with enough cores.
        index: of this process among its peers; decides which core it gets.

    Returns:
        One line per measure: what was done, or why not and what would help.
    """
    if mode == "off":
        return ["real-time set-up: off, as asked"]
    out = [_try("memory locked", lock_memory), _try("garbage collector frozen", _freeze)]
    threads = {os.environ.get(name, "default") for name in BLAS}
    out.append(f"BLAS threads: {', '.join(sorted(threads))}")
    if not wanted(mode):
        out.append(f"priority, core, spinning: not used, {cores()} cores are too few (--rt on)")
        return out
    out.append(_try(f"priority SCHED_FIFO {PRIORITY}", fifo))
    available = sorted(os.sched_getaffinity(0))
    core = available[-1 - index % len(available)]
    out.append(_try(f"pinned to core {core}", lambda: os.sched_setaffinity(0, {core})))
    return out


def _try(what: str, action: Callable[[], object]) -> str:
    try:
        action()
    except OSError as error:
        return f"{what}: NO, {error.strerror or error}"
    return f"{what}: yes"


def fifo() -> None:
    """Real-time priority for the calling thread.

    Raises:
        OSError: not permitted; the text says what would help.
    """
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
    except PermissionError as error:
        raise OSError(f"not permitted (ulimit -r {PRIORITY}, or CAP_SYS_NICE)") from error


def lock_memory() -> None:
    """Keep all memory of this process in RAM.

    Raises:
        OSError: not permitted; the text says what would help.
    """
    soft, _ = resource.getrlimit(resource.RLIMIT_MEMLOCK)
    if soft != resource.RLIM_INFINITY and os.geteuid() != 0:
        # under a finite limit it may succeed now, and a later allocation fail
        raise OSError(f"limit is {soft // 1024} kB (ulimit -l unlimited, or CAP_IPC_LOCK)")
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.mlockall(_MCL) != 0:
        raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))


def _freeze() -> None:
    gc.collect()
    gc.freeze()
    gc.disable()  # the heartbeat collects the young generations instead
