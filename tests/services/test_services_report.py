"""The report of a run: one file, everything in it, each picture with what it shows."""

from __future__ import annotations

import base64
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from services.cli.main import app
from services.logs.provenance import provenance
from services.logs.runlog import RunLog
from services.messages import Health, Request
from services.reports.consistency import consistency_of
from services.reports.faults import disturbances_of, events_of, faults_of
from services.reports.html import TITLES, html_of
from services.reports.sentences import SENTENCES
from services.run import Run, run_lockstep
from services.topics import HEALTH, REQUEST, TOPICS, TRUTH
from sim.scenario import Scenario, load_scenario

runner = CliRunner()
PUSH = {"kind": "push", "t": 4.2, "duration": 0.2, "force": 200.0, "direction": 90.0}
DROPOUTS = [
    {"kind": "dropout", "t": 5.5, "duration": 1.5, "sensor": sensor}
    for sensor in ("odometry", "imu")
]


@pytest.fixture(scope="module")
def run() -> Run:
    """A stroke during which the platform is pushed, and then loses odometry and IMU."""
    still = load_scenario("whiteboard")
    disturbed = Scenario.model_validate(still.model_dump() | {"disturbance": [PUSH, *DROPOUTS]})
    disturbed._path = still.path
    return run_lockstep(disturbed, 11, duration=8.5)


@pytest.fixture(scope="module")
def page(run: Run) -> str:
    """Its report."""
    return html_of(run.log, provenance(run.scenario, 11, "ekf"), [], "pushed")


class Seen(HTMLParser):
    """What a page holds: tags with attributes, and text."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict]] = []
        self.open: list[str] = []
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag not in ("meta", "img", "br"):
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def test_the_page_needs_nothing_else(page: str) -> None:
    """Well-formed, no script, no address but those within; every picture is a PNG inside it."""
    seen = Seen(page)
    assert not seen.open
    for tag, attributes in seen.tags:
        assert tag not in ("script", "link", "iframe")
        for name in ("src", "href"):
            assert attributes.get(name, "#").startswith(("#", "data:image/png;base64,"))
    pictures = [a["src"] for tag, a in seen.tags if tag == "img"]
    for source in pictures:
        data = base64.b64decode(source.partition(",")[2], validate=True)
        assert data.startswith(b"\x89PNG") and len(data) > 5_000
    names = [a["id"] for tag, a in seen.tags if tag == "section"]
    wanted = ["timeline", "board", "drawing", "estimate", "consistency", "force", "torques"]
    assert names == ["figures", *wanted, "faults", "origin"]
    assert len(pictures) == len(wanted)
    assert set(TITLES) == set(SENTENCES)


def test_every_picture_has_a_sentence_with_its_figures(page: str, run: Run) -> None:
    """The numbers of this run, not of another."""
    assert f"{run.result['line_rms_mm']:.3g} mm rms" in page
    assert f"{run.result['estimate_rms_mm']:.3g} mm and" in page
    assert f"{100 * run.result['contact_fraction']:.1f}" in page
    sentences = re.findall(r"<h2>.*?</h2>\s*<p>(.*?)</p>", page)
    assert len(sentences) == len(re.findall("<section", page))
    assert all(s.strip().endswith((".", ":")) and len(s) > 20 for s in sentences)


def test_faults_say_what_was_done_about_each(run: Run) -> None:
    """The push: seen as a disturbance; both sensors gone: said, and the arm goes on or not."""
    push, dropout = faults_of(run.log)
    assert push.span.start == pytest.approx(4.2, abs=0.01)
    assert push.span.end == pytest.approx(4.4, abs=0.01)
    assert "push" in push.span.what and "disturbed" in push.observer
    assert push.error is not None and 0.0001 < push.error < 0.05
    assert dropout.span.what == "dropout" and dropout.arm == "went on"
    assert "imu silent" in dropout.observer and "odometry late" in dropout.observer
    blind = RunLog()
    for arrival, name, message in run.log.merged():
        if name == "arm/status" and arrival > 6.0:
            message = replace(message, state="safe_hold", reason="no estimate")
        blind(TOPICS[name], message, arrival)
    assert "safe_hold: no estimate (at 6.0" in faults_of(blind)[1].arm
    assert any(what == "safe_hold: no estimate" for _, who, what in events_of(blind))


def test_requests_restarts_and_holes_are_events() -> None:
    """What people asked, with the answer; who came back; where the log has nothing."""
    whole = run_lockstep(load_scenario("whiteboard"), 1, duration=2.0).log
    log = RunLog()
    for arrival, name, message in whole.merged():
        if not 0.8 < arrival < 1.6:
            log(TOPICS[name], message, arrival)
    log(REQUEST["arm"], Request(t=0.1, verb="start", accepted=False, reason="no estimate"), 0.1)
    log(REQUEST["arm"], Request(t=0.2, verb="start", accepted=False, reason="no estimate"), 0.2)
    for t, pid in ((0.5, 1), (1.9, 2)):
        log(HEALTH["base"], Health(t=t, service="base", pid=pid), t)
    assert [(s.what, round(s.start, 1)) for s in disturbances_of(log)] == [
        ("nothing in the log", 0.8)
    ]
    assert events_of(log)[0] == (0.1, "arm", "asked to start, 2 times: refused: no estimate")
    assert (1.9, "base", "restarted; silent since 0.50 s") in events_of(log)


def test_consistency_counts_each_innovation_once(run: Run) -> None:
    """As many as measurements arrived, of a mean near three for the IMU."""
    found = consistency_of(run.log)
    for (t, nis), topic in ((found.odometry, "robot/odometry"), (found.imu, "robot/imu")):
        heard = len(run.log.messages[topic])
        assert 0.9 * heard - 2 <= len(t) <= heard
        assert (np.diff(t) > 0).all() and (nis > 0).all()
    assert 2.0 < found.imu[1].mean() < 6.0
    assert found.inside > 0.9


def test_loops_are_shown_of_live_runs(run: Run) -> None:
    """Heartbeats make a section with a table; lockstep says why there is none."""
    log = RunLog()
    for arrival, name, message in run.log.merged():
        log(TOPICS[name], message, arrival)
    for k in range(20):
        late = {"p50": 1e-4, "p99": 4e-4, "max": 2e-3}
        beat = Health(
            t=0.2 * k, service="arm", pid=1, period={"mean": 1e-3}, lateness=late, overruns=3
        )
        log(HEALTH["arm"], beat, 0.2 * k)
    page = html_of(log, provenance(run.scenario, 11, "ekf", "live"), [], "live")
    assert 'id="loops"' in page and "less than 0.40 ms late" in page and "2.0 ms; 3 ticks" in page
    assert "no loop can be late" not in page
    assert "no loop can be late" in html_of(run.log, provenance(run.scenario, 11, "ekf"), [], "x")


def test_platform_and_two_arms_have_their_own_pictures() -> None:
    """What applies: the way from above; palms and box; no board."""
    for name, has in (("clutter", "floor"), ("reach_to_grasp", "grasp")):
        done = run_lockstep(load_scenario(name), 2, duration=1.5)
        page = html_of(done.log, provenance(done.scenario, 2, "ekf"), [], name)
        assert f'id="{has}"' in page and 'id="estimate"' in page
        assert 'id="board"' not in page and 'id="force"' not in page


def test_what_a_log_says_cannot_break_the_page(run: Run) -> None:
    """Text from outside is text."""
    about = provenance(run.scenario, 11, "ekf") | {"seed": "<script>alert(1)</script>"}
    page = html_of(run.log, about, ["<b>note"], "<img src=x>")
    assert "<script" not in page and "<b>note" not in page and "<img src=x>" not in page


def test_a_log_of_a_scenario_that_is_gone_is_reported_without_it(run: Run) -> None:
    """Said in the page; the pictures that need no scenario are there."""
    page = html_of(run.log, {"scenario_toml": "nonsense = 1"}, [], "old")
    assert "without the scenario" in page and 'id="board"' in page and 'id="floor"' not in page


def test_the_command_writes_it_and_says_where(run: Run, tmp_path: Path) -> None:
    """Of a folder or a file; what is no log is named with the way on."""
    run.log.write(tmp_path / "run.mcap", provenance(run.scenario, 11, "ekf"))
    for given, out in ((tmp_path, tmp_path / "report.html"), (tmp_path / "run.mcap", None)):
        more = ["-o", str(tmp_path / "x.html")] if out is None else []
        result = runner.invoke(app, ["report", str(given), *more])
        assert result.exit_code == 0, result.output
        assert (out or tmp_path / "x.html").read_text().startswith("<!doctype html>")
    cut = tmp_path / "cut.mcap"
    cut.write_bytes((tmp_path / "run.mcap").read_bytes()[:-50])
    RunLog().write(tmp_path / "none.mcap", {})
    for path, said in (
        (cut, "steadyhand log recover"),
        (tmp_path / "gone", "no such file"),
        (tmp_path / "none.mcap", "nothing to report"),
    ):
        result = runner.invoke(app, ["report", str(path)])
        assert result.exit_code == 2, result.output
        assert said in " ".join(result.stderr.split())
    assert TRUTH.name in run.log.messages
