"""``steadyhand watch``: what the services say, live in a terminal or once for a script."""

from __future__ import annotations

import dataclasses
import difflib
import time
from collections.abc import Callable
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Group, RenderableType
from rich.live import Live
from rich.table import Table
from rich.text import Text

from services.cli.common import Json, Robot, RunDir, console, fail, running, show_json
from services.messages import ArmStatus, BaseStatus, Estimate, Health, Message
from services.topics import ARM_STATUS, BASE_STATUS, ESTIMATE, HEALTH, PROCESSES, TOPICS, Topic

VIEWS: dict[str, tuple[Topic, ...]] = {
    "estimate": (ESTIMATE,),
    "loops": tuple(HEALTH[name] for name in PROCESSES),
    "arm": (ARM_STATUS,),
    "base": (BASE_STATUS,),
}
WAIT = 10.0  # [s] for a first message
SILENT = 1.5  # [s] behind the others; a heartbeat comes five times a second

Heard = dict[str, Message]


def watch(
    what: Annotated[
        str,
        typer.Argument(
            help="estimate, loops, arm or base.",
            autocompletion=lambda incomplete: [v for v in VIEWS if v.startswith(incomplete)],
        ),
    ] = "loops",
    once: Annotated[bool, typer.Option("--once", help="One look, then end.")] = False,
    rate: Annotated[float, typer.Option(help="Looks per second.")] = 8.0,
    robot: Robot = "r1",
    run_dir: RunDir = None,
    json: Json = False,
) -> None:
    """Watch a running robot. Exit code 1 if nobody says anything."""
    if what not in VIEWS:
        near = difflib.get_close_matches(what, VIEWS, n=1)
        meant = f", did you mean {near[0]!r}?" if near else "."
        fail(f"no view {what!r}{meant} Known: {', '.join(VIEWS)}", 2)
    endpoints = running(robot, run_dir)
    from services.service import Inbox
    from services.wire.bus import open_bus

    topics = VIEWS[what]
    inbox, heard = Inbox(topics), Heard()
    with open_bus(endpoints, robot, "watch", topics) as bus:

        def look() -> Heard:
            for topic, message, _ in bus.drain(inbox, None):
                heard[topic.name] = message
            return heard

        deadline = time.monotonic() + WAIT
        while len(look()) < len(topics) and time.monotonic() < deadline:
            if heard:  # the others are there by now, or they are not
                deadline = min(deadline, time.monotonic() + SILENT)
            time.sleep(0.02)
        if not heard:
            fail(f"nobody speaks on {', '.join(t.name for t in topics)}. Is it up? steadyhand up")
        if json:
            show_json({name: dataclasses.asdict(message) for name, message in heard.items()})
        elif once:
            console.print(render(heard))
        else:
            _live(look, 1 / max(0.5, min(rate, 30.0)))


def _live(look: Callable[[], Heard], period: float) -> None:
    try:
        with Live(console=console, auto_refresh=False) as live:
            newest, since = -1.0, time.monotonic()
            while True:
                heard = look()
                t = max(message.t for message in heard.values())
                if t > newest:
                    newest, since = t, time.monotonic()
                silence = time.monotonic() - since
                note = (
                    Text(f"silent for {silence:.1f} s", "bold red") if silence > SILENT else Text()
                )
                live.update(Group(render(heard), note), refresh=True)
                time.sleep(period)
    except KeyboardInterrupt:
        return


def render(heard: Heard) -> RenderableType:
    """A table of what was heard."""
    first = next(iter(heard.values()))
    if isinstance(first, Health):
        return _loops(heard)
    rows = {Estimate: _estimate, ArmStatus: _arm, BaseStatus: _base}[type(first)](first)
    table = Table(title=f"{next(iter(heard))} at {first.t:.3f} s", show_header=False)
    for name, value in rows:
        bad = "bold red" if value.startswith("NO") else ""
        table.add_row(Text(name), Text(value, bad))
    return table


def _loops(heard: Heard) -> Table:
    """One row per service: state, restarts, figures; below, why, its inputs and refusals."""
    table = Table(title="loops (milliseconds)", box=None, pad_edge=False)
    for column in ("", "state"):
        table.add_column(column)
    for column in ("restarts", "Hz", "longest", "late 50%", "99%", "max", "missed"):
        table.add_column(column, justify="right")
    newest = max(health.t for health in heard.values())
    for name in sorted(heard, key=lambda name: list(TOPICS).index(name)):
        health = heard[name]
        assert isinstance(health, Health)
        period, late = health.period, health.lateness
        mean = period.get("mean", 0.0)
        silent = newest - health.t > SILENT
        table.add_row(
            Text(health.service, "bold red" if silent else "bold"),
            Text("silent", "bold red") if silent else Text(health.state),
            Text(str(health.restarts), "yellow" if health.restarts else ""),
            f"{1 / mean:.0f}" if mean else "-",
            _ms(period.get("max")),
            *(_ms(late.get(key)) for key in ("p50", "p99", "max")),
            str(health.overruns),
        )
    lines = []
    for health in heard.values():
        assert isinstance(health, Health)
        ages = ", ".join(f"{key} {age * 1e3:.0f} ms" for key, age in health.ages.items())
        refused = ", ".join(f"{key} {count}" for key, count in health.refused.items())
        said = [health.detail] * bool(health.detail) + [f"heard {ages}"] * bool(ages)
        lines += [f"{health.service}: {'; '.join(said)}"] if said else []
        lines += [f"{health.service}: refused {refused}"] if refused else []
    table.caption = Text("\n".join(lines))
    table.caption_justify = "left"
    return table


def _ms(seconds: float | None) -> str:
    return "-" if seconds is None else f"{seconds * 1e3:.2f}"


def _estimate(e: Any) -> list[tuple[str, str]]:
    sigma = np.sqrt(np.maximum(np.diag(e.covariance), 0.0))
    return [
        ("usable", f"yes {e.reason}".rstrip() if e.valid else f"NO: {e.reason}"),
        ("the platform is taken to be", e.mode),
        ("x, y [mm], heading [deg]", _triple(e.pose, sigma[:3])),
        ("velocity [mm/s, deg/s]", _triple(e.velocity, sigma[3:])),
        ("acceleration [m/s², rad/s²]", _vector(e.acceleration)),
        ("gyro bias [rad/s], accel [m/s²]", f"{e.gyro_bias:+.5f}, {_vector(e.accel_bias)}"),
        ("odometry innovation, NIS", f"{_vector(e.odometry_innovation)}, {e.odometry_nis:.2f}"),
        ("IMU innovation, NIS", f"{_vector(e.imu_innovation)}, {e.imu_nis:.2f}"),
        (
            "ages [ms]",
            f"odometry {e.odometry_age * 1e3:.0f}, IMU {e.imu_age * 1e3:.0f}, "
            f"command {e.command_age * 1e3:.0f}",
        ),
        ("refused", ", ".join(f"{k} {v}" for k, v in e.rejected.items()) or "none"),
    ]


def _base(b: Any) -> list[tuple[str, str]]:
    votes = [(f"{name} wants", _vote(vote)) for name, vote in b.votes.items()]
    return [("state", b.state), ("reason", b.reason), *votes, ("chosen", _velocity(b.chosen))]


def _vote(vote: Any) -> str:
    *velocity, weight = vote
    return f"{_velocity(velocity)}, weight {weight:.2f}" if weight > 0 else "nothing; it limits"


def _velocity(velocity: Any) -> str:
    vx, vy, turn = velocity
    return f"{vx:+.3f} ahead  {vy:+.3f} left m/s  {np.degrees(turn):+.2f} deg/s"


def _arm(a: Any) -> list[tuple[str, str]]:
    goal = f"{_vector(a.goal)} (number {a.goal_number})" if a.goal_number else "none"
    return [
        ("state", a.state),
        ("reason", a.reason),
        ("program, node", f"{a.program} {a.node}".strip() or "none"),
        ("newest event, changes of node", f"{a.event or 'none'}, {a.transitions}"),
        ("stroke", str(a.stroke) if a.stroke else "does not draw"),
        ("force, wanted [N]", f"{a.force:+.3f}, {a.force_reference:.3f}"),
        ("pen meant at, in the board [mm]", _vector(1e3 * np.asarray(a.reference), 1)),
        ("left of the reach [mm]", f"{1e3 * a.reach_margin:.0f}"),
        ("left of the nearest joint [deg]", f"{np.degrees(a.joint_margin):.1f}"),
        ("left of the fastest joint's speed", f"{100 * a.speed_margin:.0f} %"),
        ("asks the platform to be at", goal),
    ]


def _vector(values: Any, digits: int = 4) -> str:
    return "  ".join(f"{value:+.{digits}f}" for value in np.asarray(values))


def _triple(values: Any, sigma: Any) -> str:
    scale = np.array([1e3, 1e3, 180 / np.pi])
    pairs = zip(np.asarray(values) * scale, np.asarray(sigma) * scale, strict=True)
    return "  ".join(f"{value:+.2f} ± {s:.2f}" for value, s in pairs)
