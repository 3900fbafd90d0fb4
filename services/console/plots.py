"""The plots: what of the feed each shows, and the window of time that all of them show."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from services.console.feed import Feed
from services.topics import SERVICES

PERIOD = 0.1
"""Time between two pictures [s]: ten a second look smooth and are cheap."""
BACK = 60.0
"""How far back one can look [s]."""
RED, BLUE, GREEN, GOLD, GREY = "#d62828", "#2171e6", "#2ea043", "#e09f14", "#9aa0a6"


@dataclass(frozen=True)
class Plot:
    """One plot.

    Attributes:
        tab: where it is.
        track: name in ``feed.TRACKS``.
        title: with unit.
        lines: name and colour of each; dashed if the name ends in "σ" or "limit".
        columns: of the track; a number in its place is drawn as a constant.
    """

    tab: str
    track: str
    title: str
    lines: tuple[tuple[str, str], ...]
    columns: tuple[int | float, ...]


BAND = (("+3σ", GREY), ("-3σ", GREY))

PLOTS = (
    Plot(
        "Estimate",
        "velocity",
        "velocity of the platform, estimated [mm/s, mrad/s]",
        (("x", BLUE), ("y", GREEN), ("turn", GOLD)),
        (0, 1, 2),
    ),
    Plot(
        "Estimate",
        "error",
        "error of the estimated position, with 3σ [mm]",
        (("x", BLUE), ("y", GREEN), *BAND),
        (0, 1, 3, 4),
    ),
    Plot(
        "Estimate",
        "error",
        "error of the estimated heading, with 3σ [mrad]",
        (("heading", GOLD), *BAND),
        (2, 5, 6),
    ),
    Plot(
        "Innovations",
        "odometry",
        "innovations of odometry, in σ",
        (("x", BLUE), ("y", GREEN), ("heading", GOLD), *BAND),
        (0, 1, 2, 3.0, -3.0),
    ),
    Plot(
        "Innovations",
        "imu",
        "innovations of the IMU, in σ",
        (("gyro", GOLD), ("ax", BLUE), ("ay", GREEN), *BAND),
        (0, 1, 2, 3.0, -3.0),
    ),
    Plot(
        "Innovations",
        "nis",
        "normalised innovation squared, with the 95 % limit",
        (("odometry", BLUE), ("IMU", RED), ("limit", GREY)),
        (0, 1, 7.815),
    ),
    Plot(
        "Innovations",
        "bias",
        "biases [mrad/s, mm/s²]",
        (("gyro", GOLD), ("ax", BLUE), ("ay", GREEN)),
        (0, 1, 2),
    ),
    Plot(
        "Forces, loops",
        "force",
        "force [N]: of the pen, or of the left and the right palm",
        (("measured, left", BLUE), ("wanted, right", GREY), ("true", GREEN)),
        (0, 1, 2),
    ),
    Plot(
        "Forces, loops",
        "lateness",
        "lateness of the loops, 99th percentile [ms]",
        tuple(zip(SERVICES, (RED, BLUE, GREEN, GOLD), strict=True)),
        tuple(range(len(SERVICES))),
    ),
)


class Plots:
    """The plots' panel.

    Args:
        gui: of viser.
    """

    def __init__(self, gui: Any) -> None:
        self._panel = gui.add_panel()
        self._drawn: list[tuple[Plot, Any]] = []
        self._next = 0.0
        self._frozen: float | None = None
        for tab in dict.fromkeys(plot.tab for plot in PLOTS):
            with self._panel.add_tab(tab):
                for plot in PLOTS:
                    if plot.tab == tab:
                        self._drawn.append((plot, _add(gui, plot)))
        with self._panel.add_tab("Time"):
            self._pause = gui.add_checkbox("pause", False, hint="hold the plots as they are")
            self._back = gui.add_slider("seconds back", 0.0, BACK, 0.5, 0.0)
            self._width = gui.add_slider("seconds shown", 2.0, 15.0, 1.0, 10.0)
        self._panel.dock_right()
        self._panel.set_width(400)

    def show(self, feed: Feed, now: float) -> None:
        """Draw the window, if it is time to.

        Args:
            feed: what was heard.
            now: local time [s].
        """
        if now < self._next:
            return
        self._next = now + PERIOD
        if not self._pause.value:
            self._frozen = None
        elif self._frozen is None or self._frozen > feed.t:
            self._frozen = feed.t
        newest = feed.t if self._frozen is None else self._frozen
        end = newest - self._back.value
        for plot, handle in self._drawn:
            time, *values = feed.tracks[plot.track].window(end - self._width.value, end + 1e-6)
            chosen = (
                values[c] if isinstance(c, int) else np.full_like(time, c) for c in plot.columns
            )
            handle.data = (time, *chosen)


def _add(gui: Any, plot: Plot) -> Any:
    series: list[dict[str, Any]] = [{"label": "t"}]
    for name, colour in plot.lines:
        line: dict[str, Any] = {"label": name, "stroke": colour, "width": 1.5, "spanGaps": False}
        if name.endswith("σ") or name == "limit":
            line |= {"dash": (6, 4), "width": 1}
        series.append({**line, "points": {"show": False}})
    nothing = np.array([0.0, 1.0])
    return gui.add_uplot(
        (nothing, *(np.full(2, np.nan) for _ in plot.lines)),
        tuple(series),
        title=plot.title,
        scales={"x": {"time": False}},
        height=210,
    )
