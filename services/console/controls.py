"""Buttons: programs, stops and resets, a goal for the platform by a click on the floor."""

from __future__ import annotations

import math
import time
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from services.console.asking import Answer, Asking
from services.console.disturbances import DisturbanceForms
from services.console.feed import Feed, inverse, moved
from services.console.page import Page
from services.console.words import WARNING, plain
from services.messages import AT_WORK, ArmStatus
from services.topics import ARM_STATUS

STEP_LIMIT = 60.0
"""A step to the next node is given up after this; the program then goes on as it is [s]."""

VERBS = {
    "Start": "start",
    "Pause": "pause",
    "Resume": "resume",
    "Stop": "stop",
    "Abort": "abort",
}
"""What a program can be asked for, as the arm calls it."""


class Controls:
    """Everything on the page that can be pressed.

    Args:
        page: to add them to.
        feed: of the running robot, the same for as long as the page lives.
        asking: sends the requests.
    """

    def __init__(self, page: Page, feed: Feed, asking: Asking) -> None:
        self._page, self._feed, self._asking = page, feed, asking
        self._shown: tuple[Answer, ...] | None = None
        gui = page.server.gui
        with page.controls:
            gui.add_markdown(WARNING)
            stop = gui.add_button("Protective stop", color="red", hint="arm and platform")
            stop.on_click(lambda e: tell(e.client, self._protective_stop("Protective stop")))
            self._group("after a stop", {"Reset arm": "reset"}, "arm")
            self._answers = gui.add_markdown("")
        with page.program:
            self._group("program", VERBS, "arm")
            step = gui.add_button("Step", hint="go on, and pause in the next node")
            step.on_click(lambda event: tell(event.client, self._step("Step")))
        with page.platform_controls:
            self._group("platform", {"Halt": "stop", "Go on": "resume"}, "base")
            self._heading = gui.add_slider("heading [°]", -180.0, 180.0, 5.0, 0.0)
            self._goal = gui.add_button(LABEL, color="yellow")
            self._goal.on_click(lambda _: self._await_click())
        self._waiting = False
        with page.tabs.add_tab("Disturb"):
            DisturbanceForms(gui, page.model, page.scenario, self._press_disturbance)

    def show(self) -> None:
        """Show the newest answers, if there are new ones."""
        answers = tuple(self._asking.answers)
        if answers != self._shown:
            self._shown = answers
            self._answers.content = "\n".join(f"- {said(answer)}" for answer in reversed(answers))

    def _group(self, name: str, verbs: dict[str, str], service: str) -> None:
        group = self._page.server.gui.add_button_group(name, tuple(verbs))

        def pressed(event: Any) -> None:
            label = event.target.value
            tell(event.client, self._asking(f"{name}: {label}", service, verbs[label]))

        group.on_click(pressed)

    def _press_disturbance(self, client: Any, kind: str, options: dict[str, Any]) -> None:
        tell(client, self._asking(kind, "sim", "disturb", {"kind": kind, **options}))

    def _protective_stop(self, label: str) -> Answer:
        args = {"reason": "asked for at the console"}
        with ThreadPoolExecutor(2) as both_at_once:  # neither waits for the other's answer
            asked = both_at_once.submit(
                self._asking, label, "arm", "protective_stop", args, urgent=True
            )
            base = self._asking("platform: Halt", "base", "stop", urgent=True)
            arm = asked.result()
        both = f"arm: {arm.reason or 'stopped'}; platform: {base.reason or 'stopped'}"
        return Answer(label, arm.accepted and base.accepted, both)

    def _step(self, label: str) -> Answer:
        """Let the program go on until its node changes, then pause it again."""
        before = self._feed.latest(ARM_STATUS)
        if before is None or before.state not in (*AT_WORK, "paused"):
            return self._refused(label, "no program is running or paused")
        if before.state == "paused":
            gone_on = self._asking(label, "arm", "resume")
            if not gone_on.accepted:
                return gone_on
        deadline = time.monotonic() + STEP_LIMIT
        while time.monotonic() < deadline:
            status = self._feed.latest(ARM_STATUS)
            if status is None or status.state not in (*AT_WORK, "paused"):
                return self._refused(label, f"the program is {_state(status)} now")
            if status.transitions != before.transitions:
                return self._asking("Step: pause", "arm", "pause")
            time.sleep(0.01)
        return self._refused(label, f"no other node within {STEP_LIMIT:.0f} s; it goes on")

    def _refused(self, label: str, reason: str) -> Answer:
        answer = Answer(label, False, reason)
        self._asking.answers.append(answer)
        return answer

    def _await_click(self) -> None:
        scene = self._page.server.scene
        scene.remove_click_callback("all")
        self._waiting = not self._waiting
        self._goal.label = "Click the floor, or here to leave it" if self._waiting else LABEL
        if self._waiting:
            scene.on_click()(self._clicked)

    def _clicked(self, event: Any) -> None:
        point = on_floor(np.array(event.ray_origin), np.array(event.ray_direction))
        if point is None or not self._waiting:
            return
        self._await_click()
        pose = np.array([*point, math.radians(self._heading.value)])
        self._page.overlays.show_goal(pose)
        x, y, heading = moved(inverse(self._feed.offset), pose)
        args = {"x": float(x), "y": float(y), "heading": float(heading)}
        answer = self._asking(f"Goal ({point[0]:.2f}, {point[1]:.2f})", "base", "goal", args)
        if not answer.accepted:
            self._page.overlays.show_goal(None)
        tell(event.client, answer)


LABEL = "Goal: click the floor"
FARTHEST = 50.0
"""A click further away than this meets the horizon rather than the floor [m]."""


def on_floor(origin: np.ndarray, direction: np.ndarray) -> np.ndarray | None:
    """Where a ray meets the floor, (x, y) [m]; None above the horizon or too far away."""
    if direction[2] >= -1e-6:
        return None
    way = -origin[2] / direction[2]
    if way < 0 or way * float(np.linalg.norm(direction)) > FARTHEST:
        return None
    return np.array((origin + way * direction)[:2])


def said(answer: Answer) -> str:
    """An answer as a line of Markdown."""
    word = "accepted" if answer.accepted else "**refused**"
    return f"{plain(answer.label)}: {word}" + (f", {plain(answer.reason)}" if answer.reason else "")


def tell(client: Any, answer: Answer) -> None:
    """Show an answer to whoever pressed."""
    if client is not None:
        client.add_notification(
            f"{answer.label}: {'accepted' if answer.accepted else 'refused'}",
            answer.reason,
            auto_close_seconds=4.0 if answer.accepted else 12.0,
            color="green" if answer.accepted else "red",
        )


def _state(status: ArmStatus | None) -> str:
    return "gone" if status is None else status.state
