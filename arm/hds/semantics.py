"""What every single node says, against the node types: names, parameters, events."""

from __future__ import annotations

from collections.abc import Collection
from typing import NamedTuple

from arm.hds.finding import Report
from arm.hds.names import hint, listing, nearest
from arm.hds.nodetype import NodeType, ParameterValue, Registry
from arm.hds.parser import KEYWORDS
from arm.hds.program import END, Node
from arm.hds.syntax import Block, Name, Source
from arm.hds.values import check_value


def only(names: list[Name], keyword: str, report: Report) -> Name | None:
    """The first of the names a keyword was given; every other one is an error."""
    for again in names[1:]:
        message = f"{keyword} is given twice, first on line {names[0].span.line}"
        report.error("duplicate-statement", message, again.span)
    return names[0] if names else None


def node_names(source: Source, report: Report) -> dict[str, Block]:
    """Every node by its name, the first one where two have the same."""
    blocks: dict[str, Block] = {}
    for block in source.blocks:
        name = only(block.names, "NAME", report)
        if name is None:
            if not block.damaged:
                report.error("missing-name", "this node has no NAME", block.span, "add NAME = ...;")
        elif name.text == END.name:
            message = f"'{END.name}' is the predefined terminal node and cannot be declared"
            report.error("reserved-name", message, name.span)
        elif name.text in blocks:
            first = blocks[name.text].place.line
            message = f"a node called '{name.text}' is already declared on line {first}"
            report.error("duplicate-node", message, name.span)
        else:
            blocks[name.text] = block
    return blocks


class NodeCheck(NamedTuple):
    """What came of checking one node.

    Attributes:
        node: what can be made of it; complete if no error was reported.
        ways: nodes it can go to by events that can happen in it.
        certain: False if it may have more ways than could be read, so that nothing may be
            concluded from those it lacks.
    """

    node: Node
    ways: list[str]
    certain: bool


def check_node(
    block: Block, targets: Collection[str], types: Registry, report: Report
) -> NodeCheck:
    """Check one node against its type.

    Args:
        block: the node as written.
        targets: names a transition may go to.
        types: the node types there are.
        report: where findings go.
    """
    written = only(block.types, "TYPE", report)
    node_type = None
    if written is not None:
        node_type = types.get(written.text)
        if node_type is None:
            message = f"there is no node type '{written.text}'"
            report.error("unknown-type", message, written.span, hint(written.text, types))
    elif not block.damaged:
        report.error("missing-type", "this node has no TYPE", block.place, listing(types))

    parameters, given = _parameters(block, node_type, report)
    transitions, impossible = _transitions(block, node_type, given, targets, report)
    certain = node_type is not None and not block.damaged
    certain = certain and all(target in targets for target in transitions.values())
    if node_type is not None and not block.damaged:
        certain &= _absent(block, node_type, parameters, given, transitions, report)
    node = Node(
        name=block.names[0].text if block.names else "",
        type=written.text if written else "",
        parameters=parameters,
        transitions=transitions,
        terminal=node_type is not None and node_type.terminal,
        line=block.span.line,
    )
    ways = [target for event, target in transitions.items() if event not in impossible]
    return NodeCheck(node, ways, certain)


def _parameters(
    block: Block, node_type: NodeType | None, report: Report
) -> tuple[dict[str, ParameterValue], set[str]]:
    """Checked values with defaults filled in, and the names the node sets or means to set."""
    lines: dict[str, int] = {}
    slips: set[str] = set()
    values: dict[str, ParameterValue] = {}
    for assignment in block.parameters:
        name, place = assignment.name.text, assignment.name.span
        if name in lines:
            message = f"'{name}' is already set on line {lines[name]}"
            report.error("duplicate-parameter", message, place)
            continue
        lines[name] = place.line
        if node_type is None:
            continue
        parameter = node_type.parameter(name)
        if parameter is None:
            valid = [p.name for p in node_type.parameters]
            meant = nearest(name, valid)
            if meant is not None:
                slips.add(meant)  # one slip, one finding: not missing as well
            keyword = nearest(name, KEYWORDS, 0.75) if meant is None else None
            help = f"did you mean '{keyword}'?" if keyword else hint(name, valid)
            message = f"type '{node_type.name}' has no parameter '{name}'"
            report.error("unknown-parameter", message, place, help)
            continue
        value = check_value(parameter, assignment.value, report)
        if value is not None:
            values[name] = value
    if node_type is None:
        return values, slips | set(lines)
    filled = {
        p.name: values.get(p.name, p.default)
        for p in node_type.parameters
        if p.name in values or p.default is not None
    }
    return {name: v for name, v in filled.items() if v is not None}, slips | set(lines)


def _transitions(
    block: Block,
    node_type: NodeType | None,
    given: set[str],
    targets: Collection[str],
    report: Report,
) -> tuple[dict[str, str], set[str]]:
    """Event to target, and those events that cannot happen in this node."""
    lines: dict[str, int] = {}
    transitions: dict[str, str] = {}
    impossible: set[str] = set()
    for transition in block.transitions:
        event, target = transition.event, transition.target
        if target.text not in targets:
            message = f"there is no node '{target.text}' to go to"
            report.error("unknown-target", message, target.span, hint(target.text, targets))
        if event.text in lines:
            message = f"a transition for '{event.text}' is already on line {lines[event.text]}"
            report.error("duplicate-transition", message, event.span)
            continue
        lines[event.text] = event.span.line
        transitions[event.text] = target.text
        if node_type is None:
            continue
        declared = node_type.event(event.text)
        if declared is None:
            message = f"type '{node_type.name}' cannot raise '{event.text}'"
            valid = [e.name for e in node_type.events]
            help = hint(event.text, valid, "valid events")
            report.error("unknown-event", message, event.span, help)
            meant = nearest(event.text, valid)
            if meant is not None:
                transitions.setdefault(meant, target.text)  # one slip, one finding
        elif node_type.terminal:
            message = f"the program ends in a node of type '{node_type.name}'; nothing follows it"
            report.error("terminal-transition", message, event.span)
        elif declared.needs is not None and declared.needs not in given and not block.damaged:
            message = f"'{event.text}' never happens: '{declared.needs}' is not set"
            report.warning(
                "impossible-event", message, event.span, f"set {declared.needs} = ...; in this node"
            )
            impossible.add(event.text)
    return transitions, impossible


def _absent(
    block: Block,
    node_type: NodeType,
    parameters: dict[str, ParameterValue],
    given: set[str],
    transitions: dict[str, str],
    report: Report,
) -> bool:
    """Report parameters and transitions the node lacks; whether it handles all its events."""
    for parameter in node_type.parameters:
        if parameter.name not in parameters and parameter.name not in given:
            message = f"type '{node_type.name}' needs the parameter '{parameter.name}'"
            unit = "" if parameter.unit == "1" else f" {parameter.unit}"
            help = f"add {parameter.name} = ...{unit};" + (
                f" % {parameter.doc}" if parameter.doc else ""
            )
            report.error("missing-parameter", message, block.place, help)
    handled = True
    for event in node_type.events:
        raised = event.needs is None or event.needs in given
        if raised and event.name not in transitions and not node_type.terminal:
            message = f"type '{node_type.name}' can raise '{event.name}', which nothing handles"
            report.error(
                "unhandled-event", message, block.place, f"add TRANSITION[{event.name}] = ...;"
            )
            handled = False
    return handled
