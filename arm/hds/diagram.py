"""A sketch in the languages other tools draw: Graphviz DOT and Mermaid."""

from __future__ import annotations

from arm.hds.placing import finding_lines
from arm.hds.program import END
from arm.hds.sketch import Box, Sketch

_RED = "#c00000"


def dot(sketch: Sketch, current: str | None = None) -> str:
    """Graphviz DOT."""
    lines = [
        "digraph program {",
        f'  label="{_quoted(sketch.title)}"; labelloc=t;',
        '  node [shape=box, style="rounded,filled", fillcolor="#f6f8fb"];',
        "  __start [shape=point, width=0.15];",
    ]
    for box in sketch.boxes:
        text = "\\n".join(_quoted(line) for line in _lines(box))
        more = ", peripheries=2" if box.terminal else ""
        if box.severity:
            more += f', color="{_RED}"'
        if box.name == current:
            more += ', fillcolor="#ffe9a8"'
        lines.append(f'  "{_quoted(box.name)}" [label="{text}"{more}];')
        if box.initial:
            lines.append(f'  __start -> "{_quoted(box.name)}";')
    for arrow in sketch.arrows:
        text = "\\n".join(_quoted(line) for line in arrow.lines)
        more = f', color="{_RED}"' if arrow.findings else ""
        more += ", style=dotted" if arrow.faint else ""
        ends = f'"{_quoted(arrow.source)}" -> "{_quoted(arrow.target)}"'
        lines.append(f'  {ends} [label="{text}"{more}];')
    return "\n".join([*lines, "}"]) + "\n"


def mermaid(sketch: Sketch, current: str | None = None) -> str:
    """Mermaid, a flowchart from top to bottom."""
    number = {box.name: f"n{i}" for i, box in enumerate(sketch.boxes)}
    lines = ["---", f"title: {_entities(sketch.title)}", "---", "flowchart TB"]
    for box in sketch.boxes:
        text = "<br/>".join(_entities(line) for line in _lines(box))
        opening, closing = ('(["', '"])') if box.terminal else ('["', '"]')
        lines.append(f"  {number[box.name]}{opening}{text}{closing}")
        if box.initial:
            lines.append(f'  start(("&nbsp;")) --> {number[box.name]}')
    for arrow in sketch.arrows:
        text = "<br/>".join(_entities(line) for line in arrow.lines)
        stroke = "-.->" if arrow.faint else "-->"
        ends = number[arrow.source], number[arrow.target]
        lines.append(f'  {ends[0]} {stroke}|"{text}"| {ends[1]}')
    for name, style in (
        ("bad", [b for b in sketch.boxes if b.severity]),
        ("current", [b for b in sketch.boxes if b.name == current]),
    ):
        if style:
            lines.append(f"  class {','.join(number[b.name] for b in style)} {name}")
    lines.append(f"  classDef bad stroke:{_RED},stroke-width:2px")
    lines.append("  classDef current fill:#ffe9a8")
    return "\n".join(lines) + "\n"


def _lines(box: Box) -> list[str]:
    kind = [box.type] if box.type and box.name != END.name else []
    return [box.name, *kind, *box.lines, *finding_lines(box)]


def _quoted(text: str) -> str:
    return text.replace("\\", "\\\\").replace('"', '\\"')


def _entities(text: str) -> str:
    return (
        text.replace("&", "&amp;").replace('"', "#quot;").replace("<", "&lt;").replace(">", "&gt;")
    )
