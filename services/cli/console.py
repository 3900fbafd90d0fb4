"""``steadyhand console``: the page of a running robot, or of a log."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from services.cli.common import Robot, RunDir, console, fail, hosts, running


def console_(
    log: Annotated[
        Path | None, typer.Option(help="Play this log, or the log in this folder, instead.")
    ] = None,
    port: Annotated[
        int, typer.Option(min=0, max=65535, help="To listen on; 0 for any that is free.")
    ] = 8080,
    scenario: Annotated[
        str | None, typer.Option(help="What to draw; by default what `up` says it runs.")
    ] = None,
    robot: Robot = "r1",
    run_dir: RunDir = None,
) -> None:
    """Serve the page until Ctrl-C. It may be there before the robot, and outlive it.

    It listens on 127.0.0.1 only; from another machine: ssh -L 8080:127.0.0.1:8080 HOST. With
    STEADYHAND_HOSTS and STEADYHAND_KEYS it is the page of a robot on several hosts.
    """
    from deploy.tomlfile import BadFile
    from services.console.server import PortInUse
    from services.logs.runlog import BadLog
    from services.wire.endpoints import default_run_dir

    try:
        if log is not None:
            _play(log, port)
            return
        from services.console.live import serve

        spread = hosts() if run_dir is None else None
        if spread is not None:
            robot, scenario = spread.robot, scenario or spread.scenario
        console.print(f"robot {robot}, Ctrl-C ends", highlight=False)
        endpoints = None if spread is None else running(robot, None)
        serve(robot, run_dir or default_run_dir(robot), port, scenario, _say, endpoints)
    except (PortInUse, BadLog) as error:
        fail(str(error))
    except BadFile as error:
        fail(str(error), 2)


def _say(url: str) -> None:
    console.print(f"the page is {url}", highlight=False, soft_wrap=True)


def _play(path: Path, port: int) -> None:
    import signal
    import threading

    from services.console.playback import Playback, open_log
    from services.console.server import Server

    with console.status(f"reading {path}"):
        log, scenario = open_log(path)
    stop = threading.Event()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: stop.set())
    server = Server(port, f"{path.name}")
    try:
        playback = Playback(server, log, scenario)
        console.print(f"{playback.end - playback.start:.1f} s, Ctrl-C ends", highlight=False)
        _say(server.url)
        playback.run(stop)
    finally:
        server.stop()
