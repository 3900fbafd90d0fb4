"""``LIKE``: a node that takes over what another one says."""

from __future__ import annotations

from collections.abc import Container, Mapping
from dataclasses import replace

from arm.hds.guards import check_order, replaces
from arm.hds.names import hint
from arm.hds.nodecheck import NodeCheck
from arm.hds.nodetype import NodeType
from arm.hds.scope import Scope
from arm.hds.syntax import Block, Name, Number, Span, Value
from arm.hds.values import check_value


def derivation(
    block: Block, named: Mapping[str, Block], done: Container[int], scope: Scope
) -> list[Block]:
    """The nodes a node builds on that are not done yet, first of all the one that builds on none.

    The node itself comes last. A node that is not there and a way that leads round in a circle
    are reported; the list then begins with a node that has nothing to build on.

    Args:
        block: the node.
        named: nodes by name.
        done: identities of the nodes that have been checked.
        scope: where findings go, and whether there may be more nodes than are known.
    """
    chain: list[Block] = []
    while id(block) not in done:
        chain.append(block)
        if not block.likes:
            break
        like = block.likes[0]
        parent = named.get(like.text)
        if parent is None:
            _unknown(like, block, named, scope)
            break
        if any(parent is each for each in chain):
            _circle(chain[[id(each) for each in chain].index(id(parent)) :], scope)
            break
        block = parent
    return chain[::-1]


def _unknown(like: Name, block: Block, named: Mapping[str, Block], scope: Scope) -> None:
    if not scope.partial:
        message = f"there is no node '{like.text}' to be like"
        others = [name for name, other in named.items() if other is not block]
        scope.report.error("unknown-like", message, like.span, hint(like.text, others))


def _circle(circle: list[Block], scope: Scope) -> None:
    names = [block.names[0].text for block in circle]
    message = f"nothing is said of a node that is like itself: {' -> '.join([*names, names[0]])}"
    help = "give one of them a TYPE and its own parameters instead of LIKE"
    scope.report.error("like-cycle", message, circle[0].likes[0].span, help)


def take_over(made: NodeCheck, parent: NodeCheck, scope: Scope) -> None:
    """Add to a node what it is ``LIKE`` and does not set again.

    What is wrong in the other node has been reported there. With another ``TYPE``, what that type
    does not have is left out, and a value it does not take is reported at the ``LIKE``.
    """
    node_type = made.type
    if node_type is None or parent.type is None:
        return
    made.given |= {name for name in parent.given if node_type.parameter(name)}
    _take_settings(made, parent, node_type, scope)
    for event, target in parent.transitions.items():
        if node_type.event(event) and not node_type.terminal:
            made.transitions.setdefault(event, target)
    own = [guard for guard, _ in made.guards]
    for guard, place in parent.guards:
        known = node_type.quantity(guard.quantity) == parent.type.quantity(guard.quantity)
        if known and not node_type.terminal and not any(replaces(g, guard) for g in own):
            made.guards.append((guard, place))
    check_order(made.guards, len(own), scope.report)


def _take_settings(made: NodeCheck, parent: NodeCheck, node_type: NodeType, scope: Scope) -> None:
    same = parent.type is not None and node_type.name == parent.type.name
    for name, setting in parent.settings.items():
        parameter = node_type.parameter(name)
        if parameter is None or name in made.settings:
            continue
        made.settings[name] = setting
        if name not in parent.values:
            continue
        if same:
            made.values[name] = parent.values[name]
            continue
        moved = _moved(setting.value, made.block.likes[0].span)
        value = check_value(parameter, moved, scope.constants, scope.report)
        if value is not None:
            made.values[name] = value


def _moved(value: Value, place: Span) -> Value:
    """The value as if written at a place."""
    if isinstance(value, Number) and value.unit is not None:
        return replace(value, span=place, unit=Name(value.unit.text, place))
    return replace(value, span=place)
