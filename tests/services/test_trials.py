"""Campaigns: the same rows however they are run, nothing lost, nothing run twice."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import socket
import subprocess
import sys
import textwrap
import warnings
from pathlib import Path
from typing import Any

import pytest
from distributed import LocalCluster
from patience import PATIENCE, until
from typer.testing import CliRunner

from services.cli.main import app
from services.trials import code
from services.trials.work import ONE_THREAD

runner = CliRunner()
TOY = str(Path(__file__).parent / "trial_toys.py")


@pytest.fixture(autouse=True)
def _code_as_it_is_now() -> None:
    """Long test runs outlive edits of the code; workers read it when they start."""
    code._shared.cache_clear()


def trials(*words: str | Path, exit_code: int = 0, toy: str = TOY) -> dict[str, Any]:
    """What a campaign with toy trials gives as JSON."""
    result = runner.invoke(app, ["trials", toy, *map(str, words), "--json"])
    assert result.exit_code == exit_code, result.output
    answer: dict[str, Any] = json.loads(result.stdout)
    return answer


def refused(*words: str | Path, exit_code: int = 2, toy: str = TOY) -> str:
    """The error of a campaign that is not begun, without line breaks."""
    result = runner.invoke(app, ["trials", toy, *map(str, words)])
    assert result.exit_code == exit_code, result.output
    return " ".join(result.stderr.split())


@pytest.mark.processes
def test_rows_are_the_same_bits_however_they_are_run(tmp_path: Path) -> None:
    """One worker, two, interrupted and resumed, or a cluster by its address: the same file."""
    trials("--trials", "6", "--out", tmp_path / "one")
    done = trials("--trials", "6", "--workers", "2", "seconds=0.05", "--out", tmp_path / "two")
    assert done["effort"]["workers"] == 2
    assert 0.0 < done["effort"]["efficiency"] <= 1.0
    with LocalCluster(
        n_workers=1, threads_per_worker=1, dashboard_address=None, env=ONE_THREAD
    ) as other:
        address = other.scheduler_address
        trials("--trials", "2", "--cluster", address, "--out", tmp_path / "three")
        more = trials(
            "--trials", "6", "--cluster", address, "--out", tmp_path / "three", "--resume"
        )
    assert more["effort"]["trials"] == 4
    rows = {(tmp_path / name / "rows.json").read_bytes() for name in ("one", "two", "three")}
    assert len(rows) == 1
    assert len(json.loads(rows.pop())) == 6


@pytest.mark.processes
def test_no_trial_is_fatal(tmp_path: Path) -> None:
    """One that raises is recorded; one whose worker dies is tried once more, then recorded."""
    marks = tmp_path / "marks"
    marks.mkdir()
    words = ["fails=[1]", "dies=[2]", "dies_once=[3]", f"folder={marks}"]
    folder = tmp_path / "out"
    done = trials(*words, "--trials", "5", "--out", folder, exit_code=1)
    assert [(r["seed"], r["status"]) for r in done["unfinished"]] == [(1, "failed"), (2, "lost")]
    assert done["summary"][0]["n"] == 3
    tries = {int(mark.name): mark.stat().st_size for mark in marks.iterdir()}
    assert tries == {0: 1, 1: 1, 2: 2, 3: 2, 4: 1}
    journal = [json.loads(line) for line in (folder / "trials.jsonl").read_text().splitlines()]
    assert "trial_toys.py" in next(r for r in journal if r["seed"] == 1)["traceback"]

    # resumed: only the lost one is tried again, twice as before
    trials(*words, "--trials", "5", "--out", folder, "--resume", exit_code=1)
    tries = {int(mark.name): mark.stat().st_size for mark in marks.iterdir()}
    assert tries == {0: 1, 1: 1, 2: 4, 3: 2, 4: 1}

    # replayed, a failure is the same failure
    again = trials("--replay", "1", "--out", folder, exit_code=1)
    assert again["same"] is True
    assert "is to fail" in again["error"]


@pytest.mark.processes
def test_what_is_already_known_is_not_run_again(tmp_path: Path) -> None:
    """A line torn by a crash is dropped and its trial run; with nothing missing nothing runs."""
    trials("--trials", "3", "--out", tmp_path)
    journal = tmp_path / "trials.jsonl"
    whole, rows = journal.read_text(), (tmp_path / "rows.json").read_bytes()
    lines = whole.splitlines(keepends=True)
    journal.write_text("".join(lines[:2]) + lines[2][:20])
    done = trials("--trials", "3", "--out", tmp_path, "--resume")
    assert done["effort"]["trials"] == 1
    assert (tmp_path / "rows.json").read_bytes() == rows
    assert trials("--trials", "3", "--out", tmp_path, "--resume")["effort"]["trials"] == 0

    replayed = trials("--replay", "1", "--out", tmp_path)
    assert replayed["same"] is True
    assert replayed["row"] == json.loads(rows)[1]["row"]

    for words, said in (
        ([], "--resume goes on with it"),
        (["--resume", "--seed", "5"], "first seed is 0, not 5"),
        (["--resume", "scale=2"], "its scale is 1.0, not 2.0"),
    ):
        assert said in refused(*words, "--out", tmp_path)
    about = json.loads((tmp_path / "campaign.json").read_text())
    about["code"]["sim"] = "0123"
    (tmp_path / "campaign.json").write_text(json.dumps(about))
    error = refused("--resume", "--out", tmp_path)
    assert "the code changed" in error
    assert "sim (0123 then" in error
    assert "another --out" in error
    journal.write_text("nonsense\n" + whole)
    assert "trials.jsonl:1: not a trial" in refused("--resume", "--out", tmp_path)


def test_a_trial_gives_plain_data(tmp_path: Path) -> None:
    """A row that JSON cannot hold is a failure of that trial, not of the campaign."""
    toy = tmp_path / "odd.py"
    toy.write_text(
        textwrap.dedent('''
        """A row with a set in it."""
        from services.trials.experiment import Options
        def run(seed, options): return {"x": {1}}
        def summary(rows): return []
        def pictures(rows, folder): return []
        ''')
    )
    assert "not JSON" in trials("--replay", "0", toy=str(toy), exit_code=1)["error"]


def test_wrong_questions_say_what_is_known(tmp_path: Path) -> None:
    """Exit code 2, with the names that are allowed."""
    assert "did you mean whiteboard" in refused(toy="whitebord")
    assert "no file" in refused(toy=str(tmp_path / "none.py"))
    assert "did you mean 'scale'" in refused("scle=1")
    error = refused("scale=much", "oops=1")
    assert "scale: Input should be a valid number" in error
    assert "seconds=0.0" in error
    assert "key=value" in refused("scale")
    assert "twice" in refused("scale=1", "scale=2")
    assert "whiteboard_moving" in refused("scenario=none", toy="whiteboard")
    broken = tmp_path / "broken.py"
    broken.write_text("x = 1\n")
    assert "no Options, run, summary, pictures" in refused(toy=str(broken))
    assert "holds no campaign" in refused("--resume", "--out", tmp_path / "none")
    file = tmp_path / "file"
    file.write_text("")
    assert f"cannot write to {file}" in refused("--out", file)
    assert runner.invoke(app, ["trials", TOY, "--trials", "0"]).exit_code == 2


def test_a_cluster_that_does_not_answer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Exit code 1 and what an address looks like; the folder can be used again."""
    monkeypatch.setattr("services.trials.cluster.PATIENCE", 0.5)
    address = "tcp://127.0.0.1:9"
    error = refused("--cluster", address, "--out", tmp_path, exit_code=1)
    assert f"no Dask scheduler answers at '{address}'" in error
    assert "without --cluster" in error
    other = refused("--cluster", "nonsense://x", "--out", tmp_path, exit_code=1)
    assert "no Dask scheduler" in other


def test_a_port_that_others_have_is_no_concern() -> None:
    """Somebody else's Dask dashboard on this machine is not warned of."""
    from services.trials.cluster import connected

    with socket.socket() as other, warnings.catch_warnings():
        other.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        with contextlib.suppress(OSError):  # then it is taken already
            other.bind(("127.0.0.1", 8787))
            other.listen()
        warnings.simplefilter("error", UserWarning)
        with connected(1, None) as client:
            assert len(client.nthreads()) == 1


def test_lists_the_experiments() -> None:
    """Without a name: every experiment and what it is."""
    result = runner.invoke(app, ["trials", "--json"])
    assert json.loads(result.stdout)["whiteboard"].startswith("Draws on the whiteboard")


def test_help_does_not_import_dask() -> None:
    """A list of commands is to come at once."""
    script = (
        "import sys\nfrom services.cli.main import app\n"
        "try: app(['--help'])\nexcept SystemExit: pass\n"
        "assert not {'dask', 'distributed'} & set(sys.modules)"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, env=dict(os.environ)
    )
    assert done.returncode == 0, done.stderr
    assert "trials" in done.stdout


def test_the_example_of_the_documentation_runs(tmp_path: Path) -> None:
    """What docs/trials.md says an experiment is, is one."""
    text = (Path(__file__).parents[2] / "docs" / "trials.md").read_text()
    toy = tmp_path / "coin.py"
    toy.write_text(text.partition("```python\n")[2].partition("```")[0])
    done = trials("--replay", "1", "bias=1", "--out", tmp_path / "out", toy=str(toy))
    assert done["row"] == {"head": True}


@pytest.mark.processes
def test_ctrl_c_keeps_what_is_done(tmp_path: Path) -> None:
    """Interrupted as from a terminal: no worker is left, no traceback, and how to go on."""
    words = ["trials", TOY, "seconds=0.3", "--trials", "1000", "--out", str(tmp_path)]
    command = [sys.executable, "-m", "services.cli", *words]
    with subprocess.Popen(
        command,
        start_new_session=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
    ) as process:
        journal = tmp_path / "trials.jsonl"
        try:
            until(lambda: journal.is_file() and journal.stat().st_size, "a trial that is done")
            os.killpg(process.pid, signal.SIGINT)
            said = process.communicate(timeout=PATIENCE)[0]
        finally:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
    assert process.returncode == 1
    assert "--resume goes on" in " ".join(said.split())
    assert "Traceback" not in said
    assert journal.read_text().endswith("}\n")
