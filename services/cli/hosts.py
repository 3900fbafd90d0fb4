"""``steadyhand hosts``: all hosts of a hosts file on this machine, in network namespaces."""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Annotated

import typer
from rich.text import Text

from services.cli import hosts_try as cli_hosts_try
from services.cli.common import console, fail

hosts = typer.Typer(
    help="Robots spread over several hosts.", no_args_is_help=True, rich_markup_mode=None
)
hosts.command(name="try")(cli_hosts_try.try_)

PATIENCE = 40.0  # [s] for a host to end: its recorder may have a log to finish


@hosts.command()
def check(
    file: Annotated[Path, typer.Argument(help="Hosts file: a path, or a name: three.")],
) -> None:
    """Read a hosts file: where each service can be reached, and whether 'hosts up' works here."""
    from deploy.host_file import load_hosts
    from deploy.tomlfile import BadFile
    from services.live.namespaces import NotPermitted, network

    try:
        places = load_hosts(file)
    except BadFile as error:
        fail(str(error), 2)
    for name, host in places.host.items():
        for service in host.services:
            console.print(f"{name:8} {service:9} {places.locators(service)[0]}", highlight=False)
    try:
        with network({name: host.address for name, host in places.host.items()}, places.link):
            console.print("namespaces: permitted here")
    except NotPermitted as error:
        console.print(f"namespaces: {error}", highlight=False)


@hosts.command()
def up(
    file: Annotated[Path, typer.Argument(help="Hosts file: a path, or a name: three.")],
    scenario: Annotated[str, typer.Option(help="Instead of the file's.")] = "",
    duration: Annotated[float, typer.Option("--for", help="End after this at the latest [s].")] = (
        120.0
    ),
    seed: Annotated[int, typer.Option(min=0, help="Of everything random.")] = 0,
    cut: Annotated[str, typer.Option(help="Take this host off the network for a while.")] = "",
    at: Annotated[float, typer.Option(help="When, after the arm's start [s].")] = 15.0,
    cut_for: Annotated[float, typer.Option(help="For how long [s].")] = 1.0,
    resume_after: Annotated[
        float, typer.Option(help="Resume the program so long after the cut is over [s].")
    ] = 3.0,
    good: Annotated[bool, typer.Option("--good", help="A network without faults.")] = False,
    out: Annotated[Path | None, typer.Option(help="Folder for everything.")] = None,
) -> None:
    """Run every host in a network namespace of its own, with mutual TLS and the file's bad links.

    Ends when the arm's program has, like 'up --until-finished'. Needs root.
    """
    from deploy.host_file import Link, load_hosts
    from deploy.tomlfile import BadFile
    from services.live.namespaces import NotPermitted, network
    from services.wire.keys import make_keys

    try:
        places = load_hosts(file)
    except BadFile as error:
        fail(str(error), 2)
    if cut and cut not in places.host:
        fail(f"no host {cut!r}. Known: {', '.join(places.host)}", 2)
    arm = places.place("arm") or next(iter(places.host))
    folder = (out or Path("runs") / f"hosts-{time.strftime('%Y%m%d-%H%M%S')}").resolve()
    keys = folder / "keys"
    about = {name: (host.address, host.services) for name, host in places.host.items()}
    make_keys(keys, places.robot, about, days=2)
    copy = folder / "hosts.toml"
    copy.write_text(_path_of(file).read_text(encoding="utf-8"), encoding="utf-8")
    addresses = {name: host.address for name, host in places.host.items()}
    running: dict[str, subprocess.Popen[str]] = {}
    ended: dict[str, int] = {}

    def command(host: str) -> list[str]:
        argv = [sys.executable, "-m", "services.cli", "up", *filter(None, [scenario])]
        argv += ["--hosts", str(copy), "--host", host, "--keys", str(keys / host)]
        argv += ["--seed", str(seed), "--for", str(duration), "--out", str(folder / host)]
        argv += ["--run-dir", str(folder / f"run-{host}")]
        return argv + (["--until-finished"] if host == arm else [])

    started = threading.Event()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # leave nothing behind

    def tell(host: str) -> None:
        for line in running[host].stdout or ():
            console.print(Text(f"{host:8} {line.rstrip()}"), soft_wrap=True)
            if host == arm and " arm " in line and " running" in line:
                started.set()

    try:
        with network(addresses, Link() if good else places.link, seed) as net:
            console.print(f"links made bad by {net.how}", highlight=False)
            try:
                for host in places.host:
                    running[host] = subprocess.Popen(
                        net.command(host, *command(host)),
                        stdout=subprocess.PIPE,
                        stderr=subprocess.STDOUT,
                        text=True,
                    )
                    threading.Thread(target=tell, args=(host,), daemon=True).start()
                if cut and _wait(running[arm], started, duration):
                    _wait(running[arm], threading.Event(), at)
                    console.print(f"[yellow]{cut} is off the network for {cut_for:g} s[/]")
                    net.cut(cut)
                    time.sleep(cut_for)
                    net.join(cut)
                    _wait(running[arm], threading.Event(), resume_after)
                    resume = ["program", "resume", "--run-dir", str(folder / f"run-{arm}")]
                    subprocess.run(
                        net.command(arm, sys.executable, "-m", "services.cli", *resume), check=False
                    )
                running[arm].wait(duration + 2 * PATIENCE)
            finally:
                for process in running.values():
                    if process.poll() is None:
                        process.send_signal(signal.SIGINT)
                for host, process in running.items():
                    try:
                        ended[host] = process.wait(PATIENCE)
                    except subprocess.TimeoutExpired:
                        process.kill()
                        ended[host] = process.wait()
    except NotPermitted as error:
        fail(str(error))
    except subprocess.TimeoutExpired:
        fail(f"{arm} did not end within {2 * PATIENCE:g} s of its time")
    time.sleep(0.2)  # the last lines
    console.print(f"everything in {folder}", highlight=False)
    raise typer.Exit(0 if not any(ended.values()) else 1)


def _wait(process: subprocess.Popen[str], event: threading.Event, longest: float) -> bool:
    """Wait for an event while a process runs; whether it came."""
    deadline = time.monotonic() + longest
    while process.poll() is None and time.monotonic() < deadline:
        if event.wait(0.1):
            return True
    return event.is_set()


def _path_of(file: Path) -> Path:
    from deploy.host_file import HOSTS

    return file if file.exists() else HOSTS / f"{file}.toml"
