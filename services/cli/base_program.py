"""``steadyhand base start, abort, event``: programs of the running platform."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any

import typer

from services.cli.common import Json, Robot, RunDir, request

Pose = tuple[float, float, float]


def start(
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
    args: dict[str, Any] = {}
    if file is not None:
        args["program"] = str(file.resolve() if file.is_file() else file)
    for name, pose in (("goal", goal), ("object", object)):
        if pose is not None:
            args[name] = [pose[0], pose[1], math.radians(pose[2])]
    request("base", "start", args, robot, run_dir, json)


def abort(robot: Robot = "r1", run_dir: RunDir = None, json: Json = False) -> None:
    """Abort the platform's program: it goes to its abort node, or ends."""
    request("base", "abort", {}, robot, run_dir, json)


def event(
    name: Annotated[str, typer.Argument(help="The event a Wait node waits for.")],
    robot: Robot = "r1",
    run_dir: RunDir = None,
    json: Json = False,
) -> None:
    """Tell the platform's program that something has happened."""
    request("base", "event", {"name": name}, robot, run_dir, json)


COMMANDS = (start, abort, event)
