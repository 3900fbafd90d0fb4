"""The page: scene, words and plots, fed thirty times a second by whoever has the data."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from services.console import words
from services.console.feed import Feed
from services.console.model import Model
from services.console.overlays import Overlays
from services.console.plots import Plots
from services.console.robot_view import RobotView
from services.console.server import Server
from services.console.surroundings import Surroundings
from services.topics import ARM_STATE, ESTIMATE, OBJECT, TRUTH
from sim.scenario import Scenario

WORDS = 0.2
"""Time between two looks of the words [s]."""


class Page:
    """What a browser shows.

    Args:
        server: that serves it.
        scenario: whose robot and world are drawn.
    """

    def __init__(self, server: Server, scenario: Scenario) -> None:
        self.server, self.scenario = server, scenario
        self.model = Model(scenario.robot)
        scene, gui = server.scene, server.gui
        scene.reset()
        gui.reset()
        scene.configure_default_lights(cast_shadow=False)
        self._robot = RobotView(scene, self.model)
        self._surroundings = Surroundings(scene, scenario)
        laser = self.model.robot.laser
        self.overlays = Overlays(
            scene, self._surroundings, None if laser is None else laser.position
        )
        self._look()
        self.tabs: Any = gui.add_tab_group()
        with self.tabs.add_tab("Run"):
            self.controls = gui.add_folder("Safety and answers")
            self.program = gui.add_folder("Program", expand_by_default=True)
            with gui.add_folder("Automaton"):
                self._automaton = gui.add_markdown("")
            with gui.add_folder("Estimate"):
                self._estimate = gui.add_markdown("")
                self._magnify = gui.add_slider(
                    "draw errors ×", 1, 100, 1, 20, hint="ghost and 3σ ellipse of the estimate"
                )
        with self.tabs.add_tab("Platform"):
            self.platform_controls = gui.add_folder("Platform")
            self._platform = gui.add_markdown("")
        self.services = self.tabs.add_tab("Services")
        with self.services:
            self._services = gui.add_markdown("")
        self._plots = Plots(gui)
        gui.main_panel.dock_left()
        gui.main_panel.set_width(360)
        self._next_words = 0.0
        self.frames = 0

    def show(self, feed: Feed, now: float) -> None:
        """Bring the page up to date; costs next to nothing while nobody looks.

        Args:
            feed: what was heard.
            now: local time, of the same clock as the feed's [s].
        """
        if not self.server.get_clients():
            return
        self.frames += 1
        with self.server.atomic():
            self._show_scene(feed)
            self._plots.show(feed, time.monotonic())
            if time.monotonic() >= self._next_words:
                self._next_words = time.monotonic() + WORDS
                self._automaton.content = words.automaton(feed)
                self._estimate.content = words.estimate(feed)
                self._platform.content = words.platform(feed)
                self._services.content = words.services(feed, now)

    def _show_scene(self, feed: Feed) -> None:
        estimate, truth, state = feed.latest(ESTIMATE), feed.latest(TRUTH), feed.latest(ARM_STATE)
        where = self.where(feed)
        q = truth.q if truth is not None else state.q if state is not None else self.model.rest
        self._robot.show(where, q)
        self._robot.ghosts["true"].show(None if truth is None else where)
        believed = None
        if estimate is not None and estimate.valid:
            believed = where + self._magnify.value * feed.error
        self._robot.ghosts["estimated"].show(believed)
        self.overlays.show(feed, where, self._magnify.value)
        self._surroundings.show(feed.t, truth, feed.latest(OBJECT), feed.offset)

    @staticmethod
    def where(feed: Feed) -> np.ndarray:
        """Where the robot is drawn: the truth where it is known, else what is believed."""
        truth, estimate = feed.latest(TRUTH), feed.latest(ESTIMATE)
        if truth is not None:
            return truth.pose
        return estimate.pose if estimate is not None else np.zeros(3)

    def _look(self) -> None:
        """Where a new browser looks from: behind the robot's right shoulder."""
        camera = self.server.initial_camera
        x, y, _ = self.scenario.world.platform_start
        if self._surroundings.board is None:
            table = self.scenario.world.table
            camera.position = (table.x - 3.5, table.y - 2.5, 2.6)
            camera.look_at = (table.x - 0.8, table.y, 0.8)
        else:
            camera.position = (x - 1.9, y - 1.5, 2.0)
            camera.look_at = (x + 0.3, y, 1.0)
