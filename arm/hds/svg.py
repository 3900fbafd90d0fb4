"""A program as SVG: one text, no script, nothing loaded from elsewhere.

Every node is a group with the class ``node`` and the attribute ``data-node``; a page that shows
the picture live moves the class ``current`` from one to another.
"""

from __future__ import annotations

from collections.abc import Iterable
from xml.sax.saxutils import escape, quoteattr

from arm.hds.arrange import draw
from arm.hds.drawing import LINE, LOOP, NAME, PAD, START, TEXT, TITLE, TITLE_X, Placed, Route
from arm.hds.finding import Finding
from arm.hds.nodetype import Registry
from arm.hds.placing import finding_lines
from arm.hds.program import END, Program
from arm.hds.sketch import Arrow, Sketch, sketch

STYLE = f"""
text {{ font: {TEXT}px "DejaVu Sans", Verdana, Arial, sans-serif; fill: #222; }}
.title {{ font-size: {TITLE:g}px; fill: #555; }}
.name {{ font-size: {NAME}px; font-weight: bold; }}
.type {{ fill: #555; font-style: italic; }}
.bad {{ fill: #c00000; }}
.node rect {{ fill: #f6f8fb; stroke: #44546a; stroke-width: 1.3; }}
.node rect.inner {{ fill: none; stroke-width: 1; }}
.node.current rect {{ fill: #ffe9a8; stroke: #b07500; stroke-width: 2.6; }}
.node.error rect {{ stroke: #c00000; stroke-width: 2.4; fill: #fff1f0; }}
.node.warning rect {{ stroke: #c00000; stroke-dasharray: 6 3; stroke-width: 1.8; }}
.flag rect {{ fill: #eef1f4; stroke: #8795a6; }}
.flag.end rect {{ fill: #fff; stroke: #222; }}
.edge path {{ fill: none; stroke: #5a6b80; stroke-width: 1.3; stroke-linejoin: round; }}
.edge path.head {{ fill: #5a6b80; stroke: none; }}
.edge.bad path {{ stroke: #c00000; }}
.edge.bad path.head {{ fill: #c00000; stroke: none; }}
.edge.faint path {{ stroke-dasharray: 2 4; stroke: #9aa5b1; }}
.label rect {{ fill: #fff; }}
.label.faint text {{ fill: #8a94a0; text-decoration: line-through; }}
.guard {{ font-style: italic; fill: #1f5c99; }}
.label.bad text {{ fill: #c00000; }}
.start {{ fill: #222; stroke: #222; stroke-width: 1.3; }}
"""


def svg(
    program: Program,
    types: Registry,
    current: str | None = None,
    findings: Iterable[Finding] = (),
) -> str:
    """The picture of a checked program.

    Args:
        program: the program.
        types: the node types it was checked with.
        current: name of the node to show as the current one.
        findings: what to mark in red besides the program's own warnings.
    """
    return render(sketch(program, types, findings), current)


def render(picture: Sketch, current: str | None = None) -> str:
    """The picture of a sketch."""
    drawing = draw(picture)
    width, height = drawing.width, drawing.height
    out = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0f}" height="{height:.0f}" '
        f'viewBox="0 0 {width:.0f} {height:.0f}">',
        f"<title>{escape(drawing.title)}</title>",
        f"<style>{STYLE}</style>",
        f'<rect width="{width:.0f}" height="{height:.0f}" fill="#fff"/>',
        f'<text class="title" x="{TITLE_X:g}" y="26">{escape(drawing.title)}</text>',
    ]
    out += [_route(route) for route in drawing.routes]
    out += [_label(placed) for placed in drawing.labels]
    loops = {loop.source: loop for loop in drawing.loops}
    for placed in drawing.boxes:
        assert placed.box is not None
        out += _node(placed, placed.box.name == current, loops.get(placed.box.name))
    out += [_flag(placed, current) for placed in drawing.flags]
    return "\n".join([*out, "</svg>"]) + "\n"


def _rect(x: float, y: float, w: float, h: float, radius: float, extra: str = "") -> str:
    return f'<rect x="{x:.1f}" y="{y:.1f}" width="{w:.1f}" height="{h:.1f}" rx="{radius}"{extra}/>'


def _text(x: float, y: float, text: str, style: str = "") -> str:
    kind = f' class="{style}"' if style else ""
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="middle"{kind}>{escape(text)}</text>'


def _head(x: float, y: float, dx: float, dy: float) -> str:
    """An arrow's head with its tip at ``(x, y)``, pointing along ``(dx, dy)`` of length 1."""
    bx, by = x - 8 * dx, y - 8 * dy
    return (
        f'<path class="head" d="M{x:.1f},{y:.1f} L{bx - 3.5 * dy:.1f},{by + 3.5 * dx:.1f} '
        f'L{bx + 3.5 * dy:.1f},{by - 3.5 * dx:.1f} Z"/>'
    )


def path_data(route: Route) -> str:
    """The line of a route as SVG path data."""
    parts, before = [], (0.0, 0.0)
    for kind, x, y in route.path:
        if kind == "S":
            middle = (before[1] + y) / 2
            parts.append(f"C{before[0]:.1f},{middle:.1f} {x:.1f},{middle:.1f} {x:.1f},{y:.1f}")
        else:
            parts.append(f"{kind}{x:.1f},{y:.1f}")
        before = (x, y)
    return " ".join(parts)


def _style(line: str) -> str:
    """Guards look other than events."""
    return "guard" if "<" in line or ">" in line else ""


def _classes(arrow: Arrow) -> str:
    return (" bad" if arrow.findings else "") + (" faint" if arrow.faint else "")


def _route(route: Route) -> str:
    _, x, y = route.path[-1]
    down = -1.0 if route.up else 1.0
    arrow = route.arrow
    title = f"{arrow.source} to {arrow.target}: {', '.join(arrow.lines)}"
    return (
        f'<g class="edge{_classes(arrow)}"><title>{escape(title)}</title>'
        f'<path d="{path_data(route)}"/>{_head(x, y, 0.0, down)}</g>'
    )


def _label(placed: Placed) -> str:
    arrow = placed.label
    assert arrow is not None
    lines = [
        _text(placed.x + placed.width / 2, placed.y + LINE * (i + 1) - 3, line, _style(line))
        for i, line in enumerate(arrow.lines)
    ]
    rect = _rect(placed.x, placed.y, placed.width, placed.height, 2)
    return f'<g class="label{_classes(arrow)}">{rect}{"".join(lines)}</g>'


def _node(placed: Placed, current: bool, loop: Arrow | None) -> list[str]:
    box = placed.box
    assert box is not None
    x, y, w, h = placed.x, placed.y, placed.width, placed.height
    kind = "node" + (" current" if current else "") + (f" {box.severity}" if box.severity else "")
    told = "\n".join([f"{box.name}: {box.type}", *(f.message for f in box.findings)])
    out = [f'<g class="{kind}" data-node={quoteattr(box.name)}><title>{escape(told)}</title>']
    out.append(_rect(x, y, w, h, 7))
    if box.terminal:
        out.append(_rect(x + 3, y + 3, w - 6, h - 6, 5, ' class="inner"'))
    line = y + PAD + NAME - 2
    out.append(_text(x + w / 2, line, box.name, "name"))
    shown = [(box.type, "type"), *((text, "") for text in box.lines)]
    for text, style in [*shown, *((text, "bad") for text in finding_lines(box))]:
        if text:
            line += LINE
            out.append(_text(x + w / 2, line, text, style))
    if box.initial:
        middle = y + h / 2
        out.append(f'<circle class="start" cx="{x - START + 7:.1f}" cy="{middle:.1f}" r="5.5"/>')
        out.append(f'<path class="start" d="M{x - START + 12:.1f},{middle:.1f} H{x - 6:.1f}"/>')
        out.append(f'<g class="edge">{_head(x, middle, 1.0, 0.0)}</g>')
    if loop is not None:
        out.append(_loop(placed, loop))
    return [*out, "</g>"]


def _loop(placed: Placed, loop: Arrow) -> str:
    """An arrow from a node to itself, on the right."""
    x, middle = placed.x + placed.width, placed.y + placed.height / 2
    top, bottom = middle - 11, middle + 11
    start = middle - LINE * (len(loop.lines) - 1) / 2 + 4
    lines = [
        f'<text x="{x + LOOP:.1f}" y="{start + LINE * i:.1f}" class="{_style(line)}">'
        f"{escape(line)}</text>"
        for i, line in enumerate(loop.lines)
    ]
    curve = f"M{x:.1f},{top:.1f} C{x + 26:.1f},{top - 8:.1f} {x + 26:.1f},{bottom + 8:.1f} "
    return (
        f'<g class="edge{_classes(loop)}"><path d="{curve}{x + 4:.1f},{bottom:.1f}"/>'
        f'{_head(x, bottom, -1.0, 0.0)}</g><g class="label">{"".join(lines)}</g>'
    )


def _flag(placed: Placed, current: str | None) -> str:
    x, y, w, h = placed.x, placed.y, placed.width, placed.height
    end = placed.flag == END.name
    inner = _rect(x + 2.5, y + 2.5, w - 5, h - 5, (h - 5) / 2) if end else ""
    shown = ' class="node current"' if end and current == END.name else ""
    text = _text(x + w / 2, y + h / 2 + 4, placed.flag)
    return (
        f'<g class="flag{" end" if end else ""}"><g{shown}>{_rect(x, y, w, h, h / 2)}{inner}</g>'
        f"{text}</g>"
    )
