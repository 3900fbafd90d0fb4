"""``steadyhand disturb``: make life hard for a running simulation."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any

import typer

from services.cli.common import Json, Robot, RunDir, request
from sim.disturbance import KINDS, describe

HELP = """Disturb the running simulation, from now or from t on. The simulation judges the values.

\b
  steadyhand disturb push --force 80 --dir 90 --for 0.2 --on platform
  steadyhand disturb dropout odometry --for 1
  steadyhand disturb delay imu --ms 20
  steadyhand disturb slip distance=0.1 direction=90

Kinds and their keys:
"""


def first_line(kind: str) -> str:
    """What a kind of disturbance is."""
    return (KINDS[kind].__doc__ or "").strip().splitlines()[0]


def help_text() -> str:
    """``HELP`` and every kind with its keys, one a line."""
    blocks = []
    for kind in KINDS:
        lines = [f"{kind}: {first_line(kind)}"]
        for key, text in describe(kind).items():
            # a list of bodies is longer than a line; the robot refuses those it has not
            text = text if len(text) < 90 else text[:80].rpartition(", ")[0] + ", ..."
            lines.append(f"    {key:10} {text}")
        blocks.append("\b\n" + "\n".join(lines))
    return HELP + "\n" + "\n\n".join(blocks)


def kinds(incomplete: str) -> list[tuple[str, str]]:
    """Completions of the kind, each with what it is."""
    return [(kind, first_line(kind)) for kind in KINDS if kind.startswith(incomplete)]


def keys(ctx: typer.Context, incomplete: str) -> Iterator[tuple[str, str]]:
    """Completions of ``key=`` and of its values, for the kind that was given."""
    kind = ctx.params.get("kind")
    if kind not in KINDS:
        return
    properties = KINDS[kind].model_json_schema()["properties"]
    key, equals, value = incomplete.partition("=")
    if equals:
        choices = properties.get(key, {}).get("enum", ())
        yield from ((f"{key}={c}", "") for c in choices if c.startswith(value))
        return
    for name, text in describe(kind).items():
        if name.startswith(incomplete):
            yield f"{name}=", text


def disturb(
    kind: Annotated[str, typer.Argument(help="See below.", autocompletion=kinds)],
    options: Annotated[
        list[str] | None,
        typer.Argument(
            help="A sensor, or key=value as in a scenario; see below.", autocompletion=keys
        ),
    ] = None,
    force: Annotated[float | None, typer.Option(help="Of a push [N].")] = None,
    direction: Annotated[
        float | None,
        typer.Option("--dir", help="Towards, in the ground frame [deg]; 0 is towards the board."),
    ] = None,
    duration: Annotated[float | None, typer.Option("--for", help="How long [s].")] = None,
    on: Annotated[str | None, typer.Option(help="What is pushed: platform, link1 ...")] = None,
    distance: Annotated[float | None, typer.Option(help="Of a slip [m].")] = None,
    ms: Annotated[float | None, typer.Option(help="Extra delay of a sensor [ms].")] = None,
    factor: Annotated[float | None, typer.Option(help="Noise, times the normal.")] = None,
    value: Annotated[float | None, typer.Option(help="Bias [rad/s or m/s^2].")] = None,
    robot: Robot = "r1",
    run_dir: RunDir = None,
    json: Json = False,
) -> None:
    """Its help is ``HELP``."""
    args: dict[str, Any] = {"kind": kind}
    for option in options or []:
        name, equals, text = option.partition("=")
        args |= {name: _value(text)} if equals else {"sensor": option}
    named = {
        "force": force,
        "direction": direction,
        "duration": duration,
        "on": on,
        "distance": distance,
        "extra": None if ms is None else ms / 1000,
        "factor": factor,
        "value": value,
    }
    args |= {name: given for name, given in named.items() if given is not None}
    request("sim", "disturb", args, robot, run_dir, json)


def _value(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text


disturb.__doc__ = help_text()
