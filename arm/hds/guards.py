"""Guards of one node: what they compare, with what, and which of them can never fire."""

from __future__ import annotations

from arm.hds.finding import Report
from arm.hds.names import hint
from arm.hds.nodetype import NodeType, Parameter
from arm.hds.program import Guard, Operator
from arm.hds.scope import Scope
from arm.hds.syntax import Guarded, Number, Span, Value
from arm.hds.values import check_value

_OPERATORS: dict[str, Operator] = {">": ">", "<": "<", ">=": ">=", "<=": "<="}


def check_guard(guarded: Guarded, node_type: NodeType, scope: Scope) -> Guard | None:
    """One guard against the quantities of its node's type; None, with a finding, if it is wrong."""
    name, report = guarded.quantity, scope.report
    known = scope.knows_target(guarded.target)
    if node_type.terminal:
        message = f"the program ends in a node of type '{node_type.name}'; nothing follows it"
        report.error("terminal-transition", message, name.span)
        return None
    quantity = node_type.quantity(name.text)
    if quantity is None:
        message = f"type '{node_type.name}' has no quantity '{name.text}' to look at"
        help = hint(name.text, [q.name for q in node_type.offers], "valid quantities")
        if node_type.event(name.text):
            help = f"'{name.text}' is an event: TRANSITION[{name.text}] = ...;"
        report.error("unknown-quantity", message, name.span, help)
        return None
    parameter = Parameter(quantity.name, quantity.unit)
    limit = check_value(parameter, guarded.limit, scope.constants, report)
    if limit is None or not known:
        return None
    return Guard(
        quantity.name,
        _OPERATORS[guarded.operator],
        float(limit),
        guarded.target.text,
        f"{quantity.name} {guarded.operator} {_written(guarded.limit, quantity.unit)}",
        report.name(name.span),
        name.span.line,
        name.span.column,
    )


def check_order(placed: list[tuple[Guard, Span]], own: int, report: Report) -> None:
    """Warn of guards that never fire because one before them does, and of nodes left at once.

    Args:
        placed: the guards that are right, in order, and where they are written.
        own: how many of them the node itself writes; the others were taken over and looked at
            where they are written.
        report: where findings go.
    """
    for i, (guard, place) in enumerate(placed):
        for j, (earlier, earlier_place) in enumerate(placed[:i]):
            if j >= own:
                break
            at = place if i < own else earlier_place
            if implies(guard, earlier):
                message = f"'{guard.text}' never fires: '{earlier.text}' holds before it does"
                help = f"put it before '{earlier.text}', or change its limit"
                report.warning("shadowed-guard", message, at, help)
                break
            if _cover(guard, earlier):
                message = f"'{earlier.text}' or '{guard.text}' always holds: the node ends at once"
                report.warning("contradictory-guards", message, at, "leave a gap between them")
                break


def replaces(guard: Guard, other: Guard) -> bool:
    """Whether a guard a node writes stands for one it takes over: same quantity, same side."""
    return guard.quantity == other.quantity and guard.operator[0] == other.operator[0]


def implies(guard: Guard, other: Guard) -> bool:
    """Whether ``other`` holds whenever ``guard`` does."""
    if not replaces(guard, other):
        return False
    if guard.limit == other.limit:
        return guard.operator == other.operator or other.operator.endswith("=")
    return (guard.limit > other.limit) == (guard.operator[0] == ">")


def _cover(one: Guard, other: Guard) -> bool:
    """Whether one of two guards holds whatever the value is."""
    if one.quantity != other.quantity or replaces(one, other):
        return False
    above, below = (one, other) if one.operator[0] == ">" else (other, one)
    touching = above.operator.endswith("=") or below.operator.endswith("=")
    return above.limit < below.limit or (above.limit == below.limit and touching)


def _written(limit: Value, unit: str) -> str:
    """The limit as a person reads it: with its unit, a constant by its name."""
    if not isinstance(limit, Number):
        return limit.text
    written = limit.unit.text if limit.unit else unit
    return limit.text if written == "1" else f"{limit.text} {written}"
