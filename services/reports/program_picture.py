"""A drawing of a program as PNG, by matplotlib."""

from __future__ import annotations

from pathlib import Path

from arm.hds.arrange import draw
from arm.hds.drawing import LINE, LOOP, NAME, PAD, START, TEXT, Placed, Route
from arm.hds.placing import finding_lines
from arm.hds.program import END
from arm.hds.sketch import Arrow, Sketch

DPI = 144
_RED, _EDGE = "#c00000", "#5a6b80"


def write_png(sketch: Sketch, file: Path, current: str | None = None) -> None:
    """Write the picture of a sketch; the same places and colours as the SVG.

    Raises:
        OSError: the file cannot be written.
    """
    from matplotlib.figure import Figure

    drawing = draw(sketch)
    figure = Figure(figsize=(drawing.width / 72, drawing.height / 72), dpi=DPI)
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set_xlim(0, drawing.width)
    axes.set_ylim(drawing.height, 0)
    axes.axis("off")
    pen = _Pen(axes)
    pen.text(20, 22, drawing.title, 12, "#555", align="left")
    for route in drawing.routes:
        pen.route(route)
    for placed in drawing.labels:
        assert placed.label is not None
        pen.box(placed, "#fff", "none", 0, 2)
        for i, line in enumerate(placed.label.lines):
            y = placed.y + LINE * (i + 0.5) + 1
            pen.text(placed.x + placed.width / 2, y, line, TEXT, _colour(placed.label, line))
    loops = {loop.source: loop for loop in drawing.loops}
    for placed in drawing.boxes:
        assert placed.box is not None
        pen.node(placed, placed.box.name == current, loops.get(placed.box.name))
    for placed in drawing.flags:
        end = placed.flag == END.name
        fill = "#ffe9a8" if end and current == END.name else "#fff" if end else "#eef1f4"
        pen.box(placed, fill, "#222" if end else "#8795a6", 2 if end else 1, placed.height / 2)
        middle = placed.x + placed.width / 2, placed.y + placed.height / 2
        pen.text(*middle, placed.flag, TEXT)
    figure.savefig(file, dpi=DPI)


def _colour(arrow: Arrow, line: str) -> str:
    if arrow.findings:
        return _RED
    if arrow.faint:
        return "#8a94a0"
    return "#1f5c99" if "<" in line or ">" in line else "#222"


class _Pen:
    """Draws on axes whose unit is a point."""

    def __init__(self, axes: object) -> None:
        self._axes: object = axes

    def text(
        self,
        x: float,
        y: float,
        text: str,
        size: float,
        colour: str = "#222",
        align: str = "center",
        **style: str,
    ) -> None:
        """One line, its middle at ``y``."""
        self._axes.text(  # type: ignore[attr-defined]
            x, y, text, size=size, color=colour, ha=align, va="center", parse_math=False, **style
        )

    def box(self, placed: Placed, fill: str, edge: str, width: float, radius: float) -> None:
        """A rectangle with round corners."""
        from matplotlib.patches import FancyBboxPatch

        patch = FancyBboxPatch(
            (placed.x + radius, placed.y + radius),
            placed.width - 2 * radius,
            placed.height - 2 * radius,
            boxstyle=f"round,pad={radius},rounding_size={radius}",
            facecolor=fill,
            edgecolor=edge,
            linewidth=width,
        )
        self._axes.add_patch(patch)  # type: ignore[attr-defined]

    def line(self, path: list[tuple[int, float, float]], colour: str, faint: bool) -> None:
        """A line of matplotlib's path codes."""
        from matplotlib.patches import PathPatch
        from matplotlib.path import Path as Line

        made = Line([(x, y) for _, x, y in path], [code for code, _, _ in path])
        style = ":" if faint else "-"
        patch = PathPatch(made, facecolor="none", edgecolor=colour, linewidth=1.3, linestyle=style)
        self._axes.add_patch(patch)  # type: ignore[attr-defined]

    def head(self, x: float, y: float, dx: float, dy: float, colour: str) -> None:
        """An arrow's head with its tip at ``(x, y)``."""
        bx, by = x - 8 * dx, y - 8 * dy
        self._axes.fill(  # type: ignore[attr-defined]
            [x, bx - 3.5 * dy, bx + 3.5 * dy], [y, by + 3.5 * dx, by - 3.5 * dx], color=colour, lw=0
        )

    def route(self, route: Route) -> None:
        """The line of an arrow and its head."""
        path: list[tuple[int, float, float]] = []
        bx, by = 0.0, 0.0
        for kind, x, y in route.path:
            if kind == "S":
                middle = (by + y) / 2
                path += [(4, bx, middle), (4, x, middle), (4, x, y)]
            else:
                path.append((1 if kind == "M" else 2, x, y))
            bx, by = x, y
        colour = _RED if route.arrow.findings else _EDGE
        self.line(path, colour, route.arrow.faint)
        self.head(bx, by, 0.0, -1.0 if route.up else 1.0, colour)

    def node(self, placed: Placed, current: bool, loop: Arrow | None) -> None:
        """A node with its text, its mark if it is the initial one, and its arrow to itself."""
        box = placed.box
        assert box is not None
        fill, edge, width = "#f6f8fb", "#44546a", 1.3
        if box.severity:
            fill, edge, width = "#fff1f0", _RED, 2.2
        if current:
            fill, edge, width = "#ffe9a8", "#b07500", 2.6
        self.box(placed, fill, edge, width * (2 if box.terminal else 1), 7)
        x, y = placed.x + placed.width / 2, placed.y + PAD / 2 + NAME / 2 + 2
        self.text(x, y, box.name, NAME, weight="bold")
        bad = [(line, _RED, "normal") for line in finding_lines(box)]
        shown = [(box.type, "#555", "italic"), *((line, "#222", "normal") for line in box.lines)]
        for text, colour, style in [*shown, *bad]:
            if text:
                y += LINE
                self.text(x, y, text, TEXT, colour, style=style)
        middle = placed.y + placed.height / 2
        if box.initial:
            left = placed.x - START + 7
            self._axes.plot([left], [middle], "o", color="#222", ms=9)  # type: ignore[attr-defined]
            self.line([(1, left, middle), (2, placed.x - 6, middle)], "#222", False)
            self.head(placed.x, middle, 1.0, 0.0, _EDGE)
        if loop is not None:
            right = placed.x + placed.width
            curve = [(1, right, middle - 11), (4, right + 26, middle - 19)]
            curve += [(4, right + 26, middle + 19), (4, right + 4, middle + 11)]
            colour = _RED if loop.findings else _EDGE
            self.line(curve, colour, loop.faint)
            self.head(right, middle + 11, -1.0, 0.0, colour)
            top = middle - LINE * (len(loop.lines) - 1) / 2
            for i, line in enumerate(loop.lines):
                at = right + LOOP, top + LINE * i
                self.text(*at, line, TEXT, _colour(loop, line), align="left")
