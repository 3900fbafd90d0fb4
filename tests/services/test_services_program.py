"""``steadyhand program explain, verify, graph, step, jump, follow`` from the command line."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
from typer.testing import CliRunner

from services.cli import requests as cli_requests
from services.cli.main import app

DOC = (Path(__file__).parents[2] / "docs" / "language.md").read_text(encoding="utf-8")
PART = DOC.partition("\n## Specifications\n")[2].partition("\n## ")[0]
BLOCKS = re.findall(r"^```\w*\n(.*?)^```$", PART, flags=re.DOTALL | re.MULTILINE)

JUMP = """\
INTERFACE = r1; INITIAL = Rest1;
BEGIN NAME = Rest1; TYPE = Hold; Time = 1; TRANSITION[Timeout] = Line1; END
BEGIN NAME = Line1; TYPE = Whiteboard_line; Length = 50; Direction = 0; Timeout = 9 s;
    Force = 150; Speed = 40;
    TRANSITION[Finished] = End; TRANSITION[Timeout] = Line1; END
"""

runner = CliRunner()


def program(*args: str, **options: Any) -> Any:
    """``steadyhand program ...``."""
    return runner.invoke(app, ["program", *args], **options)


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the documented specifications and a program that leaves both."""
    (tmp_path / "jump.hds").write_text(JUMP)
    (tmp_path / "contact.spec").write_text(BLOCKS[0])
    (tmp_path / "retract.spec").write_text(BLOCKS[1])
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_documented_specifications_hold_for_the_shipped_programs(here: Path) -> None:
    """And are left by a program that does what they forbid, with the output printed there."""
    for name in ("whiteboard", "paper_fragment"):
        for spec in ("contact.spec", "retract.spec"):
            result = program("verify", name, "--spec", spec)
            assert result.exit_code == 0, result.output
            assert "never leaves" in result.output
    left = program("verify", "jump.hds", "--spec", "contact.spec")
    assert (left.exit_code, left.output) == (1, BLOCKS[2])
    left = program("verify", "jump.hds", "--spec", "retract.spec", "--json")
    assert left.exit_code == 1
    trace = json.loads(left.output)["violation"]["trace"]
    assert [edge["label"] for edge in trace] == ["Timeout", "Timeout"]


def test_a_wrong_specification_is_refused_at_its_place(here: Path) -> None:
    """Exit code 1, the finding as text or JSON."""
    (here / "bad.spec").write_text(BLOCKS[0].replace("Whiteboard_line]", "Whiteboard_lime]"))
    result = program("verify", "whiteboard", "--spec", "bad.spec")
    assert result.exit_code == 1
    assert "bad.spec:6:16: error[unknown-event]" in result.output
    result = program("verify", "whiteboard", "--spec", "bad.spec", "--json")
    assert json.loads(result.output)["findings"][0]["code"] == "unknown-event"
    assert program("verify", "whiteboard", "--spec", "none.spec").exit_code == 2


def test_explain_prints_both_tuples() -> None:
    """As text and as one JSON document."""
    result = program("explain", "paper_fragment")
    assert result.exit_code == 0
    assert "H = (Q, X, I, f, E, G, T)" in result.output
    assert "A = (Q, E, delta, T, mu)" in result.output
    data = json.loads(program("explain", "whiteboard", "--json").output)
    assert data["A"]["delta"] == "Start"
    assert data["analysis"]["blocking"] == []
    assert data["analysis"]["longest"] == 17


@pytest.mark.parametrize("command", ["explain", "graph", "step"])
def test_a_program_that_is_not_there_lists_those_that_are(command: str) -> None:
    """Exit code 1."""
    result = program(command, "paper_fragmnt")
    assert result.exit_code == 1
    assert "whiteboard" in result.output


@pytest.mark.parametrize("name", ["x.svg", "x.png", "x.dot", "x.mmd"])
def test_graph_writes_the_format_its_file_is_named_for(here: Path, name: str) -> None:
    """All four."""
    assert program("graph", "whiteboard", "-o", name, "--current", "Line1").exit_code == 0
    written = (here / name).read_bytes()
    head = {".svg": b"<svg", ".png": b"\x89PNG", ".dot": b"digraph", ".mmd": b"---\ntitle"}
    assert written.startswith(head[Path(name).suffix])


def test_graph_of_a_refused_program_is_drawn_and_exits_with_one(here: Path) -> None:
    """So that one can look at what is wrong."""
    (here / "bad.hds").write_text(JUMP.replace("= Line1;", "= Lime1;", 1))
    result = program("graph", "bad.hds", "-o", "x.svg")
    assert result.exit_code == 1
    assert "program check bad.hds" in result.output
    ElementTree.fromstring((here / "x.svg").read_text())
    assert "not declared" in (here / "x.svg").read_text()


def test_graph_says_what_it_cannot_do(here: Path) -> None:
    """Unknown format, unknown node, a PNG to nowhere: exit code 2."""
    for options, text in [
        (["-o", "x.bmp"], "svg, png, dot, mermaid"),
        (["--format", "gif"], "svg, png, dot, mermaid"),
        (["--current", "Line9"], "did you mean 'Line2'?"),
        (["--format", "png"], "needs a file"),
    ]:
        result = program("graph", "whiteboard", *options)
        assert result.exit_code == 2, result.output
        assert text in " ".join(result.output.split())


@pytest.mark.parametrize(
    ("events", "code", "said"),
    [
        ("Contact, Finished, Finished", 0, "-[Finished]-> End"),
        ("Contact, Finished, back, where, Finished, Finished", 0, "-[Finished]-> End"),
        ("Abort", 0, "-[Abort]-> End"),
        ("Contact", 1, "it is in Line1"),
        ("Contact, Finnished", 1, "did you mean 'Finished'?"),
        ("Contact, quit", 0, "Line1"),
    ],
)
def test_step_by_events(events: str, code: int, said: str) -> None:
    """The same from the option and from standard input."""
    by_option = program("step", "paper_fragment", "--events", events)
    by_input = program("step", "paper_fragment", input=events.replace(", ", "\n"))
    for result in (by_option, by_input):
        assert result.exit_code == code
        assert said in " ".join(result.output.split())


def test_jump_and_follow_ask_before_and_send_what_was_meant(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Without a terminal and without --yes nothing is sent."""
    sent: list[tuple[Any, ...]] = []
    monkeypatch.setattr(cli_requests, "request", lambda *args: sent.append(args[:3]))
    for command in (["jump", "Line1"], ["follow", "Contact"]):
        refused = program(*command)
        assert refused.exit_code == 2
        assert "say --yes" in " ".join(refused.output.split())
        assert not sent
    assert program("jump", "Line1", "--yes").exit_code == 0
    assert program("follow", "Contact", "--yes").exit_code == 0
    assert sent == [
        ("arm", "jump", {"node": "Line1"}),
        ("arm", "follow", {"event": "Contact"}),
    ]


def test_the_arm_service_grants_and_refuses_jumps() -> None:
    """Through the same door as every request; refused while no program is interrupted."""
    from services.arm_service import ArmService
    from sim.scenario import Scenario

    service = ArmService(Scenario(), live=True, restarted=False)
    asked: list[tuple[str, dict[str, Any]]] = [
        ("jump", {"node": "Line1"}),
        ("follow", {"event": "Contact"}),
    ]
    for verb, args in asked:
        assert verb in service.verbs
        act: Callable[[], Any] = service.prepare(verb, args)
        reply = act()
        assert not reply.accepted
        assert "pause its program first" in reply.reason


def test_a_start_by_a_name_that_is_none_says_which_there_are() -> None:
    """In the words of who asked: no folder of ours, no key of a scenario."""
    from services.arm_service import ArmService
    from sim.scenario import Scenario

    service = ArmService(Scenario(), live=True, restarted=False)
    with pytest.raises(ValueError) as caught:
        service.prepare("start", {"program": "whitboard.hds"})
    said = str(caught.value)
    assert said.startswith("no program 'whitboard.hds' (did you mean 'whiteboard.hds'?). Known: ")
    assert "long_line.hds" in said and "/" not in said and "task" not in said
