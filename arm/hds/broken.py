"""The sketch of a program that is refused: what could be read of it, with what is wrong in red."""

from __future__ import annotations

from collections.abc import Sequence

from arm.hds.finding import Finding, Report
from arm.hds.include import Includes
from arm.hds.parser import parse
from arm.hds.program import END
from arm.hds.sketch import SHOWN, Arrow, Box, Sketch
from arm.hds.syntax import Block, Number, Source, Span, Value


def broken_sketch(text: str, filename: str, findings: Sequence[Finding]) -> Sketch:
    """What to show of a program with errors; only its syntax is looked at.

    Args:
        text: the source.
        filename: what findings call it; included files are looked for relative to it.
        findings: what the check said.
    """
    report = Report(text, filename)
    source = parse(text.removeprefix("\ufeff"), report)
    Includes(report).merge(source)
    named: dict[str, Block] = {}
    for number, block in enumerate(source.blocks):
        name = block.names[0].text if block.names else f"(node without name, {number + 1})"
        named[name if name not in named else f"{name} (again, line {block.span.line})"] = block
    initial = source.initials[0].text if source.initials else ""
    owned = {name: _within(block, source, filename, findings) for name, block in named.items()}
    arrows = [a for name, block in named.items() for a in _arrows(name, block, named, owned[name])]
    on_arrows = {id(f) for arrow in arrows for f in arrow.findings}
    boxes = []
    for name, block in named.items():
        left = [f for f in owned[name] if id(f) not in on_arrows or f.severity == "error"]
        boxes.append(_box(name, block, name == initial, left))
    targets = dict.fromkeys([*(arrow.target for arrow in arrows), *([initial] if initial else [])])
    for target in targets:
        if target not in named:
            missing = tuple(f for f in findings if f"'{target}'" in f.message)
            box = Box(target, "" if target == END.name else "not declared")
            if target != END.name:
                box = Box(target, "not declared", (), target == initial, False, missing)
            boxes.append(box)
    errors = sum(finding.severity == "error" for finding in findings)
    title = filename.replace("\\", "/").rpartition("/")[2]
    noun = "error" if errors == 1 else "errors"
    return Sketch(f"{title}: {errors} {noun}; does not run", tuple(boxes), tuple(arrows))


def _box(name: str, block: Block, initial: bool, findings: Sequence[Finding]) -> Box:
    lines = [f"{p.name.text} = {_written(p.value)}" for p in block.parameters]
    if len(lines) > SHOWN:
        lines = [*lines[: SHOWN - 1], f"... {len(lines) - SHOWN + 1} more"]
    kind = block.types[0].text if block.types else ""
    if not kind and block.likes:
        kind = f"like {block.likes[0].text}"
    return Box(name, kind, tuple(lines), initial, kind == END.type, tuple(findings))


def _written(value: Value) -> str:
    if isinstance(value, Number) and value.unit is not None:
        return f"{value.text} {value.unit.text}"
    return value.text


def _arrows(
    name: str, block: Block, named: dict[str, Block], findings: Sequence[Finding]
) -> list[Arrow]:
    ways: dict[str, list[tuple[str, Span | None]]] = {}
    labels: set[str] = set()
    seen: list[Block] = []
    while block not in seen:  # LIKE may lead round in a circle
        own = not seen
        seen.append(block)
        for t in block.transitions:
            if t.event.text not in labels or own:
                labels.add(t.event.text)
                ways.setdefault(t.target.text, []).append((t.event.text, t.event.span))
        for g in block.guards:
            text = f"{g.quantity.text} {g.operator} {_written(g.limit)}"
            if text not in labels or own:
                labels.add(text)
                ways.setdefault(g.target.text, []).append((text, g.quantity.span))
        parent = named.get(block.likes[0].text) if block.likes else None
        block = parent if parent is not None else block
    made = []
    for target, written in ways.items():
        spots = {(span.line, span.file) for _, span in written if span is not None}
        bad = tuple(f for f in findings if any(f.line == line for line, _ in spots))
        made.append(Arrow(name, target, tuple(label for label, _ in written), bad))
    return made


def _within(
    block: Block, source: Source, filename: str, findings: Sequence[Finding]
) -> list[Finding]:
    """The findings between a node's BEGIN and the next one's in the same file."""
    lines = [b.span.line for b in source.blocks if b.span.file == block.span.file]
    after = min((line for line in lines if line > block.span.line), default=10**9)
    file = block.span.file or filename
    return [f for f in findings if f.file == file and block.span.line <= f.line < after]
