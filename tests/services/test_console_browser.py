"""The page in a real browser: opens it, pushes, sees it, sends the platform away, stops, resets.

Drawn in software, so slow: nothing here is decided by how long it takes. Screenshots are kept in
the test's folder (``pytest -m browser --basetemp=DIR``), to be looked at.
"""

from __future__ import annotations

import re
import shutil
import signal
import sys
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest
from patience import PATIENCE, Command, until

pytestmark = [pytest.mark.browser, pytest.mark.processes]

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("chrome")
FLAGS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]


SCENE = {"x": 420, "y": 150, "width": 400, "height": 600}
"""Where the page is neither controls nor plots [px]."""
WAITING = """
description = "The whiteboard, but a person starts the program."
robot = "xr4000_puma560"
duration = 3600
[task]
program = "whiteboard.hds"
autostart = false
[task.base]
behaviour = "hold_still"
"""


class Up(Command):
    """A running system."""

    def __init__(self, home: Path, *scenario: str) -> None:
        command = [sys.executable, "-m", "services.cli", "up", *scenario, "--port", "0"]
        command += ["--hang", "30", "--run-dir", str(home / "r"), "--out", str(home / "out")]
        super().__init__(command, home / "up.txt")

    def address(self) -> str:
        """Of the page, once it is there."""
        pattern = re.compile(r"console\s+ready.*(http://127\.0\.0\.1:\d+)")
        found = until(lambda: pattern.search(self.said()), "the page's address", self.failed)
        return str(found[1])  # type: ignore[index]


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """Chromium, drawing in software."""
    if CHROMIUM is None:
        pytest.skip("no Chromium here (apt-get install chromium)")
    api = pytest.importorskip("playwright.sync_api")
    with api.sync_playwright() as play:
        chromium = play.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield chromium
        chromium.close()


def opened(browser: Any, address: str) -> Any:
    """A page that shows something."""
    page = browser.new_page(viewport={"width": 1280, "height": 860})
    page.set_default_timeout(PATIENCE * 1e3)
    page.goto(address)
    page.wait_for_selector("canvas")
    page.get_by_text("No safety stop.").wait_for()
    return page


def tab(page: Any, name: str) -> None:
    """Turn to a tab."""
    page.get_by_role("tab", name=name, exact=True).click()


def text(page: Any) -> str:
    """All that can be read now."""
    return str(page.inner_text("body"))


def picture(page: Any, selector: str) -> str:
    """What a plot's canvas shows."""
    return str(page.locator(selector).first.evaluate("c => c.toDataURL()"))


def x_and_y(page: Any) -> tuple[float, float]:
    """What the page says the estimate is [mm]."""
    found = until(
        lambda: re.search(r"x ([+-][\d.]+) ± .*y ([+-][\d.]+) ±", text(page)), "the estimate"
    )
    return float(found[1]), float(found[2])


def press(page: Any, name: str) -> None:
    """Press a button of that very name."""
    page.get_by_role("button", name=name, exact=True).click()


def fill(page: Any, label: str, value: str) -> None:
    """Type a number beside its slider in the folder that is open."""
    name = page.locator("label:visible", has_text=re.compile(f"^{label}$")).first
    field = name.locator("xpath=ancestor::div[.//input][1]").locator("input[inputmode]").last
    field.fill(value)
    field.blur()


def test_a_person_sees_it_move_pushes_it_sends_it_away_stops_and_resets_it(
    browser: Any, tmp_path: Path
) -> None:
    """Everything that is pressed has an effect that is seen on the page, and an answer."""
    with TemporaryDirectory(prefix="sh", ignore_cleanup_errors=True) as home:
        scenario = tmp_path / "waiting.toml"
        scenario.write_text(WAITING)
        up = Up(Path(home), str(scenario), "--paced", "--seed", "1")
        try:
            page = opened(browser, up.address())
            page.screenshot(path=tmp_path / "0_waits.png")

            # started: the program goes through its nodes, and so do plots and scene
            scene = page.screenshot(clip=SCENE)
            press(page, "Start")
            until(lambda: "program: Start: accepted" in text(page), "the answer to Start")
            until(lambda: "arm running, node" in text(page), "a node of the program")
            plot = picture(page, ".uplot canvas")
            until(lambda: picture(page, ".uplot canvas") != plot, "a plot that moves")
            until(lambda: page.screenshot(clip=SCENE) != scene, "a scene that moves")
            page.screenshot(path=tmp_path / "1_moves.png")

            # pushed: the disturbance acts, and the estimate has seen the platform move
            x0, _ = x_and_y(page)
            tab(page, "Disturb")
            fill(page, "force", "150")
            fill(page, "duration", "0.3")
            fill(page, "direction", "180")
            page.get_by_role("button", name="push now").click()
            until(lambda: "push: accepted" in text(page), "the answer to the push")
            page.screenshot(path=tmp_path / "2_pushed.png")
            tab(page, "Run")
            until(lambda: abs(x_and_y(page)[0] - x0) > 1.0, "an estimate that reacts")
            page.screenshot(path=tmp_path / "3_reacts.png")

            # sent away: the arm is let go of the board first
            press(page, "Stop")
            until(lambda: "program: Stop: accepted" in text(page), "the answer to Stop")
            x1, y1 = x_and_y(page)
            tab(page, "Platform")
            page.get_by_role("button", name="Goal: click the floor").click()
            page.get_by_role("button", name="Click the floor").wait_for()
            page.mouse.move(540, 740)
            page.mouse.click(560, 760, delay=200)
            until(lambda: "Goal (" in text(page), "the answer to the goal")
            page.screenshot(path=tmp_path / "4_goal.png")
            assert re.search(r"Goal \(.*\): accepted", text(page))
            tab(page, "Run")
            until(
                lambda: sum(abs(a - b) for a, b in zip(x_and_y(page), (x1, y1), strict=True)) > 100,
                "a platform that drives",
            )
            page.screenshot(path=tmp_path / "5_drives.png")

            # stopped, and reset
            page.get_by_role("button", name="Protective stop").click()
            until(lambda: "protective_stop" in text(page), "the arm in protective stop")
            page.screenshot(path=tmp_path / "6_stopped.png")
            press(page, "Start")
            until(lambda: "program: Start: refused" in text(page), "a refusal with its reason")
            press(page, "Reset arm")
            until(lambda: "after a stop: Reset arm: accepted" in text(page), "the answer to Reset")
            until(lambda: re.search(r"arm idle", text(page)), "an arm that is idle")
            page.screenshot(path=tmp_path / "7_reset.png")

            # two browsers see the same
            other = opened(browser, page.url)
            until(lambda: "arm idle" in text(other), "the second browser's events")
            tab(other, "Services")
            until(lambda: "2 looking" in text(other), "both browsers")
            other.screenshot(path=tmp_path / "8_services.png")
        finally:
            up.end(signal.SIGKILL)  # nobody looks at its pictures
