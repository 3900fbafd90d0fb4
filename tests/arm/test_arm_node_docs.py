"""docs/node_types.md says what is there, and `steadyhand program types` lists the same."""

from __future__ import annotations

from pathlib import Path

from typer.testing import CliRunner

from arm.hds import NodeType
from arm.nodes import REGISTRY
from arm.nodes.quantities import QUANTITIES
from services.cli.main import app

ROOT = Path(__file__).parents[2]
DOC = (ROOT / "docs" / "node_types.md").read_text()


def row(kind: NodeType) -> str:
    """A type's line in the table; parameters without a default are marked with a star."""
    stars = [f"`{p.name}`{'*' if p.default is None else ''}" for p in kind.parameters]
    events = [f"`{e.name}`" for e in kind.events]
    own = [f"`{q.name}`" for q in kind.quantities if q not in QUANTITIES]
    cells = (f"`{kind.name}`", kind.doc.rstrip("."), stars, events, own)
    return "| " + " | ".join(c if isinstance(c, str) else ", ".join(c) for c in cells) + " |"


def test_the_table_is_the_registry() -> None:
    """Every type with its parameters, events and quantities, in order, and no other."""
    table = [line for line in DOC.splitlines() if line.startswith("| `")]
    assert table == [row(kind) for kind in REGISTRY.values()], "\n".join(
        map(row, REGISTRY.values())
    )


def test_the_command_lists_what_the_table_lists() -> None:
    """Every type and each of its parameters."""
    shown = CliRunner().invoke(app, ["program", "types"])
    assert shown.exit_code == 0
    for kind in REGISTRY.values():
        assert f"{kind.name}: {kind.doc}" in shown.stdout
        for p in kind.parameters:
            assert f"  {p.name} " in shown.stdout


def test_every_type_states_control_law_goal_region_and_domain() -> None:
    """In the docstring of the class that runs it."""
    for kind in REGISTRY.values():
        if kind.terminal:
            continue
        text = " ".join((kind.make.__doc__ or "").split()) if kind.make else ""
        for what in ("Control law:", "Goal region:", "Domain:"):
            assert what in text, f"{kind.name} does not state its {what}"


def test_the_example_is_the_real_file_and_the_real_test() -> None:
    """The page quotes them as they are."""
    for file in ("arm/nodes/retract.py", "tests/arm/test_node_retract.py"):
        assert (ROOT / file).read_text() in DOC, file
