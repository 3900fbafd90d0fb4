"""Commands that ask a running robot for something: programs, goals, resets."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

from services.cli.common import Json, Robot, RunDir, fail, request

Pose = tuple[float, float, float]
Yes = Annotated[bool, typer.Option("--yes", help="Do not ask.")]
Command = Callable[..., None]

arm = typer.Typer(help="Ask the arm.", no_args_is_help=True, rich_markup_mode=None)
base = typer.Typer(help="The running platform.", no_args_is_help=True, rich_markup_mode=None)


def plain(service: str, verb: str, doc: str) -> Command:
    """A command, with this help, that asks a service for something without any arguments."""

    def command(robot: Robot = "r1", run_dir: RunDir = None, json: Json = False) -> None:
        request(service, verb, {}, robot, run_dir, json)

    command.__doc__ = doc
    return command


def event(service: str, doc: str) -> Command:
    """A command, with this help, that tells a service's program of an event."""

    def command(
        name: Annotated[str, typer.Argument(help="The event a Wait node waits for.")],
        robot: Robot = "r1",
        run_dir: RunDir = None,
        json: Json = False,
    ) -> None:
        request(service, "event", {"name": name}, robot, run_dir, json)

    command.__doc__ = doc
    return command


def start(
    file: Annotated[
        Path | None, typer.Argument(help="File or name; without, the task's own.")
    ] = None,
    robot: Robot = "r1",
    run_dir: RunDir = None,
    json: Json = False,
) -> None:
    """Start a program on the running arm."""
    request("arm", "start", _program(file), robot, run_dir, json)


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


def start_base(
    file: Annotated[
        Path | None, typer.Argument(help="File, or name in base/programs; without, the task's own.")
    ] = None,
    goal: Annotated[
        Pose | None, typer.Option(help="The program's goal: x, y [m], heading [deg].")
    ] = None,
    object: Annotated[
        Pose | None, typer.Option(help="Its object: x, y [m], heading out of its front [deg].")
    ] = None,
    robot: Robot = "r1",
    run_dir: RunDir = None,
    json: Json = False,
) -> None:
    """Start a program on the running platform."""
    args = _program(file)
    for name, pose in (("goal", goal), ("object", object)):
        if pose is not None:
            args[name] = [pose[0], pose[1], math.radians(pose[2])]
    request("base", "start", args, robot, run_dir, json)


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


def _program(file: Path | None) -> dict[str, Any]:
    """What a request to start says of the program's file."""
    return {} if file is None else {"program": str(file.resolve() if file.is_file() else file)}


def _confirm(what: str, yes: bool) -> None:
    """Have a person agree; leaves with exit code 1 if not, 2 if nobody can be asked."""
    if yes:
        return
    if not sys.stdin.isatty():
        fail(f"{what} Nobody is there to confirm: say --yes", 2)
    if not typer.confirm(f"{what} Is the robot clear?"):
        raise typer.Exit(1)


PROGRAM: dict[str, Command] = {
    "start": start,
    "stop": plain("arm", "stop", "Stop the running program; the arm holds still."),
    "abort": plain("arm", "abort", "Abort the program: it goes to its abort node, or ends."),
    "pause": plain("arm", "pause", "Pause the running program; it can be resumed."),
    "resume": plain("arm", "resume", "Resume a paused program."),
    "jump": jump,
    "follow": follow,
    "event": event("arm", "Tell the running program that something has happened."),
}
"""What ``steadyhand program`` asks of the arm."""

ARM: dict[str, Command] = {
    "reset": plain("arm", "reset", "Reset the arm after a protective stop. Look at it first."),
    "stop": plain("arm", "protective_stop", "Protective stop, now; a person resets it."),
}

BASE: dict[str, Command] = {
    "start": start_base,
    "abort": plain(
        "base", "abort", "Abort the platform's program: it goes to its abort node, or ends."
    ),
    "event": event("base", "Tell the platform's program that something has happened."),
    "goal": goal,
    "stop": plain("base", "stop", "Bring the platform to rest until it is told to resume."),
    "resume": plain("base", "resume", "Let the platform go on with its task."),
}

for name, command in ARM.items():
    arm.command(name)(command)
for name, command in BASE.items():
    # a negative number is no option
    settings = {"ignore_unknown_options": True} if command is goal else None
    base.command(name, context_settings=settings)(command)
