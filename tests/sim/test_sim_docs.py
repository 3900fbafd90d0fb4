"""The scenario page."""

from __future__ import annotations

import re
from pathlib import Path
from typing import get_args

from deploy.task import BaseTask, Task
from sim.disturbance import KINDS
from sim.obstacle_specs import Box, Mover, Pillar, Wall
from sim.scenario import load_scenario

PAGE = Path(__file__).parents[2] / "docs" / "scenario.md"


def test_the_example_on_the_page_is_a_scenario(tmp_path: Path) -> None:
    """It loads as printed, and its program is found."""
    block = re.search(r"```toml\n(.*?)```", PAGE.read_text(), re.S)
    assert block is not None
    file = tmp_path / "page.toml"
    file.write_text(block[1])
    scenario = load_scenario(file)
    assert scenario.program_path() is not None
    assert len(scenario.disturbance) == 1


def test_the_page_names_every_disturbance_and_option() -> None:
    """Nothing a scenario can do is left out of the table."""
    text = PAGE.read_text()
    for kind, model in KINDS.items():
        assert f"| `{kind}` |" in text
        for option in set(model.model_fields) - {"kind", "t"}:
            assert f"`{option}`" in text, (kind, option)


def test_the_page_names_every_obstacle_and_its_keys() -> None:
    """Nothing that can stand or walk in a world is left out."""
    text = PAGE.read_text().split("## Obstacles")[1]
    for model in (Box, Wall, Pillar, Mover):
        row = next(line for line in text.splitlines() if line.startswith(f"| `{_kind(model)}` |"))
        for key in set(model.model_fields) - {"kind"}:
            assert f"`{key}`" in row, (model, key)


def test_the_page_names_every_key_of_the_task() -> None:
    """Nothing that arm and platform can be told is left out of the tables."""
    section = PAGE.read_text().split("## The task")[1].split("## Obstacles")[0]
    for key in (*set(Task.model_fields) - {"base"}, *BaseTask.model_fields):
        assert f"`{key}`" in section, key
    for name in get_args(BaseTask.model_fields["behaviour"].annotation):
        assert f"`{name}`" in section, name


def _kind(model: type[Box | Wall | Pillar | Mover]) -> str:
    return str(model.model_fields["kind"].default)
