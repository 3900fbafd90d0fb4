"""A recorded log through the observer: the same as on the robot, judged, and tuned by."""

from __future__ import annotations

import json
import re
import tomllib
from dataclasses import replace
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest
from typer.testing import CliRunner

from observer.observer import make_observer
from observer.recordings.description import LogDescription
from observer.recordings.facts import Diagnosis
from observer.recordings.parameters import parameters
from observer.recordings.prepare import speeds_of
from observer.recordings.recording import Recording, Samples
from observer.recordings.run import collect
from observer.recordings.run import replay as run_replay
from observer.recordings.tune import Tuned, Tuning
from services.cli.main import app
from services.logs.provenance import provenance
from services.logs.recordings import open_recording, recording_of
from services.logs.runlog import BadLog, RunLog
from services.replays import run as replay_run
from services.replays.pictures import track
from services.replays.run import AT_ITS_STAMPS, replay_recording
from services.replays.tune import Report, fragment
from services.run import Run, run_lockstep
from services.topics import BASE_COMMAND, ESTIMATE, ODOMETRY
from sim.scenario import load_scenario

runner = CliRunner()


@pytest.fixture(scope="module")
def run() -> Run:
    """Eight seconds of drawing while the platform sways."""
    return run_lockstep(load_scenario("whiteboard_moving"), 4, duration=8.0)


@pytest.fixture(scope="module")
def folder(run: Run, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The run's folder with its log."""
    folder = tmp_path_factory.mktemp("runs") / "swaying"
    folder.mkdir()
    run.log.write(folder / "run.mcap", provenance(run.scenario, 4, "ekf"))
    return folder


def estimates_of(log: RunLog) -> list:
    """What the observer said in a run, from the first odometry on."""
    return [e for e in log.series(ESTIMATE) if e.reason != "no odometry yet"]


# --- recordings -----------------------------------------------------------------------------


def test_a_replay_says_bit_for_bit_what_the_observer_said_in_the_run(run: Run) -> None:
    """Arrival times are all it takes: every estimate of the run comes again."""
    recording = recording_of(run.log, provenance(run.scenario, 4, "ekf"))
    again = collect(run_replay(recording, make_observer("ekf", recording.base)))
    said = estimates_of(run.log)
    n = len(again)  # the log ends before the observer's last ticks
    assert len(said) - n <= 2
    np.testing.assert_array_equal(again.t, [e.t for e in said[:n]])
    np.testing.assert_array_equal(again.pose, [e.pose for e in said[:n]])
    np.testing.assert_array_equal(again.covariance, [e.covariance for e in said[:n]])


def test_so_it_does_from_the_file(run: Run, folder: Path) -> None:
    """Nothing is lost on the way through the file; a folder stands for the log in it."""
    recording = open_recording(folder)
    assert recording.name == "swaying"
    again = collect(run_replay(recording, make_observer("ekf", recording.base)))
    said = estimates_of(run.log)[: len(again)]
    np.testing.assert_array_equal(again.pose, [e.pose for e in said])
    assert recording.reference is not None
    assert recording.reference.values.shape[1] == 3


def test_files_that_are_no_recording_are_named(folder: Path, tmp_path: Path) -> None:
    """A missing file, another kind of file, an empty folder, a folder with two logs."""
    (tmp_path / "notes.txt").write_text("")
    (tmp_path / "empty").mkdir()
    two = tmp_path / "two"
    two.mkdir()
    for name in ("a.mcap", "b.mcap"):
        (two / name).touch()
    for path, said in (
        (tmp_path / "none.mcap", "no such file"),
        (tmp_path / "notes.txt", "neither a log"),
        (tmp_path / "empty", "without a log"),
        (two, "a.mcap, b.mcap"),
        (two / "a.mcap", "is empty"),
    ):
        with pytest.raises(BadLog, match=said):
            open_recording(path)
    whole = (folder / "run.mcap").read_bytes()
    (two / "a.mcap").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(BadLog, match=r"killed before it finished.*steadyhand log recover"):
        open_recording(two / "a.mcap")
    with pytest.raises(BadLog, match="nothing on robot/odometry"):
        recording_of(RunLog(), {})


# --- replay ---------------------------------------------------------------------------------


def test_late_stamps_are_found_and_put_right(run: Run) -> None:
    """Odometry stamped 40 ms late: the diagnosis says so, and correcting it is worth a lot."""
    recording = recording_of(run.log, {})
    o = recording.odometry
    assert o is not None
    late = Samples(o.t + 0.04, o.arrival + 0.04, o.values)
    wrong = replace(recording, odometry=late)
    mended, kept = replay_recording(wrong), replay_recording(wrong, as_is=True)
    said = " ".join(v.text for v in mended.verdicts if v.severity == "warning")
    found = re.search(r"odometry is ([\d.]+) ms late", said)
    assert found is not None
    assert float(found[1]) == pytest.approx(40.0, abs=4.0)
    assert mended.scores["ekf"].position_rms < 1e-3
    assert kept.scores["ekf"].position_rms > 3.0 * mended.scores["ekf"].position_rms


def test_the_observer_beats_its_baselines_on_a_log(folder: Path) -> None:
    """As in the run: better than odometry when it comes, extrapolated or not."""
    done = replay_recording(open_recording(folder))
    rms = {name: s.position_rms for name, s in done.scores.items()}
    assert set(rms) == {AT_ITS_STAMPS, "ekf", "hold", "taylor"}
    assert rms["ekf"] < 0.6e-3
    assert rms["ekf"] < 0.6 * rms["taylor"] < 0.2 * rms["hold"]
    assert set(done.innovations) == {"odometry", "imu"}


def test_without_reference_only_the_filter_is_judged(folder: Path) -> None:
    """No scores, yet verdicts, consistency and a picture of the way."""
    done = replay_recording(replace(open_recording(folder), reference=None))
    assert done.scores == {}
    assert any("NIS of odometry" in v.text for v in done.verdicts)
    figure = track(done)
    assert figure is not None
    assert len(figure.axes) == 1


def test_replay_writes_report_and_pictures(folder: Path, tmp_path: Path) -> None:
    """The command prints what was found, and leaves it in its folder as data and pictures."""
    out = tmp_path / "out"
    result = runner.invoke(app, ["replay", str(folder), "--out", str(out)])
    assert result.exit_code == 0, result.output
    for text in ("odometry is on time", "error of the way [mm]", "NIS of imu", "valid 100 %"):
        assert text in result.output
    report = json.loads((out / "report.json").read_text())
    assert {s["track"] for s in report["scores"]} == {AT_ITS_STAMPS, "ekf", "hold", "taylor"}
    assert report["consistency"]["odometry"]["nis_expected"] == 3
    for name in ("track", "innovations", "nis", "biases", "delay"):
        assert (out / f"{name}.png").stat().st_size > 10_000


def test_replay_as_json(folder: Path, tmp_path: Path) -> None:
    """One document, the same as the report, and nothing corrected if so asked."""
    options = ["--json", "--as-is", "--no-pictures", "--observer", "hold"]
    result = runner.invoke(app, ["replay", str(folder), *options, "--out", str(tmp_path)])
    assert result.exit_code == 0, result.output
    data = json.loads(result.output)
    assert data["as_is"] is True
    assert data["observer"] == "hold"
    assert data == json.loads((tmp_path / "report.json").read_text())
    assert not list(tmp_path.glob("*.png"))


def test_wrong_questions_leave_with_two_and_no_traceback(folder: Path, tmp_path: Path) -> None:
    """Each is told what is wrong and what is known."""
    (tmp_path / "file").write_text("")
    blocked = str(tmp_path / "file" / "out")
    for command, said in (
        (["replay", str(tmp_path / "none.mcap")], "no such file"),
        (["replay", str(tmp_path / "none.toml")], "no such file"),
        (["replay", str(folder), "--observer", "truth"], "Known: ekf"),
        (["replay", str(folder), "--out", blocked], "cannot write"),
        (["tune", str(folder), "--seconds", "2"], "5 or more"),
        (["tune", str(folder), "--out", blocked], "cannot write"),
    ):
        result = runner.invoke(app, command)
        assert result.exit_code == 2, command
        assert said in " ".join(result.stderr.split())
        assert "Traceback" not in result.output


def test_stamps_that_repeat_or_restart_are_refused(run: Run) -> None:
    """Two runs in one log, and one message twice: topic and time are named."""
    for again, said in (
        (0, r"robot/odometry go back from [\d.]+ to"),
        (-1, r"have one stamp, [\d.]+"),
    ):
        log = RunLog()
        sent = list(zip(run.log.series(ODOMETRY), run.log.arrivals(ODOMETRY), strict=True))
        for message, arrival in [*sent, (sent[again][0], sent[-1][1])]:
            log(ODOMETRY, message, arrival)
        with pytest.raises(BadLog, match=said):
            recording_of(log, {})


def test_of_two_commands_of_one_stamp_the_later_counts(run: Run) -> None:
    """A base that steps twice while the simulation is late leaves such a log."""
    log = RunLog()
    for topic in (ODOMETRY, BASE_COMMAND):
        for message, arrival in zip(run.log.series(topic), run.log.arrivals(topic), strict=True):
            log(topic, message, arrival)
    last, velocity = log.series(BASE_COMMAND)[-1], np.array([0.1, 0.2, 0.3])
    log(BASE_COMMAND, replace(last, velocity=velocity), log.arrivals(BASE_COMMAND)[-1] + 0.01)
    once, twice = recording_of(run.log, {}).commands, recording_of(log, {}).commands
    assert once is not None and twice is not None
    np.testing.assert_array_equal(twice.t, once.t)
    np.testing.assert_array_equal(twice.values[-1], velocity)


def plain_form(folder: Path, recording: Recording, name: str = "plain") -> Path:
    """Half a recording in the plain form: wheel speeds and an IMU."""
    o, imu = recording.odometry, recording.imu
    assert o is not None and imu is not None
    speeds = speeds_of(o)
    tables = {
        "speeds.csv": ("t,vx,vy,w", np.column_stack([speeds.t, speeds.values])),
        "imu.csv": ("t,gx,gy,gz,ax,ay,az", np.column_stack([imu.t, imu.values])),
    }
    for file, (header, values) in tables.items():
        np.savetxt(folder / file, values, delimiter=",", header=header, comments="", fmt="%.9f")
    (folder / "log.toml").write_text(
        f'name = "{name}"\ntime = "t"\n'
        '[speeds]\nfile = "speeds.csv"\nvx = "vx"\nvy = "vy"\nw = "w"\n'
        '[imu]\nfile = "imu.csv"\ngyro = ["gx", "gy", "gz"]\naccel = ["ax", "ay", "az"]\n'
    )
    return folder / "log.toml"


def test_a_log_of_speeds_alone_is_dead_reckoned_and_said_so(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its name is no path; `valid` is not counted; baselines that need poses say so."""
    log = plain_form(tmp_path, recording_of(run.log, {}), "../a b/c")
    monkeypatch.chdir(tmp_path)
    result = runner.invoke(app, ["replay", str(log), "--no-pictures", "--seconds", "4"])
    assert result.exit_code == 0, result.output
    report = json.loads(Path("runs/replay-.._a_b_c/report.json").read_text())
    assert report["dead_reckoned"] is True and report["seconds"] < 4.1
    text = " ".join(result.output.split())
    assert "position is dead-reckoned, so `valid` (20 mm) does not apply" in text
    assert "% valid" not in text and "position uncertain" not in text
    for kind in ("hold", "taylor"):
        with pytest.raises(ValueError, match="needs poses"):
            replay_recording(open_recording(log), kind)


def test_baselines_get_the_poses_where_the_filter_gets_speeds(
    run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where the wheels' heading is not used, hold and taylor still say where odometry was."""
    real = replay_run.prepare

    def by_speed(recording: Recording, diagnosis: Diagnosis) -> Recording:
        return real(recording, replace(diagnosis, use="speed"))

    monkeypatch.setattr(replay_run, "prepare", by_speed)
    recording = recording_of(run.log, {})
    done = replay_recording(recording, "hold")
    assert done.used.odometry is None
    assert done.scores["hold"].position_rms < 0.02


def test_distances_are_marked_in_plain_numbers(folder: Path) -> None:
    """Where they differ too much for a level axis: at least three marks that read as numbers."""
    figure = track(replay_recording(open_recording(folder)))
    assert figure is not None
    figure.draw_without_rendering()
    axis = figure.axes[1]
    assert axis.get_yscale() == "log"
    low, high = axis.get_ylim()
    ticks = zip(axis.yaxis.get_majorticklocs(), axis.yaxis.get_majorticklabels(), strict=True)
    marks = [label.get_text() for at, label in ticks if low <= at <= high]
    assert len(marks) >= 3 and all(float(mark) > 0.0 for mark in marks)
    plt.close(figure)


def test_a_perfect_track_is_drawn(run: Run) -> None:
    """Errors of exactly zero: nothing is divided by them."""
    done = replay_recording(recording_of(run.log, {}), "hold")
    exact = {name: replace(s, position_rms=0.0) for name, s in done.scores.items()}
    figure = track(replace(done, scores=exact))
    assert figure is not None
    plt.close(figure)


def test_what_cannot_be_written_is_said(folder: Path, tmp_path: Path) -> None:
    """Before the work where it can be; without a traceback in any case."""
    out = tmp_path / "out"
    (out / "report.json").mkdir(parents=True)
    (tmp_path / "file").touch()
    for command, said in (
        (["replay", str(folder), "--no-pictures", "--out", str(out)], "cannot write"),
        (["replay", str(folder), "--seconds", "0"], "1 or more"),
        (["bench", "observer", "--plots", str(tmp_path / "file" / "plots")], "cannot write"),
        (["bench", "whiteboard", "--workers", "0"], "--workers"),
    ):
        result = runner.invoke(app, command)
        assert result.exit_code == 2, (command, result.output)
        assert said in " ".join(re.sub(r"\x1b\[[0-9;]*m", "", result.stderr).split())
        assert "Traceback" not in result.output


# --- tune -----------------------------------------------------------------------------------


def test_tune_states_the_noise_and_spoils_nothing(folder: Path, tmp_path: Path) -> None:
    """The fragment is TOML for robot.toml; the estimate on the log is no worse with it."""
    file = tmp_path / "tuned.toml"
    options = ["--seconds", "5", "--json", "--out", str(file)]
    result = runner.invoke(app, ["tune", str(folder), *options])
    assert result.exit_code == 0, result.output
    tuned = tomllib.loads(file.read_text())
    assert tuned["imu"]["accel_noise"] > 0
    assert len(tuned["platform"]["disturbance"]) == 3
    assert "noise" not in tuned.get("odometry", {})  # hidden by rounding
    data = json.loads(result.output)
    before, after = data["position_rms_m"]
    assert after < 1.1 * before
    assert data["log_likelihood"][1] > data["log_likelihood"][0]
    assert tomllib.loads(data["toml"]) == tuned


@pytest.mark.parametrize("poses", [False, True])
def test_what_was_tuned_on_a_plain_form_can_be_pasted_there(
    run: Run, tmp_path: Path, poses: bool
) -> None:
    """Every key is one of the recording's own; what has no key there is a comment."""
    log = plain_form(tmp_path, recording_of(run.log, {}))
    recording = open_recording(log)
    speed = (0.0123, 0.0123, 0.0456)
    odometry = recording.base.odometry.model_copy(update={"speed_noise": speed})
    base = recording.base.model_copy(update={"odometry": odometry})
    names = [p for p in parameters(recording) if p.name != "platform.lag"]
    tuned = tuple(Tuned(p, 1.0, 1.0, 0.1, True) for p in names)
    tuning = Tuning(base, tuned, (0.0, 1.0), {}, 100, (0.0, 5.0))
    read = replace(recording, odometry=recording.speeds) if poses else recording
    lines = fragment(Report(read, recording, [], tuning, None))
    found = tomllib.loads(lines)
    assert found.get("speeds") == (None if poses else {"noise": list(speed)})
    assert "odometry" not in found
    assert ("# of speeds made of poses, always estimated: speed_noise" in lines) == poses
    described = tomllib.loads(log.read_text())
    for table, keys in found.items():
        described.setdefault(table, {}).update(keys)
    LogDescription.model_validate(described)
