"""Commands that ask a running robot for something: disturbances, programs, resets."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from services.cli import base_program as cli_base_program
from services.cli.common import Json, Robot, RunDir, fail, request

Yes = Annotated[bool, typer.Option("--yes", help="Do not ask.")]

arm = typer.Typer(help="Ask the arm.", no_args_is_help=True, rich_markup_mode=None)
base = typer.Typer(help="The running platform.", no_args_is_help=True, rich_markup_mode=None)
for command in cli_base_program.COMMANDS:
    base.command()(command)


@arm.command()
def reset(robot: Robot = "r1", run_dir: RunDir = None, json: Json = False) -> None:
    """Reset the arm after a protective stop. Look at it first."""
    request("arm", "reset", {}, robot, run_dir, json)


@arm.command("stop")
def stop_now(robot: Robot = "r1", run_dir: RunDir = None, json: Json = False) -> None:
    """Protective stop, now; a person resets it."""
    request("arm", "protective_stop", {}, robot, run_dir, json)


def start(
    file: Annotated[
        Path | None, typer.Argument(help="File or name; without, the task's own.")
    ] = None,
    robot: Robot = "r1",
    run_dir: RunDir = None,
    json: Json = False,
) -> None:
    """Start a program on the running arm."""
    args: dict[str, Any] = {}
    if file is not None:
        args = {"program": str(file.resolve() if file.is_file() else file)}
    request("arm", "start", args, robot, run_dir, json)


def stop(robot: Robot = "r1", run_dir: RunDir = None, json: Json = False) -> None:
    """Stop the running program; the arm holds still."""
    request("arm", "stop", {}, robot, run_dir, json)


def pause(robot: Robot = "r1", run_dir: RunDir = None, json: Json = False) -> None:
    """Pause the running program; it can be resumed."""
    request("arm", "pause", {}, robot, run_dir, json)


def event(
    name: Annotated[str, typer.Argument(help="The event a Wait node waits for.")],
    robot: Robot = "r1",
    run_dir: RunDir = None,
    json: Json = False,
) -> None:
    """Tell the running program that something has happened."""
    request("arm", "event", {"name": name}, robot, run_dir, json)


def abort(robot: Robot = "r1", run_dir: RunDir = None, json: Json = False) -> None:
    """Abort the program: it goes to its abort node, or ends."""
    request("arm", "abort", {}, robot, run_dir, json)


def jump(
    node: Annotated[str, typer.Argument(help="Node of the paused program.")],
    yes: Yes = False,
    robot: Robot = "r1",
    run_dir: RunDir = None,
    json: Json = False,
) -> None:
    """Let a paused program go on in another node. Nothing moves before it is resumed."""
    _confirm(f"When it is resumed, the program goes on in {node}, not where it was.", yes)
    request("arm", "jump", {"node": node}, robot, run_dir, json)


def follow(
    event: Annotated[str, typer.Argument(help="Event the node handles, or Abort.")],
    yes: Yes = False,
    robot: Robot = "r1",
    run_dir: RunDir = None,
    json: Json = False,
) -> None:
    """Let a paused program go on as if its node had raised an event, once it is resumed."""
    _confirm(f"When it is resumed, the program goes on as after {event}.", yes)
    request("arm", "follow", {"event": event}, robot, run_dir, json)


def _confirm(what: str, yes: bool) -> None:
    """Have a person agree; leaves with exit code 1 if not, 2 if nobody can be asked."""
    if yes:
        return
    if not sys.stdin.isatty():
        fail(f"{what} Nobody is there to confirm: say --yes", 2)
    if not typer.confirm(f"{what} Is the robot clear?"):
        raise typer.Exit(1)


def resume(robot: Robot = "r1", run_dir: RunDir = None, json: Json = False) -> None:
    """Resume a paused program."""
    request("arm", "resume", {}, robot, run_dir, json)


@base.command("goal", context_settings={"ignore_unknown_options": True})
def goal(
    x: Annotated[float, typer.Argument(help="In the odometry frame [m].")],
    y: Annotated[float, typer.Argument(help="To the left [m].")],
    heading: Annotated[float, typer.Argument(help="Counter-clockwise [deg].")] = 0.0,
    robot: Robot = "r1",
    run_dir: RunDir = None,
    json: Json = False,
) -> None:
    """Drive the platform to a pose."""
    request(
        "base", "goal", {"x": x, "y": y, "heading": math.radians(heading)}, robot, run_dir, json
    )


@base.command("stop")
def stop_base(robot: Robot = "r1", run_dir: RunDir = None, json: Json = False) -> None:
    """Bring the platform to rest until it is told to resume."""
    request("base", "stop", {}, robot, run_dir, json)


@base.command("resume")
def resume_base(robot: Robot = "r1", run_dir: RunDir = None, json: Json = False) -> None:
    """Let the platform go on with its task."""
    request("base", "resume", {}, robot, run_dir, json)
