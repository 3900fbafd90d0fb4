"""Programs of the platform: requests to the base service, and the command line."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from services.base_service import BaseService
from services.bench import approach as approach_bench
from services.cli.main import app
from sim.scenario import load_scenario

ARM = "INTERFACE = r1;\nINITIAL = A;\nBEGIN NAME = A; TYPE = Turn_to; END\n"
WAITS = (
    "INTERFACE = platform;\nINITIAL = A;\n"
    "BEGIN NAME = A; TYPE = Wait; Event = go; TRANSITION[Received] = End; END\n"
)


def program(*arguments: str) -> tuple[int, str]:
    """Exit code and output of ``steadyhand program``."""
    result = CliRunner().invoke(app, ["program", *arguments])
    return result.exit_code, result.output


def test_the_shipped_programs_are_found_by_name_and_have_no_findings() -> None:
    """Beside those of the arm, in one call."""
    assert program("check", "approach", "turn_drive_turn.hds", "whiteboard") == (
        0,
        "3 programs: no findings\n",
    )


@pytest.mark.parametrize("command", ["explain", "graph"])
def test_a_program_of_the_platform_is_looked_at_with_its_own_types(command: str) -> None:
    """Known by its header alone."""
    code, text = program(command, "approach")
    assert code == 0
    assert "Towards" in text and "In_front" in text


def test_a_program_of_the_platform_is_walked_through() -> None:
    """By its events and its guards."""
    events = "Arrived, Off_course, Goal_distance 1 cm, Arrived"
    code, text = program("step", "turn_drive_turn", "--events", events)
    assert code == 0
    assert "Turn_there -[Goal_distance < 20 mm]-> Turn_straight" in text


def test_types_of_another_are_refused_with_those_there_are(tmp_path: Path) -> None:
    """A type of the platform in a program of the arm, and the other way round."""
    file = tmp_path / "x.hds"
    file.write_text(ARM)
    code, text = program("check", str(file))
    assert code == 1 and "Whiteboard_line" in text
    file.write_text(ARM.replace("r1", "platform").replace("Turn_to", "Whiteboard_line"))
    code, text = program("check", str(file))
    assert code == 1 and "Turn_to, Drive_straight, Drive_to" in text
    code, text = program("check", "--control", "approach")
    assert code == 2 and "arm" in text


def test_types_are_listed_of_either() -> None:
    """By default those of the arm."""
    assert "Drive_straight: " in program("types", "platform")[1]
    assert "Whiteboard_line: " in program("types")[1]
    assert program("types", "legs")[0] == 2


def service() -> BaseService:
    """A base whose task is to approach an object."""
    return BaseService(load_scenario("approach"), restarted=False)


def test_requests_start_and_abort_a_program(tmp_path: Path) -> None:
    """The task's own without a name; its object unless another is given."""
    base = service()
    for verb, args in (
        ("start", {}),
        ("start", {"program": "turn_drive_turn", "goal": [1.0, 0.0, 0.0]}),
        ("abort", {}),
    ):
        assert base.prepare(verb, args)().accepted, verb
    file = tmp_path / "waits.hds"
    file.write_text(WAITS)
    assert base.prepare("start", {"program": str(file)})().accepted
    reply = base.prepare("event", {"name": "go"})()
    assert not reply.accepted and "no node waits" in reply.reason


def test_refused_requests_say_why() -> None:
    """Before the loop sees them where a file is concerned."""
    base = service()
    with pytest.raises(ValueError, match=r"no program .nope.* Known: approach\.hds"):
        base.prepare("start", {"program": "nope"})
    with pytest.raises(ValueError, match="speaks of the goal"):
        base.prepare("start", {"program": "turn_drive_turn"})
    assert base.prepare("goal", {"x": 1, "y": 0, "heading": 0})().accepted
    reply = base.prepare("abort", {})()
    assert not reply.accepted and "the task is drive_to" in reply.reason


def test_the_approach_arrives_and_the_printed_table_does_not() -> None:
    """From the same start: the correction is what makes the difference."""
    good = approach_bench.trial("approach.hds, differential", 1000)
    assert good.arrived and good.distance < approach_bench.NEAR and good.switches == 3
    literal = approach_bench.trial("Table II as printed, differential", 1000)
    assert not literal.arrived and literal.switches > 10
