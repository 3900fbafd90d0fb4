"""``steadyhand list``: what can be run, and on which robots."""

from __future__ import annotations

from rich.markup import escape

from services.cli.common import Json, console, show_json


def list_(json: Json = False) -> None:
    """List scenarios and robots, each with what its own file says of it.

    A file of your own is named by its path: steadyhand run mine.toml.
    """
    from deploy.robot import robot_file, robot_names
    from deploy.tomlfile import toml_entry
    from sim.scenario import SCENARIOS, Scenario, scenario_names

    files = {name: SCENARIOS / f"{name}.toml" for name in scenario_names()}
    usual = Scenario.model_fields["robot"].default
    scenarios = {
        name: {key: toml_entry(file, key, default) for key, default in
               (("description", ""), ("robot", usual))}
        for name, file in files.items()
    }  # fmt: skip
    robots = {
        name: {"description": toml_entry(robot_file(name), "description", "")}
        for name in robot_names()
    }
    if json:
        show_json({"scenarios": scenarios, "robots": robots})
        return
    for title, found in (
        ("scenarios: steadyhand run NAME, steadyhand up NAME", scenarios),
        ('robots: robot = "NAME" in a scenario', robots),
    ):
        console.print(f"[bold]{escape(title)}[/]", highlight=False)
        for name, about in found.items():  # a line each, however narrow the terminal
            line = f"  {name:24} {escape(about['description'])}"
            console.print(line, highlight=False, soft_wrap=True)
