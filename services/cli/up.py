"""``steadyhand up``: every process of the robot, watched until the end, and a report of the run."""

from __future__ import annotations

import time
from contextlib import ExitStack
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.markup import escape

from services.cli.common import OBSERVERS, Json, Robot, RunDir, console, errors, fail, show_json

if TYPE_CHECKING:
    from services.live.plan import Plan
    from services.live.supervisor import Event

COLOURS = {"ready": "green", "restarted": "green", "died": "red", "hung": "red"}


def up(
    scenario: Annotated[
        str, typer.Argument(help="Name or file; by default whiteboard, or the hosts file's.")
    ] = "",
    paced: Annotated[
        bool, typer.Option("--paced", help="Wait for every answer: exact on any machine.")
    ] = False,
    duration: Annotated[float | None, typer.Option("--for", help="End after this [s].")] = None,
    observer: Annotated[str, typer.Option(help=OBSERVERS)] = "ekf",
    seed: Annotated[int, typer.Option(min=0, help="Of everything random.")] = 0,
    rt: Annotated[str, typer.Option(help="Real-time priority and cores: auto, on, off.")] = "auto",
    robot: Robot = "r1",
    run_dir: RunDir = None,
    until_finished: Annotated[
        bool,
        typer.Option(
            "--until-finished",
            help="End when the arm's program has; without an arm, the platform's task.",
        ),
    ] = False,
    out: Annotated[Path | None, typer.Option(help="Folder for log and pictures.")] = None,
    hosts: Annotated[
        Path | None, typer.Option(help="Hosts file: start only what runs on --host.")
    ] = None,
    host: Annotated[str, typer.Option(help="This host's name in it.")] = "",
    keys: Annotated[
        Path | None, typer.Option(help="This host's certificates, from steadyhand keys.")
    ] = None,
    hang: Annotated[
        float, typer.Option(help="To stand still for so long, when it could go on, is a hang [s].")
    ] = 0.4,
    without: Annotated[
        str, typer.Option(help="Do not start this one: somebody else does. Only sim, the robot.")
    ] = "",
    no_spares: Annotated[
        bool, typer.Option("--no-spares", help="Keep no process ready for restarts.")
    ] = False,
    no_console: Annotated[bool, typer.Option("--no-console", help="Without the page.")] = False,
    port: Annotated[
        int, typer.Option(min=0, max=65535, help="Of the page; 0 for any that is free.")
    ] = 8080,
    factory: Annotated[str, typer.Option(hidden=True)] = "",
    json: Json = False,
) -> None:
    """Launch all services and look after them until Ctrl-C."""
    from rich.live import Live

    from deploy.host_file import load_hosts
    from deploy.tomlfile import BadFile
    from observer.observer import KINDS
    from services.cli.waiting import Waiting
    from services.live.plan import Plan, Spread
    from services.live.process import FACTORY
    from services.live.supervisor import Supervisor
    from services.lockstep import TICK
    from services.topics import RECORDER, ROBOT_PROCESS, SERVICES
    from services.wire.endpoints import default_run_dir
    from sim.scenario import load_scenario

    if rt not in ("auto", "on", "off"):
        fail(f"--rt is auto, on or off, not {rt!r}", 2)
    if duration is not None and duration <= 0:
        fail(f"--for needs a positive number of seconds, not {duration:g}", 2)
    if observer not in KINDS:
        fail(f"no observer {observer!r}. Known: {', '.join(KINDS)}", 2)
    try:
        places = None if hosts is None else load_hosts(hosts)
        scenario = scenario or ("whiteboard" if places is None else places.scenario)
        loaded = None if factory else load_scenario(scenario)
    except BadFile as error:
        fail(str(error), 2)
    everywhere = SERVICES if loaded is None else (RECORDER, *loaded.services)
    here, spread = everywhere, None
    if places is not None and hosts is not None:
        if host not in places.host or keys is None:
            fail(f"--hosts needs --keys and a --host: {', '.join(places.host)}", 2)
        robot = places.robot
        homeless = [name for name in everywhere if name != RECORDER and not places.place(name)]
        if homeless:
            fail(f"{hosts}: {', '.join(homeless)} of {scenario} on no host", 2)
        here = tuple(name for name in everywhere if places.place(name) == host)
        spread = Spread(hosts.resolve(), host, keys.resolve(), everywhere)
    brought: tuple[str, ...] = ()
    if without:
        if without != ROBOT_PROCESS or without not in here or paced:
            fail(f"--without {without}: only {ROBOT_PROCESS}, of those that run here, and live", 2)
        here = tuple(name for name in here if name != without)
        brought = (without,)
    mode = "paced" if paced else "live"
    folder = out or Path("runs") / f"{Path(scenario).stem}-{mode}-{time.strftime('%Y%m%d-%H%M%S')}"
    plan = Plan(
        run_dir=run_dir or default_run_dir(robot),
        scenario=Path(scenario) if loaded is None else loaded.path.resolve(),
        robot=robot,
        seed=seed,
        observer=observer,
        mode=mode,
        rt=rt,
        ticks=round(duration / TICK) if paced and duration is not None else None,
        duration=None if paced else duration,
        hang=hang,
        factory=factory or FACTORY,
        until_finished=until_finished,
        log=folder / "run.mcap",
        services=here,
        brought=brought,
        spread=spread,
        spares=not no_spares,
        console=None if no_console or factory else port,
        start_program=loaded is not None and not paced and loaded.task.autostart and "arm" in here,
    )
    events: list[Event] = []
    waiting = Waiting(plan)

    def report(event: Event) -> None:
        events.append(event)
        if not json:
            colour = COLOURS.get(event.kind, "dim" if event.kind == "started" else "default")
            console.print(
                f"{event.at:8.2f}  {event.service:9} [{colour}]{event.kind:10}[/] {event.detail}",
                highlight=False,
                soft_wrap=True,
            )
            if asked := waiting.hear(event):
                console.print(f"{'':20}[yellow]{asked}[/]", highlight=False, soft_wrap=True)

    if not json:
        console.print(f"[bold]{scenario}[/], logs in {plan.run_dir}", highlight=False)
    supervisor = Supervisor(plan, report)
    with ExitStack() as shown:
        if not json and console.is_terminal:
            shown.enter_context(
                Live(waiting, console=console, refresh_per_second=1, transient=True)
            )
        success = supervisor.run()
    result = report_of(plan, folder, events, json) if RECORDER in here else None
    if json:
        health = {name: asdict(newest) for name, newest in supervisor.health.items()}
        show_json(
            {
                "success": success,
                "events": [asdict(e) for e in events],
                "health": health,
                "result": result,
            }
        )
    finished = result is None or result["outcome"].startswith("finished")
    ended_well = finished or not until_finished
    raise typer.Exit(0 if success and ended_well else 1)


def report_of(plan: Plan, folder: Path, events: list[Event], quiet: bool) -> dict[str, Any] | None:
    """Judge what the recorder wrote; None if it wrote nothing that can be judged."""
    from services.cli.progress import busy
    from services.cli.run import show
    from services.logs.runlog import BadLog
    from services.reports.live import write_live_report

    try:
        with busy("judging the run and drawing the pictures", quiet=quiet):
            result = write_live_report(plan, folder, events[-1].at)
    except BadLog as error:
        errors.print(f"no report: {escape(str(error))}")
        return None
    except KeyboardInterrupt:
        errors.print(f"no report; later: steadyhand report {escape(str(folder))}")
        return None
    if not quiet:
        show(result)
        console.print(f"log and pictures in {folder}", highlight=False, soft_wrap=True)
        console.print(
            f"its story in one page: steadyhand report {folder}", highlight=False, soft_wrap=True
        )
    return result
