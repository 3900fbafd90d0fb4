"""``steadyhand doctor``: what this machine can and cannot do, and how to fix it."""

from __future__ import annotations

import importlib.metadata
import os
import resource
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Literal

import typer
from rich.table import Table

from services.cli.common import Json, console, show_json
from services.cli.progress import busy

Status = Literal["ok", "warn", "fail"]
PACKAGES = (
    "eclipse-zenoh", "numpy", "filterpy", "dartpy", "msgpack", "lark", "typer", "rich",
    "pydantic", "matplotlib", "mcap", "circus", "cryptography", "viser",
)  # fmt: skip


@dataclass(frozen=True)
class Check:
    """One thing looked at; ``fix`` says what to do when it is not ok."""

    name: str
    status: Status
    detail: str
    fix: str = ""


def doctor(json: Json = False) -> None:
    """What this machine can and cannot do. Exit code 1 if steadyhand cannot run here."""
    with busy("looking", quiet=json):
        checks = [examine(function) for function in CHECKS]
    failed = any(check.status == "fail" for check in checks)
    if json:
        show_json({"ok": not failed, "checks": [asdict(check) for check in checks]})
    else:
        table = Table(show_header=False, box=None)
        colours = {"ok": "green", "warn": "yellow", "fail": "bold red"}
        for check in checks:
            colour = colours[check.status]
            fix = f"\n[dim]fix: {check.fix}[/]" if check.status != "ok" and check.fix else ""
            table.add_row(f"[{colour}]{check.status}[/]", check.name, check.detail + fix)
        console.print(table)
    raise typer.Exit(1 if failed else 0)


def examine(function: Callable[[], Check]) -> Check:
    """Run one check; one that breaks is a failure with its reason."""
    try:
        return function()
    except Exception as error:
        name = function.__name__.lstrip("_").replace("_", " ")
        return Check(name, "fail", f"{type(error).__name__}: {error}", "make setup")


def _python() -> Check:
    version = sys.version.split()[0]
    status: Status = "ok" if sys.version_info >= (3, 11) else "fail"
    return Check("Python", status, version, "install Python 3.11 or newer")


def _packages() -> Check:
    missing, found = [], []
    for name in PACKAGES:
        try:
            found.append(f"{name} {importlib.metadata.version(name)}")
        except importlib.metadata.PackageNotFoundError:
            missing.append(name)
    if missing:
        return Check("packages", "fail", f"missing: {', '.join(missing)}", "make setup")
    return Check("packages", "ok", ", ".join(found))


def _cores() -> Check:
    from services.live.realtime import ENOUGH_CORES, cores

    if cores() >= ENOUGH_CORES:
        return Check("cores", "ok", f"{cores()}")
    return Check(
        "cores",
        "warn",
        f"{cores()}: real-time priority and spinning stay off, loops share cores",
        f"use a machine with {ENOUGH_CORES} cores, or `up --paced`: exact however slow",
    )


def _priority() -> Check:
    fix = "ulimit -r 50: rtprio in /etc/security/limits.conf; in a container --cap-add SYS_NICE"
    pid = os.fork()  # tried in a child: this process stays as it is
    if pid == 0:
        try:
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(50))
        except OSError:
            os._exit(1)
        os._exit(0)
    allowed = os.waitpid(pid, 0)[1] == 0
    detail = "SCHED_FIFO 50 permitted" if allowed else "SCHED_FIFO not permitted"
    return Check("priority", "ok" if allowed else "warn", detail, fix)


def _memory_lock() -> Check:
    soft, _ = resource.getrlimit(resource.RLIMIT_MEMLOCK)
    if soft == resource.RLIM_INFINITY or os.geteuid() == 0:
        return Check("memory lock", "ok", "permitted")
    fix = "ulimit -l unlimited: memlock in /etc/security/limits.conf"
    return Check("memory lock", "warn", f"limited to {soft // 1024} kB", fix)


def _governor() -> Check:
    path = Path("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor")
    if not path.exists():
        return Check("frequency governor", "ok", "none here (virtual machine, or fixed frequency)")
    governor = path.read_text().strip()
    status: Status = "ok" if governor == "performance" else "warn"
    return Check("frequency governor", status, governor, "cpupower frequency-set -g performance")


def _run_directory() -> Check:
    from services.wire.endpoints import default_run_dir, make_run_dir

    directory = make_run_dir(default_run_dir("r1"))
    mode = directory.stat().st_mode & 0o777
    if mode & 0o022:
        return Check(
            "run directory", "fail", f"{directory}: others may write", f"chmod 700 {directory}"
        )
    return Check("run directory", "ok", str(directory))


def _bus() -> Check:
    from services.messages import BaseCommand, Odometry
    from services.service import Inbox
    from services.topics import BASE_COMMAND, ODOMETRY
    from services.wire.bus import open_bus
    from services.wire.endpoints import local

    trips: list[float] = []
    with (
        tempfile.TemporaryDirectory(prefix="sh") as name,
        open_bus(local(Path(name), "sim"), "doctor", "sim", [BASE_COMMAND]) as robot,
        open_bus(local(Path(name), "base"), "doctor", "base", [ODOMETRY]) as base,
    ):
        done = threading.Event()
        robot.wake_on(BASE_COMMAND)
        base.wake_on(ODOMETRY)

        def echo() -> None:
            inbox = Inbox([ODOMETRY])
            while not done.is_set():
                base.arrived.wait(0.1)
                base.arrived.clear()
                for _, message, _ in base.drain(inbox, None):
                    base.publish(BASE_COMMAND, BaseCommand(message.t, message.pose))  # type: ignore[attr-defined]

        thread = threading.Thread(target=echo)
        thread.start()
        inbox = Inbox([BASE_COMMAND])
        import numpy as np

        for number in range(500):
            start = time.perf_counter()
            robot.publish(ODOMETRY, Odometry(float(number), np.zeros(3)))
            if robot.arrived.wait(0.2):
                trips.append(time.perf_counter() - start)
                robot.arrived.clear()
            robot.drain(inbox, None)
            time.sleep(0.001)
        done.set()
        thread.join()
    if len(trips) < 100:
        return Check("bus", "fail", f"{len(trips)} of 500 answers over a unix socket")
    trips = sorted(trips)
    p50, p99 = trips[len(trips) // 2] * 1e6, trips[int(0.99 * len(trips))] * 1e6
    return Check("bus", "ok", f"round trip p50 {p50:.0f} us, p99 {p99:.0f} us ({len(trips)} trips)")


def _physics() -> Check:
    from services.components import build_service
    from services.service import Inbox

    sim = build_service("sim", "whiteboard", 0)
    inbox, ticks = Inbox(sim.inputs), 500
    for tick in range(100):
        sim.step(tick * sim.period, inbox)
    start = time.perf_counter()
    for tick in range(100, 100 + ticks):
        sim.step(tick * sim.period, inbox)
    step = (time.perf_counter() - start) / ticks
    status: Status = "ok" if step < 0.4 * sim.period else "warn"
    detail = f"a step of {sim.period * 1e3:.0f} ms takes {step * 1e6:.0f} us"
    return Check("simulation (DART)", status, detail, "use `up --paced`; real time will not hold")


CHECKS = (
    _python, _packages, _cores, _priority, _memory_lock, _governor, _run_directory, _bus, _physics,
)  # fmt: skip
