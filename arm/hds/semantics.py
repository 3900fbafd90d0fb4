"""What every single node says, against the node types: names, parameters, events."""

from __future__ import annotations

from arm.hds.finding import Report
from arm.hds.guards import check_guard, check_order
from arm.hds.names import hint, listing, nearest
from arm.hds.nodecheck import NodeCheck
from arm.hds.nodetype import NodeType
from arm.hds.parser import KEYWORDS
from arm.hds.program import ABORT, END
from arm.hds.reuse import derivation, take_over
from arm.hds.scope import Scope
from arm.hds.syntax import Block, Name, Source
from arm.hds.values import check_value


def only(names: list[Name], keyword: str, report: Report) -> Name | None:
    """The first of the names a keyword was given; every other one is an error."""
    for again in names[1:]:
        message = f"{keyword} is given twice, first on line {names[0].span.line}"
        report.error("duplicate-statement", message, again.span)
    return names[0] if names else None


def check_nodes(source: Source, named: dict[str, Block], scope: Scope) -> list[NodeCheck]:
    """Check every node, those that others are ``LIKE`` before those; in the order of the source."""
    done: dict[int, NodeCheck] = {}
    for block in source.blocks:
        for each in derivation(block, named, done, scope):
            parent = named.get(each.likes[0].text) if each.likes else None
            done[id(each)] = check_node(each, done.get(id(parent)), scope)
    return [done[id(block)] for block in source.blocks]


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
            first = blocks[name.text].place
            where = "" if first.file == name.span.file else f" of {report.name(first)}"
            message = f"a node called '{name.text}' is already declared on line {first.line}{where}"
            report.error("duplicate-node", message, name.span)
        else:
            blocks[name.text] = block
    return blocks


def check_node(block: Block, parent: NodeCheck | None, scope: Scope) -> NodeCheck:
    """Check one node against its type.

    Args:
        block: the node as written.
        parent: the node it is ``LIKE``, checked; None if it is like none, or that one is unknown.
        scope: types, nodes and constants there are.
    """
    report = scope.report
    written = only(block.types, "TYPE", report)
    only(block.likes, "LIKE", report)
    node_type = None
    if written is not None:
        node_type = scope.types.get(written.text)
        if node_type is None:
            message = f"there is no node type '{written.text}'"
            report.error("unknown-type", message, written.span, hint(written.text, scope.types))
    elif parent is not None:
        node_type = parent.type
    elif not block.damaged and not block.likes:
        report.error("missing-type", "this node has no TYPE", block.place, listing(scope.types))

    made = NodeCheck(block, node_type)
    missing_parent = bool(block.likes) and parent is None
    damaged = block.damaged or missing_parent or (parent is not None and not parent.certain)
    _parameters(made, scope)
    _transitions(made, scope)
    _guards(made, scope)
    if parent is not None:
        take_over(made, parent, scope)
    if node_type is not None:
        _impossible(made, node_type, report, damaged)
    made.certain = node_type is not None and not damaged
    made.certain = made.certain and all(t in scope.targets for t in made.transitions.values())
    if node_type is not None and not damaged:
        made.certain &= _absent(made, node_type, report)
    return made


def _parameters(made: NodeCheck, scope: Scope) -> None:
    """Check the values the node sets itself."""
    report, node_type = scope.report, made.type
    for assignment in made.block.parameters:
        name, place = assignment.name.text, assignment.name.span
        if name in made.settings:
            message = f"'{name}' is already set on line {made.settings[name].name.span.line}"
            report.error("duplicate-parameter", message, place)
            continue
        made.settings[name] = assignment
        made.given.add(name)
        if node_type is None:
            scope.constants.resolve(assignment.value)  # it is used, whatever for
            continue
        parameter = node_type.parameter(name)
        if parameter is None:
            scope.constants.resolve(assignment.value)
            valid = [p.name for p in node_type.parameters]
            meant = nearest(name, valid)
            if meant is not None:
                made.given.add(meant)  # one slip, one finding: not missing as well
            keyword = nearest(name, KEYWORDS, 0.75) if meant is None else None
            help = f"did you mean '{keyword}'?" if keyword else hint(name, valid)
            message = f"type '{node_type.name}' has no parameter '{name}'"
            report.error("unknown-parameter", message, place, help)
            continue
        value = check_value(parameter, assignment.value, scope.constants, report)
        if value is not None:
            made.values[name] = value


def _transitions(made: NodeCheck, scope: Scope) -> None:
    """Check the transitions on events the node writes itself."""
    report, node_type = scope.report, made.type
    lines: dict[str, int] = {}
    for transition in made.block.transitions:
        event, target = transition.event, transition.target
        scope.knows_target(target)
        if event.text in lines:
            message = f"a transition for '{event.text}' is already on line {lines[event.text]}"
            report.error("duplicate-transition", message, event.span)
            continue
        lines[event.text] = event.span.line
        made.transitions[event.text] = target.text
        if node_type is None:
            continue
        if node_type.terminal and event.text != ABORT:
            message = f"the program ends in a node of type '{node_type.name}'; nothing follows it"
            report.error("terminal-transition", message, event.span)
        elif node_type.event(event.text) is None:
            message = f"type '{node_type.name}' cannot raise '{event.text}'"
            valid = [e.name for e in node_type.events]
            help = hint(event.text, valid, "valid events")
            if event.text == ABORT:
                help = f"ABORT = {target.text}; in the header holds for every node"
            elif node_type.quantity(event.text):
                help = f"'{event.text}' is a quantity: TRANSITION[{event.text} > ...] = ...;"
            report.error("unknown-event", message, event.span, help)
            meant = nearest(event.text, valid)
            if meant is not None:
                made.transitions.setdefault(meant, target.text)  # one slip, one finding


def _guards(made: NodeCheck, scope: Scope) -> None:
    """Check the guards the node writes itself."""
    for guarded in made.block.guards:
        if made.type is None:
            scope.knows_target(guarded.target)
            scope.constants.resolve(guarded.limit)
            continue
        guard = check_guard(guarded, made.type, scope)
        if guard is not None:
            made.guards.append((guard, guarded.quantity.span))
    check_order(made.guards, len(made.guards), scope.report)


def _impossible(made: NodeCheck, node_type: NodeType, report: Report, damaged: bool) -> None:
    """Find the transitions on events that need a parameter the node does not have."""
    places = {t.event.text: t.event.span for t in made.block.transitions}
    for name in made.transitions:
        event = node_type.event(name)
        if event is None or event.needs is None or event.needs in made.given or damaged:
            continue
        made.impossible.add(name)
        if name in places:
            message = f"'{name}' never happens: '{event.needs}' is not set"
            help = f"set {event.needs} = ...; in this node"
            report.warning("impossible-event", message, places[name], help)


def _absent(made: NodeCheck, node_type: NodeType, report: Report) -> bool:
    """Report parameters and transitions the node lacks; whether it handles all its events."""
    place = made.block.place
    for parameter in node_type.parameters:
        lacking = parameter.default is None and parameter.name not in made.values
        if lacking and parameter.name not in made.given:
            message = f"type '{node_type.name}' needs the parameter '{parameter.name}'"
            unit = "" if parameter.unit == "1" else f" {parameter.unit}"
            help = f"add {parameter.name} = ...{unit};" + (
                f" % {parameter.doc}" if parameter.doc else ""
            )
            report.error("missing-parameter", message, place, help)
    handled = True
    for event in node_type.events:
        raised = event.needs is None or event.needs in made.given
        if raised and event.name not in made.transitions and not node_type.terminal:
            message = f"type '{node_type.name}' can raise '{event.name}', which nothing handles"
            report.error("unhandled-event", message, place, f"add TRANSITION[{event.name}] = ...;")
            handled = False
    return handled
