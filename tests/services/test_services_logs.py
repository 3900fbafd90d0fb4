"""Logs as files: whole, cut, foreign, empty; light; mended, exported, drawn."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import orjson
import pandas as pd
import pytest
from mcap.reader import make_reader
from mcap.writer import Writer
from typer.testing import CliRunner

from services.cli.main import app
from services.logs.file import BadLog, records
from services.logs.info import info_of
from services.logs.provenance import provenance, scenario_of
from services.logs.recover import recover
from services.logs.runlog import RunLog, parts_of, read_log, read_run
from services.logs.table import series_of
from services.logs.writer import LogWriter, json_schema
from services.messages import Imu, Odometry, Request
from services.run import Run, run_lockstep
from services.topics import ARM_STATE, ESTIMATE, IMU, ODOMETRY, REQUEST, TOPICS, TRUTH
from sim.scenario import load_scenario

runner = CliRunner()


@pytest.fixture(scope="module")
def run() -> Run:
    """Three seconds of moving to the board while the platform sways."""
    return run_lockstep(load_scenario("whiteboard_moving"), 2, duration=3.0)


@pytest.fixture(scope="module")
def file(run: Run, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Its log, in chunks of half a second as a recorder writes it."""
    file = tmp_path_factory.mktemp("logs") / "run.mcap"
    with LogWriter(file, provenance(run.scenario, 2, "ekf")) as writer:
        due = 0.5
        for arrival, name, message in run.log.merged():
            if arrival > due:
                writer.flush()
                due += 0.5
            writer.add(TOPICS[name], message, arrival)
    return file


def imu(t: float) -> Imu:
    """A message of an instant."""
    return Imu(t=t, gyro=np.full(3, t), accel=np.zeros(3))


# --- full and light -------------------------------------------------------------------------


def test_a_full_log_keeps_every_message_to_the_last_bit(run: Run, file: Path) -> None:
    """Of every topic as many as were sent, with the same numbers."""
    log, _ = read_log(file)
    assert {k: len(v) for k, v in log.messages.items()} == {
        k: len(v) for k, v in run.log.messages.items() if v
    }
    for a, b in zip(log.series(ARM_STATE), run.log.series(ARM_STATE), strict=True):
        assert a.t == b.t and np.array_equal(a.tau, b.tau) and np.array_equal(a.wrench, b.wrench)


def test_a_light_log_thins_the_fast_topics_and_nothing_the_observer_hears(
    run: Run, tmp_path: Path
) -> None:
    """A tenth of the size at most; odometry and IMU as sent, states at their light rate."""
    light, full = tmp_path / "light.mcap", tmp_path / "full.mcap"
    run.log.write(light, {"record": "light"})
    run.log.write(full, {"record": "full"})
    assert light.stat().st_size < 0.16 * full.stat().st_size
    log, _ = read_log(light)
    for topic in (ODOMETRY, IMU):
        assert len(log.series(topic)) == len(run.log.series(topic))
    for topic in (ARM_STATE, ESTIMATE, TRUTH):
        steps = np.diff([m.t for m in log.series(topic)])
        np.testing.assert_allclose(steps, 1.0 / topic.light_rate, atol=0.0051)


def test_a_log_that_could_not_be_written_to_its_end_does_not_look_whole(tmp_path: Path) -> None:
    """Stopped by whatever: there is no file."""
    path = tmp_path / "x.mcap"
    with pytest.raises(KeyboardInterrupt), LogWriter(path, {}) as writer:
        writer.add(ODOMETRY, Odometry(0.1, np.zeros(3)), 0.1)
        raise KeyboardInterrupt
    assert not path.exists()


def test_a_light_log_goes_on_when_the_robot_starts_again(tmp_path: Path) -> None:
    """Robot time that goes back to zero silences no thinned topic."""
    zero = run_lockstep(load_scenario("whiteboard"), 0, duration=0.01).log.series(ARM_STATE)[0]
    with LogWriter(tmp_path / "x.mcap", {}, "light") as writer:
        for k, t in enumerate((5.0, 5.001, 0.1, 0.101)):
            state = type(zero)(t, zero.q, zero.qd, zero.tau, zero.wrench)
            writer.add(ARM_STATE, state, 5.0 + 0.001 * k)
    log, _ = read_log(tmp_path / "x.mcap")
    assert [m.t for m in log.series(ARM_STATE)] == [5.0, 0.1]


def test_every_topic_has_a_schema_that_its_messages_keep(file: Path) -> None:
    """As Foxglove reads it: arrays say what is in them, no field is missing."""
    kinds = {"number": (int, float), "integer": int, "string": str, "boolean": bool, "object": dict}

    def keeps(value: object, schema: dict) -> bool:
        if schema["type"] == "array":
            assert isinstance(value, list)
            return all(keeps(item, schema["items"]) for item in value)
        return isinstance(value, kinds[schema["type"]])

    seen = set()
    with file.open("rb") as stream:
        for schema, channel, message in make_reader(stream).iter_messages():
            if channel.topic in seen:
                continue
            seen.add(channel.topic)
            assert schema is not None and schema.encoding == "jsonschema"
            fields = json.loads(schema.data)["properties"]
            content = json.loads(message.data)
            assert set(fields) == set(content)
            assert all(keeps(content[name], kind) for name, kind in fields.items())
    assert len(seen) == len(info_of(file).topics) > 8
    for name in TOPICS:
        assert json_schema(name)["type"] == "object"


def test_a_log_says_where_it_comes_from(run: Run, file: Path) -> None:
    """Commit, configuration, program, seed, versions; the scenario can be had from it again."""
    about = info_of(file).about
    assert about["seed"] == "2" and about["mode"] == "lockstep" and about["record"] == "full"
    assert about["git"] == "unknown" or len(about["git"].removesuffix("-dirty")) == 40
    assert "[odometry]" in about["robot_toml"]
    assert "Whiteboard" in about["program whiteboard_moving.hds"]
    for package in ("numpy", "dartpy", "mcap", "eclipse-zenoh", "python"):
        assert about[package][0].isdigit()
    with scenario_of(about) as again:
        assert again.model_dump() == run.scenario.model_dump()
        assert again.name == run.scenario.name


def test_a_program_that_has_changed_since_is_the_logs_own(run: Run) -> None:
    """What ran then is what runs again, not what the file says now."""
    about = provenance(run.scenario, 2, "ekf")
    with scenario_of(about) as same:
        assert same.program_path() == run.scenario.program_path()  # with what lies beside it
    about["program whiteboard_moving.hds"] += "\n// as it was then\n"
    with scenario_of(about) as then:
        path = then.program_path()
        assert path is not None and path.read_text().endswith("as it was then\n")


# --- cut, foreign, empty --------------------------------------------------------------------

_RECORD = """
import sys
from pathlib import Path
import numpy as np
from services.logs.recorder import Recorder
from services.messages import Imu
from services.service import Inbox
from services.topics import IMU
recorder = Recorder(Path(sys.argv[1]), {"scenario": "x"})
inbox, tick = Inbox(recorder.inputs), 0
while True:  # 50 ms of robot time a step, as the recorder's own period is
    for _ in range(50):
        t = 0.001 * tick
        inbox.offer(IMU, Imu(t=t, gyro=np.random.rand(3), accel=np.random.rand(3)), t)
        tick += 1
    recorder.step(t, inbox)
    print(t, flush=True)
"""


@pytest.mark.processes
@pytest.mark.parametrize("after", [12.3, 0.9])
def test_a_killed_recorder_loses_less_than_the_last_second(tmp_path: Path, after: float) -> None:
    """Kill -9: the log is refused with the way on, and that gives back all but the last second."""
    file = tmp_path / "run.mcap"
    with subprocess.Popen(
        [sys.executable, "-c", _RECORD, str(file)], stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        heard = next(float(line) for line in process.stdout if float(line) >= after)
        process.send_signal(signal.SIGKILL)
        heard = max([heard, *(float(line) for line in process.stdout if "." in line)])
    with pytest.raises(BadLog, match=r"steadyhand log recover .*run.mcap"):
        read_log(file)
    result = runner.invoke(app, ["log", "recover", str(file)])
    assert result.exit_code == 0, result.output
    log, about = read_log(tmp_path / "run-recovered.mcap")
    stamps = [m.t for m in log.series(IMU)]
    np.testing.assert_allclose(stamps, 0.001 * np.arange(len(stamps)), atol=1e-12)
    assert heard - 1.0 <= stamps[-1]
    assert about == {"scenario": "x"}
    assert info_of(tmp_path / "run-recovered.mcap").recovered["from"] == "run.mcap"


def test_wherever_a_log_is_cut_what_is_whole_comes_back(file: Path, tmp_path: Path) -> None:
    """A prefix of the messages, the longer the more is left, and never a traceback."""
    whole = file.read_bytes()
    messages = [r for r in records(file) if r.metadata is None]
    before = -1
    for share in (0.02, 0.3, 0.5, 0.77, 0.95, 0.999):
        cut = tmp_path / f"{share}.mcap"
        cut.write_bytes(whole[: int(share * len(whole))])
        done = recover(cut)
        found = [r for r in records(done.file) if r.metadata is None]
        assert found == messages[: len(found)]
        assert len(found) == done.messages > before - 1
        before = len(found)
        read_log(done.file)
    assert before == len(messages)  # only the summary was missing


def test_bytes_that_are_wrong_inside_end_what_can_be_read(file: Path, tmp_path: Path) -> None:
    """A damaged chunk is found by its checksum; what lies before it comes back."""
    broken = bytearray(file.read_bytes())
    broken[len(broken) // 2] ^= 0xFF
    path = tmp_path / "broken.mcap"
    path.write_bytes(broken)
    assert not info_of(path).whole
    done = recover(path)
    assert 0.3 < done.end < 2.7
    with pytest.raises(BadLog, match="log recover"):
        read_log(path)


def test_files_that_are_no_logs_are_told_what_they_are(file: Path, tmp_path: Path) -> None:
    """Empty, foreign, another's MCAP, nothing there, whole already: each in words, with exit 2."""
    (tmp_path / "empty.mcap").touch()
    (tmp_path / "photo.mcap").write_bytes(b"\xff\xd8\xff\xe0" * 100)
    other = Writer(str(tmp_path / "other.mcap"))
    other.start(library="ros2")
    channel = other.register_channel("/tf", "json", 0)
    other.add_message(channel, 0, b"{}", 0)
    other.finish()
    head = file.read_bytes()[:40]
    (tmp_path / "head.mcap").write_bytes(head)
    for verb in (["info"], ["export"], ["plot"], ["recover"]):
        more = ["robot/imu:gyro"] if verb == ["plot"] else []
        for name, said in (
            ("none.mcap", "no such file"),
            ("empty.mcap", "is empty: its recorder was killed before it wrote anything"),
            ("photo.mcap", "does not begin as an MCAP file"),
            ("other.mcap", "'ros2'"),
        ):
            result = runner.invoke(app, ["log", *verb, str(tmp_path / name), *more])
            assert result.exit_code == 2, (verb, name, result.output)
            assert said in " ".join(result.stderr.split())
    for path, said in ((file, "nothing to recover"), (tmp_path / "head.mcap", "first bytes")):
        result = runner.invoke(app, ["log", "recover", str(path)])
        assert result.exit_code == 2 and said in " ".join(result.stderr.split())
    assert runner.invoke(app, ["log", "info", str(tmp_path / "head.mcap")]).exit_code == 1


def test_nothing_is_written_over(file: Path, tmp_path: Path) -> None:
    """A file of the name that `recover` would use stops it."""
    cut = tmp_path / "run.mcap"
    cut.write_bytes(file.read_bytes()[:-100])
    (tmp_path / "run-recovered.mcap").write_text("precious")
    result = runner.invoke(app, ["log", "recover", str(cut)])
    assert result.exit_code == 2 and "it exists" in " ".join(result.stderr.split())
    assert (tmp_path / "run-recovered.mcap").read_text() == "precious"


def test_a_restarted_recorders_files_are_one_run(run: Run, tmp_path: Path) -> None:
    """The first is cut, the second whole: a folder gives both, and says so."""
    about = provenance(run.scenario, 2, "ekf")
    first = RunLog()
    second = RunLog()
    for arrival, name, message in run.log.merged():
        (first if arrival < 1.5 else second)(TOPICS[name], message, arrival)
    with LogWriter(tmp_path / "run.mcap", about) as writer:
        for arrival, name, message in first.merged():
            writer.add(TOPICS[name], message, arrival)
        writer.flush()
        (tmp_path / "kept").write_bytes((tmp_path / "run.mcap").read_bytes())
    (tmp_path / "kept").replace(tmp_path / "run.mcap")
    second.write(tmp_path / "run-2.mcap", about)
    log, found, notes = read_run(tmp_path)
    assert found == about
    assert len(log.series(IMU)) == len(run.log.series(IMU))
    assert "run.mcap is cut short: it is whole until 1.499 s" in notes[0]
    assert "2 files" in notes[1]
    (tmp_path / "run-recovered.mcap").touch()  # made by hand meanwhile: the same once more
    assert [p.name for p in parts_of(tmp_path)] == ["run.mcap", "run-2.mcap"]


def test_a_message_of_another_version_is_named(tmp_path: Path) -> None:
    """Topic, time, and where the versions are to be seen."""
    path = tmp_path / "old.mcap"
    with LogWriter(path, {}) as writer:
        writer.copy(IMU.name, orjson.dumps({"t": 1.0, "gyro": [1, 2]}), 1.0, 1.0)
    with pytest.raises(BadLog, match=r"robot/imu.*1\.000 s.*log info"):
        read_log(path)


# --- tables and pictures --------------------------------------------------------------------


def test_pandas_reads_what_was_exported(run: Run, file: Path, tmp_path: Path) -> None:
    """The lines of docs/logs.md; CSV and Parquet have the numbers of the run to the last bit."""
    for kind in ("csv", "parquet"):
        out = tmp_path / kind
        command = ["log", "export", str(file), "-o", str(out), "--format", kind]
        result = runner.invoke(app, command)
        assert result.exit_code == 0, result.output
    gyro = np.array([m.gyro for m in run.log.series(IMU)])
    for table in (
        pd.read_csv(tmp_path / "csv" / "robot-imu.csv", engine="pyarrow"),
        pd.read_parquet(tmp_path / "parquet" / "robot-imu.parquet"),
    ):
        np.testing.assert_array_equal(table[["gyro.0", "gyro.1", "gyro.2"]].to_numpy(), gyro)
        assert list(table.columns[:2]) == ["t", "arrival"]
    status = pd.read_parquet(tmp_path / "parquet" / "arm-status.parquet")
    assert status["node"].iloc[-1] == run.log.messages["arm/status"][-1].node  # type: ignore[attr-defined]
    assert status["anchored"].dtype == bool
    docs = (Path(__file__).parents[2] / "docs" / "logs.md").read_text()
    block = docs.split("<!-- pandas -->")[1].split("```")[1].removeprefix("python\n")
    names: dict = {}
    exec(block.replace("out/", f"{tmp_path}/parquet/"), names)
    assert 0.0 < names["rms"] < 1.0


def test_export_names_what_it_does_not_know(file: Path, tmp_path: Path) -> None:
    """Topic and format, with those there are; nothing is written."""
    for more, said in (
        (["--topic", "robot/sonar"], "Topics: arm/command"),
        (["--format", "xlsx"], "Known: csv, parquet"),
    ):
        out = tmp_path / "out"
        result = runner.invoke(app, ["log", "export", str(file), "-o", str(out), *more])
        assert result.exit_code == 2 and said in " ".join(result.stderr.split())
        assert not out.exists()


def test_any_numbers_can_be_drawn(file: Path, tmp_path: Path) -> None:
    """Components by name or all; truth values too; what is no number is refused with what is."""
    out = tmp_path / "x.png"
    fields = ["robot/imu:gyro", "sim/truth:recent.0.3", "observer/estimate:valid"]
    result = runner.invoke(app, ["log", "plot", str(file), *fields, "-o", str(out), "--from", "1"])
    assert result.exit_code == 0, result.output
    assert out.stat().st_size > 10_000
    t, values = series_of(file, "robot/imu:gyro.2")["robot/imu:gyro.2"]
    assert len(t) == len(values) > 250
    for field, said in (
        ("robot/imu:mag", "Fields: accel, gyro"),
        ("imu:gyro", "Topics: arm/"),
        ("gyro", "A field is TOPIC:FIELD, as in robot/imu:gyro"),
    ):
        result = runner.invoke(app, ["log", "plot", str(file), field])
        assert result.exit_code == 2 and said in " ".join(result.stderr.split())
    result = runner.invoke(app, ["log", "plot", str(file), "robot/imu", "-o", "x.txt"])
    assert result.exit_code == 2 and ".png" in result.stderr


def test_what_comes_and_goes_is_missing_where_it_is_not(tmp_path: Path) -> None:
    """Arrays of any length: empty cells, not zeros."""
    path = tmp_path / "x.mcap"
    topic = REQUEST["arm"]
    with LogWriter(path, {}) as writer:
        for t, body in ((1.0, {"a": [1.5]}), (2.0, {"a": []}), (3.0, {"a": [2.5, 3.5]})):
            writer.copy(topic.name, orjson.dumps(body), t, t)
    found = series_of(path, f"{topic.name}:a")
    np.testing.assert_array_equal(found[f"{topic.name}:a.0"][1], [1.5, np.nan, 2.5])
    np.testing.assert_array_equal(found[f"{topic.name}:a.1"][1], [np.nan, np.nan, 3.5])
    assert Request in {t.type for t in TOPICS.values()}
