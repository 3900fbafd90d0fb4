"""What the commands share: options, consoles, a session, errors that say what to do next."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

import typer
from rich.console import Console

if TYPE_CHECKING:
    import zenoh

    from deploy.host_file import Hosts
    from services.wire.endpoints import Endpoints

console = Console()
errors = Console(stderr=True, soft_wrap=True)
"""Keeps its lines whole: whoever pipes or greps them wants them so."""

OBSERVERS = "ekf, imm, undelayed, taylor, hold, or truth."
"""Help of an option that names an observer; ``observer.KINDS``, which is slow to import."""
Robot = Annotated[str, typer.Option(help="Name of the robot on the network.")]
RunDir = Annotated[
    Path | None, typer.Option(help="Where its sockets and logs are; by default one per robot.")
]
Json = Annotated[bool, typer.Option("--json", help="Plain JSON, for scripts.")]


def fail(text: str, code: int = 1) -> NoReturn:
    """Say what is wrong and what to do next; leave with an exit code."""
    errors.print(f"[bold red]error:[/] {_escape(text)}", highlight=False)
    raise typer.Exit(code)


@contextmanager
def writing() -> Iterator[None]:
    """Leave with an error that names the file if something inside cannot be written."""
    try:
        yield
    except OSError as error:
        fail(f"cannot write to {error.filename}: {error.strerror}", 2)


def show_json(value: Any) -> None:
    """Print JSON, one document."""
    typer.echo(json.dumps(value, indent=2, default=_jsonable))


def _jsonable(value: Any) -> Any:
    return value.tolist() if hasattr(value, "tolist") else str(value)


def _escape(text: str) -> str:
    from rich.markup import escape

    return escape(text)


def running(robot: str, run_dir: Path | None) -> Endpoints:
    """Where to reach a running robot; leaves with an error if nobody ever listened there.

    ``STEADYHAND_HOSTS`` and ``STEADYHAND_KEYS`` name a hosts file and a person's keys: then it is
    reached over the network.
    """
    spread = hosts() if run_dir is None else None
    if spread is not None:
        return _elsewhere(spread, os.environ.get("STEADYHAND_KEYS", ""))
    from services.wire.endpoints import default_run_dir, local

    directory = run_dir or default_run_dir(robot)
    if not any(directory.glob("*.sock")):
        fail(
            f"robot {robot} is not running (nothing listens in {directory}). Start it: "
            "steadyhand up; if it runs elsewhere, give its --run-dir"
        )
    return local(directory)


def hosts() -> Hosts | None:
    """The hosts file that ``STEADYHAND_HOSTS`` names; None if it names none.

    Raises:
        BadFile: it cannot be used; ``main`` says so.
    """
    if "STEADYHAND_HOSTS" not in os.environ:
        return None
    from deploy.host_file import load_hosts

    return load_hosts(os.environ["STEADYHAND_HOSTS"])


def _elsewhere(spread: Hosts, keys: str) -> Endpoints:
    from services.wire.places import endpoints_for_people

    if not keys:
        fail("STEADYHAND_HOSTS needs STEADYHAND_KEYS, the folder from steadyhand keys", 2)
    return endpoints_for_people(spread, Path(keys))


@contextmanager
def connected(robot: str, run_dir: Path | None) -> Iterator[zenoh.Session]:
    """A session that reaches a running robot."""
    endpoints = running(robot, run_dir)
    import zenoh

    from services.wire.endpoints import config

    with zenoh.open(config(endpoints)) as session:
        yield session


def request(
    service: str,
    verb: str,
    args: dict[str, Any],
    robot: str,
    run_dir: Path | None,
    as_json: bool = False,
) -> None:
    """Send a request and print the answer; exit code 1 when refused or nobody answers."""
    from services.requests import NoAnswer, ask

    try:
        with connected(robot, run_dir) as session:
            reply = ask(session, robot, service, verb, args)
    except NoAnswer as error:
        if as_json:
            show_json({"accepted": False, "reason": str(error), "answered": False})
            raise typer.Exit(1) from None
        fail(f"{error}. Is it up and well? steadyhand watch loops")
    if as_json:
        show_json({"accepted": reply.accepted, "reason": reply.reason, "answered": True})
        raise typer.Exit(0 if reply.accepted else 1)
    if not reply.accepted:
        fail(f"{service} refused: {reply.reason}")
    console.print(
        f"[green]accepted[/] {_escape(reply.reason)}".rstrip(), highlight=False, soft_wrap=True
    )
