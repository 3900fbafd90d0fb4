"""Scripts can trust the command line: exit codes, plain JSON, errors that say what to do next."""

from __future__ import annotations

import io
import json
import re
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from rich.console import Console
from service_toys import TOYS
from typer.testing import CliRunner

from deploy.robot import ROBOTS
from services.cli.main import app
from services.cli.watch import render
from services.live.clock import EpochClock, HeardClock
from services.live.runner import run_live
from services.messages import ArmStatus, BaseStatus, Health, Message
from services.requests import Requests
from services.topics import SERVICES
from services.wire.bus import open_bus
from services.wire.endpoints import local
from sim.disturbance import KINDS
from sim.scenario import scenario_names

runner = CliRunner()

PROGRAMS = Path(__file__).parents[2] / "arm" / "programs"


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Four toy services, live, in threads."""
    run_dir, stop = tmp_path_factory.mktemp("r"), threading.Event()

    def run(name: str) -> None:
        toy = TOYS[name](1)
        with open_bus(local(run_dir, name), "r1", name, toy.inputs) as bus:
            requests = Requests(bus.session, "r1", toy, timeout=10.0)
            clock = EpochClock(time.monotonic()) if name == "sim" else HeardClock()
            run_live(toy, bus, clock, stop, requests)
            requests.close()

    threads = [threading.Thread(target=run, args=(name,)) for name in SERVICES]
    for thread in threads:
        thread.start()
    deadline = time.monotonic() + 30
    while len(list(run_dir.glob("*.sock"))) < len(SERVICES) and time.monotonic() < deadline:
        time.sleep(0.02)
    yield run_dir
    stop.set()
    for thread in threads:
        thread.join(30)


@pytest.mark.parametrize("what", ["estimate", "loops", "base"])
def test_watch_once(robot: Path, what: str) -> None:
    """One look, as a table and as JSON."""
    options = ["watch", what, "--once", "--run-dir", str(robot)]
    shown = runner.invoke(app, options)
    assert shown.exit_code == 0, shown.output
    data = json.loads(runner.invoke(app, [*options, "--json"]).output)
    assert data
    assert all("t" in message for message in data.values())


def test_refused_is_exit_code_one_with_the_reason(robot: Path) -> None:
    """A request that is not granted says why, on standard error or as JSON."""
    result = runner.invoke(app, ["disturb", "push", "--force", "80", "--run-dir", str(robot)])
    assert result.exit_code == 1
    assert "sim cannot 'disturb'" in " ".join(result.stderr.split())
    result = runner.invoke(app, ["program", "pause", "--json", "--run-dir", str(robot)])
    assert result.exit_code == 1
    answer = json.loads(result.output)
    assert answer["answered"] is True
    assert answer["accepted"] is False


def test_nobody_there_says_what_to_do(tmp_path: Path) -> None:
    """Without a robot every command that needs one says how to start it."""
    for command in (["disturb", "push"], ["watch"], ["arm", "reset"], ["program", "stop"]):
        result = runner.invoke(app, [*command, "--run-dir", str(tmp_path)])
        assert result.exit_code == 1
        assert "steadyhand up" in result.stderr


def test_disturbance_arguments(monkeypatch: pytest.MonkeyPatch) -> None:
    """Options, a sensor, and key=value all become arguments of one request."""
    sent: list[tuple[object, ...]] = []
    monkeypatch.setattr("services.cli.disturb.request", lambda *args: sent.append(args))
    runner.invoke(app, ["disturb", "delay", "imu", "--ms", "20", "--for", "1", "t=3", "on=link2"])
    service, verb, args, *_ = sent[0]
    assert (service, verb) == ("sim", "disturb")
    assert args == {
        "kind": "delay", "sensor": "imu", "extra": 0.02, "duration": 1.0, "t": 3.0, "on": "link2",
    }  # fmt: skip


def test_wrong_questions_are_exit_code_two() -> None:
    """An unknown view, scenario or option is a usage error that names what is known."""
    for command, known in (
        (["watch", "moon"], "estimate"),
        (["up", "no_such_scenario"], "whiteboard"),
        (["up", "--rt", "maybe"], "auto"),
        (["up", "--for", "-1"], "positive"),
    ):
        result = runner.invoke(app, command)
        assert result.exit_code == 2, command
        assert known in result.stderr


def test_program_check(tmp_path: Path) -> None:
    """Exit code 1 if a program must not run, 0 if it may; findings as text and as JSON."""
    bad = tmp_path / "bad.hds"
    bad.write_text("INTERFACE = r1;\nINITIAL = Nowhere;\n")
    result = runner.invoke(app, ["program", "check", str(bad)])
    assert result.exit_code == 1
    assert "bad.hds:" in result.output
    result = runner.invoke(app, ["program", "check", str(bad), "--json"])
    assert json.loads(result.output)["ok"] is False
    assert runner.invoke(app, ["program", "check", str(tmp_path / "none")]).exit_code == 1
    good = [str(path) for path in PROGRAMS.glob("whiteboard*.hds")]
    assert runner.invoke(app, ["program", "check", *good]).exit_code == 0


def test_a_program_that_is_not_there_has_a_name_beside_it(tmp_path: Path) -> None:
    """The nearest one is suggested, none where none is near; a text that is none is cut short."""
    for name, said in (("whitboard.hds", "did you mean 'whiteboard.hds'"), ("nosuch.hds", "")):
        result = runner.invoke(app, ["program", "check", name])
        assert result.exit_code == 1
        first, *rest = result.output.splitlines()
        assert first.startswith(f"{name}: error[unreadable]: no program {name!r}")
        assert said in first and ("did you mean" in first) == bool(said)
        assert rest == ["1 error, 0 warnings"]
    text = tmp_path / "letter.txt"
    text.write_text("Dear all, this is no program; it is a letter.\n" * 100)
    result = runner.invoke(app, ["program", "check", str(text)])
    errors = int(re.findall(r"(\d+) errors", result.output)[-1])
    assert errors > 100 and len(result.output.splitlines()) < 200
    findings = json.loads(runner.invoke(app, ["program", "check", str(text), "--json"]).output)
    assert len(findings["findings"]) == errors


def test_scenarios_and_robots_are_listed() -> None:
    """Every one, each in one line with what its own file says."""
    result = runner.invoke(app, ["list"])
    assert result.exit_code == 0, result.output
    data = json.loads(runner.invoke(app, ["list", "--json"]).output)
    assert set(data["scenarios"]) == set(scenario_names())
    assert set(data["robots"]) == {p.parent.name for p in ROBOTS.glob("*/robot.toml")}
    lines = result.output.splitlines()
    for name, about in (data["scenarios"] | data["robots"]).items():
        assert about["description"], name
        assert any(x.split() == [name, *about["description"].split()] for x in lines), name
    assert {s["robot"] for s in data["scenarios"].values()} <= set(data["robots"])


@pytest.mark.parametrize("command", ["run", "up"])
def test_a_robot_that_is_not_there_is_the_scenario_s_mistake(command: str, tmp_path: Path) -> None:
    """The file to mend is named, not one that does not exist."""
    bad = tmp_path / "mine.toml"
    bad.write_text('robot = "xr4000_puma"\n')
    result = runner.invoke(app, [command, str(bad)])
    assert result.exit_code == 2
    assert f"{bad}: robot: no such robot (did you mean 'xr4000_puma560'?)" in result.stderr
    assert "robot.toml" not in result.stderr


def test_a_stopped_bench_says_what_it_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ctrl-C: figures of the runs that were done, how many those are, and exit code 130."""
    from services.bench import base as base_bench
    from services.bench import loop as loop_bench

    real, asked = base_bench.run_one, []

    def run_one(job: base_bench.Job) -> base_bench.Result:
        asked.append(job)
        if len(asked) > 2:
            raise KeyboardInterrupt
        return real(job)

    monkeypatch.setattr(base_bench, "run_one", run_one)
    bench = ["bench", "base", "--cases", "position", "--seeds", "1000-1005"]
    result = runner.invoke(app, bench)
    assert result.exit_code == 130
    assert "position: by its own sensors" in result.output
    assert "stopped after 2 of 6 runs; the figures are of these" in result.stderr
    result = runner.invoke(app, bench)
    assert (result.exit_code, result.stdout.count("position")) == (130, 0)
    assert "stopped after 0 of 6 runs; nothing is kept" in result.stderr

    def stopped(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(loop_bench, "measure", stopped)
    result = runner.invoke(app, ["bench", "loop", "--load", "quiet"])
    assert result.exit_code == 130
    assert "stopped after 0 of 3 blocks; nothing is kept" in result.stderr


def test_doctor(monkeypatch: pytest.MonkeyPatch) -> None:
    """A check that breaks is a failure of its own; the exit code tells."""
    from services.cli import doctor

    def _broken() -> doctor.Check:
        raise RuntimeError("no such thing")

    monkeypatch.setattr(doctor, "CHECKS", (doctor._python, doctor._packages, doctor._memory_lock))
    result = runner.invoke(app, ["doctor", "--json"])
    assert result.exit_code == 0
    assert json.loads(result.output)["checks"][0]["name"] == "Python"
    monkeypatch.setattr(doctor, "CHECKS", (_broken,))
    result = runner.invoke(app, ["doctor"])
    assert result.exit_code == 1
    assert "no such thing" in result.output


def test_doctor_measures_the_bus() -> None:
    """The loop-back round trip works on the machine that runs the tests."""
    from services.cli import doctor

    assert doctor.examine(doctor._bus).status == "ok"


def test_help_keeps_its_units() -> None:
    """Units in brackets are not taken for markup."""
    for command, unit in ((["run"], "[s]"), (["disturb"], "[deg]"), (["base", "goal"], "[m]")):
        assert unit in runner.invoke(app, [*command, "--help"]).output


def test_one_unreadable_program_does_not_hide_the_findings_of_others(tmp_path: Path) -> None:
    """Every file is reported on; names of programs are known as well."""
    bad = tmp_path / "bad.hds"
    bad.write_text("INTERFACE = r1;\nINITIAL = A;\n")
    files = ["whiteboard", str(bad), str(tmp_path / "nope.hds")]
    result = runner.invoke(app, ["program", "check", *files])
    assert result.exit_code == 1
    assert "no-nodes" in result.output
    assert "unreadable" in result.output


def test_a_run_that_cannot_write_says_so_first(tmp_path: Path) -> None:
    """The folder is made before anything is simulated, and is cleared of an older result."""
    blocked = tmp_path / "file"
    blocked.write_text("")
    result = runner.invoke(app, ["run", "whiteboard", "--for", "0.1", "--out", str(blocked)])
    assert result.exit_code == 2
    folder = tmp_path / "out"
    folder.mkdir()
    (folder / "board.png").write_text("old")
    options = ["--for", "0.1", "--no-pictures", "--out", str(folder)]
    assert runner.invoke(app, ["run", "whiteboard", *options]).exit_code == 1
    assert {p.name for p in folder.iterdir()} == {"run.mcap", "result.json"}


def test_the_help_of_disturb_lists_every_kind_and_key() -> None:
    """With ranges and defaults, a line each."""
    text = runner.invoke(app, ["disturb", "--help"]).output
    for kind, model in KINDS.items():
        block = text.split(f"\n  {kind}: ")[1].split("\n\n")[0]
        for key in set(model.model_fields) - {"kind"}:
            assert re.search(rf"^ +{key} ", block, re.M), (kind, key)
    assert "5000; required" in text


@pytest.mark.parametrize(
    ("typed", "offered"),
    [
        ("steadyhand dist", {"disturb"}),
        ("steadyhand disturb bl", {"blinded"}),
        ("steadyhand disturb push f", {"force="}),
        ("steadyhand disturb dropout sensor=la", {"sensor=laser"}),
        ("steadyhand disturb push on=link7", {"on=link7"}),
        ("steadyhand disturb moon ", set()),
        ("steadyhand watch e", {"estimate"}),
    ],
)
def test_the_shell_completes(typed: str, offered: set[str]) -> None:
    """Commands, kinds, keys and their values, as fish asks for them."""
    env = {
        "_STEADYHAND_COMPLETE": "complete_fish",
        "_TYPER_COMPLETE_FISH_ACTION": "get-args",
        "_TYPER_COMPLETE_ARGS": typed,
    }
    out = runner.invoke(app, [], env=env, prog_name="steadyhand").output
    assert {line.split("\t")[0] for line in out.splitlines() if line} == offered


def test_an_error_is_one_line_when_it_is_piped() -> None:
    """However long: no line break in the middle of a name or a path."""
    result = runner.invoke(app, ["up", "no_such_scenario_with_a_name_that_is_" + "long_" * 12])
    assert any("Known:" in line and "whiteboard" in line for line in result.stderr.splitlines())
    result = runner.invoke(app, ["watch", "--run-dir", "/nowhere/" + "x" * 70])
    (line,) = result.stderr.splitlines()
    assert line.startswith("error: robot r1") and line.endswith("give its --run-dir")


def test_the_arm_and_the_platform_are_shown_in_words_and_units() -> None:
    """A person reads state, node, force and margins, and who voted for what."""
    status = ArmStatus(
        1.0, state="safe_hold", reason="estimate old", program="a.hds", node="Line1",
        force=1.49, force_reference=1.5, reach_margin=0.123, joint_margin=0.5,
    )  # fmt: skip
    text = _shown({"arm/status": status})
    for words in ("safe_hold", "a.hds Line1", "+1.490, 1.500", "123", "28.6"):
        assert words in text, words
    votes = {"drive_to": [0.1, 0.0, 0.5, 1.0], "avoid": [0.0, 0.0, 0.0, 0.0]}
    text = _shown({"base/status": BaseStatus(1.0, "driving", "", votes)})
    assert "+0.100 ahead" in text and "+28.65 deg/s, weight 1.00" in text
    assert "nothing; it limits" in text


def test_a_process_that_fell_silent_is_marked_in_loops() -> None:
    """Its old figures are not taken for new ones."""
    heard = {f"{s}/health": Health(t, s) for s, t in (("sim", 9.0), ("arm", 6.0))}
    text = _shown(heard)
    assert re.search(r"^arm +silent", text, re.M) and not re.search(r"^sim +silent", text, re.M)


def test_states_and_restarts_are_in_the_row_of_each_service() -> None:
    """One look says who is in what state and who had to be restarted; why is below."""
    reason = "estimate of the platform is 60 ms old"
    heard: dict[str, Message] = {
        "arm/health": Health(9.0, "arm", "safe_hold", reason, restarts=2),
        "sim/health": Health(9.0, "sim", "running"),
    }
    text = _shown(heard, width=80)
    assert re.search(r"^ +state +restarts +Hz", text, re.M)
    assert re.search(r"^arm +safe_hold +2 ", text, re.M)
    assert re.search(r"^sim +running +0 ", text, re.M)
    assert f"arm: {reason}" in text


def _shown(heard: dict[str, Message], width: int = 120) -> str:
    console = Console(width=width, file=io.StringIO())
    console.print(render(heard))
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue()
