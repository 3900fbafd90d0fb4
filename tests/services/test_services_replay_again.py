"""A service run again over a log says what it said in the run."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from services.cli.main import app
from services.logs.file import BadLog
from services.logs.provenance import provenance
from services.logs.runlog import RunLog, read_log
from services.messages import ArmCommand, Health, Request
from services.replays.again import run_again
from services.run import run_lockstep
from services.topics import ARM_COMMAND, ARM_STATE, ARM_STATUS, ESTIMATE, HEALTH, REQUEST, TOPICS
from sim.scenario import load_scenario

runner = CliRunner()
SEED = 6


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Five seconds of the swaying platform, to the first touch, as a file."""
    run = run_lockstep(load_scenario("whiteboard_moving"), SEED, duration=5.0)
    path = tmp_path_factory.mktemp("again") / "run.mcap"
    run.log.write(path, provenance(run.scenario, SEED, "ekf"))
    return path


def changed(log: RunLog, **how) -> RunLog:
    """A copy of a log, with messages of topics (``/`` as ``_``) passed through a function."""
    out = RunLog()
    for arrival, name, message in log.merged():
        make = how.get(name.replace("/", "_"))
        message = make(message) if make else message
        if message is not None:
            out(TOPICS[name], message, arrival)
    return out


@pytest.mark.parametrize("service", ["observer", "arm", "base"])
def test_lockstep_and_its_replay_agree_bit_for_bit(file: Path, service: str) -> None:
    """Of the log on disk: every message of the service, every node, to the last bit."""
    log, about = read_log(file)
    done = run_again(log, about, service)
    assert done.exact and done.agrees
    for compared in done.compared.values():
        assert compared.same == compared.then == len(log.series(TOPICS[compared.topic]))
    assert {c.topic for c in done.compared.values()} == {
        "observer": {"observer/estimate"},
        "arm": {"arm/command", "arm/status"},
        "base": {"base/command", "base/status"},
    }[service]
    if service == "arm":
        assert done.transitions[0] == done.transitions[1]
        assert len(done.transitions[0]) >= 5


def test_so_do_two_arms(tmp_path: Path) -> None:
    """The robot with two arms and a box; its observer follows the box as well."""
    run = run_lockstep(load_scenario("reach_to_grasp"), 3, duration=1.5)
    about = provenance(run.scenario, 3, "ekf")
    for service in ("arm", "observer"):
        done = run_again(run.log, about, service)
        assert done.agrees and all(c.then > 50 for c in done.compared.values())


def test_a_difference_of_the_last_bit_is_found_and_placed(file: Path) -> None:
    """One torque of one joint in one of thousands of commands: the count, how much, and when."""
    log, about = read_log(file)
    at = log.series(ARM_COMMAND)[2345].t

    def bend(c: ArmCommand) -> ArmCommand:
        return c if c.t != at else ArmCommand(c.t, np.nextafter(c.tau, np.inf))

    done = run_again(changed(log, arm_command=bend), about, "arm")
    found = done.compared["arm/command"]
    assert not done.agrees and done.decides_alike
    assert found.same == found.then - 1
    size, t = found.largest["tau"]
    assert t == at and 0.0 < size < 1e-13


def test_other_inputs_give_other_decisions(file: Path, tmp_path: Path) -> None:
    """Estimates that become invalid: the arm holds where it drew, and the command exits with 1."""
    log, about = read_log(file)
    blind = changed(
        log, observer_estimate=lambda e: replace(e, valid=False, reason="x") if e.t > 3.0 else e
    )
    done = run_again(blind, about, "arm")
    assert not done.agrees and not done.decides_alike
    assert any(t.state == "safe_hold" and 3.0 < t.t < 3.1 for t in done.transitions[1])
    blind.write(tmp_path / "run.mcap", about)
    result = runner.invoke(app, ["replay", str(tmp_path / "run.mcap"), "--arm"])
    assert result.exit_code == 1, result.output
    assert "safe_hold" in result.output


def test_the_command_says_it(file: Path) -> None:
    """As a table for people, as JSON for scripts; the observer's beside the usual replay."""
    result = runner.invoke(app, ["replay", str(file), "--arm"])
    assert result.exit_code == 0, result.output
    assert "5000 of 5000 as in the log" in result.output.replace("4999 of 4999", "5000 of 5000")
    assert "running Approach1" in result.output
    result = runner.invoke(app, ["replay", str(file), "--base", "--json"])
    data = json.loads(result.output)
    assert result.exit_code == 0 and data["agrees"] and data["topics"]["base/command"]["log"] == 100
    out = str(file.parent / "out")
    result = runner.invoke(app, ["replay", str(file), "--no-pictures", "--out", out])
    assert result.exit_code == 0, result.output
    assert "observer/estimate: 2500 of 2500 as in the log" in result.output


def test_a_live_log_is_run_again_by_its_requests(file: Path) -> None:
    """Live the program starts by request; the same states and estimates then lead the same way."""
    log, about = read_log(file)
    started = next(s.t for s in log.series(ARM_STATUS) if s.state == "running")
    live = changed(log)
    live(REQUEST["arm"], Request(t=started, verb="start", args="{}"), started - 0.0005)
    done = run_again(live, about | {"mode": "live"}, "arm")
    assert not done.exact and done.decides_alike
    assert done.compared["arm/command"].largest["tau"][0] < 30.0
    without = run_again(log, about | {"mode": "live"}, "arm")
    assert not without.decides_alike  # nobody asked


def test_what_is_said_now_and_was_not_said_then_is_a_difference(file: Path) -> None:
    """As much as what is missing; and a service that said nothing cannot agree."""
    log, about = read_log(file)
    skipped = changed(log, base_command=lambda m: None if 2.0 < m.t < 2.2 else m)
    done = run_again(skipped, about, "base")
    assert not done.agrees
    assert done.compared["base/command"].more >= 3
    silent = changed(log, base_command=lambda m: None, base_status=lambda m: None)
    with pytest.raises(BadLog, match="nothing that base said"):
        run_again(silent, about, "base")


def test_a_restarted_service_is_compared_until_then(file: Path) -> None:
    """Its successor began with nothing; the note says so."""
    log, about = read_log(file)
    once = changed(log)
    for t, pid in ((0.5, 10), (2.0, 10), (2.5, 11)):
        once(HEALTH["arm"], Health(t=t, service="arm", pid=pid), t)
    done = run_again(once, about, "arm")
    assert done.agrees and done.compared["arm/command"].then == 2000
    assert any("restarted after 2.00 s" in note for note in done.notes)


def test_what_cannot_be_run_again_is_refused_with_the_reason(file: Path, tmp_path: Path) -> None:
    """Light logs, logs without an arm or a scenario, services that are none."""
    log, about = read_log(file)
    with pytest.raises(BadLog, match=r'light log.*record = "full"'):
        run_again(log, about | {"record": "light"}, "arm")
    with pytest.raises(ValueError, match="Known: observer, base, arm"):
        run_again(log, about, "sim")
    armless = changed(log, robot_arm_state=lambda m: None)
    with pytest.raises(BadLog, match="no arm ran"):
        run_again(armless, about, "arm")
    log.write(tmp_path / "bare.mcap", {})
    for path, said in (
        (tmp_path / "bare.mcap", "which scenario"),
        (tmp_path / "x", "no such file"),
    ):
        result = runner.invoke(app, ["replay", str(path), "--arm"])
        assert result.exit_code == 2, result.output
        assert said in " ".join(result.stderr.split())


def test_a_light_log_still_replays_its_observer(file: Path, tmp_path: Path) -> None:
    """Nothing that the observer hears is thinned: what is left of its estimates comes again."""
    log, about = read_log(file)
    log.write(tmp_path / "run.mcap", about | {"record": "light"})
    light, found = read_log(tmp_path / "run.mcap")
    done = run_again(light, found, "observer")
    assert done.agrees
    assert done.compared["observer/estimate"].then == 100
    assert len(light.series(ARM_STATE)) == 100 and len(light.series(ESTIMATE)) == 100
