"""A form for each kind of disturbance, made from the schema that also checks the request."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from services.console.model import Model
from sim.disturbance import KINDS
from sim.scenario import Scenario

Press = Callable[[Any, str, dict[str, Any]], None]
"""Browser, kind, options."""

STEPS = 100
HANDY, SHARE = 20.0, 0.2
"""A slider reaches so many times the default, or without one so much of what is allowed; the limits
of the schema are often far from any use."""


@dataclass(frozen=True)
class Option:
    """One option of a disturbance, as a control.

    Attributes:
        name: of the option.
        meaning: its documentation.
        choices: allowed words; empty for a number.
        low: smallest number; the request's own limit, or next to it where it must be exceeded.
        high: largest.
        start: what the control shows first.
        optional: may be left out.
    """

    name: str
    meaning: str
    choices: tuple[str, ...] = ()
    low: float = 0.0
    high: float = 1.0
    start: float | str = 0.0
    optional: bool = False


def options_of(kind: str) -> list[Option]:
    """The options of a kind, without ``kind`` itself and ``t``: it begins when asked for."""
    model = KINDS[kind]
    properties = model.model_json_schema()["properties"]
    return [
        _option(name, info, properties[name])
        for name, info in model.model_fields.items()
        if name not in ("kind", "t")
    ]


def _option(name: str, info: Any, schema: dict[str, Any]) -> Option:
    schema = {**schema, **schema.get("anyOf", [{}])[0]}
    default = None if info.is_required() else info.default
    meaning = info.description or ""
    if "enum" in schema:
        choices = tuple(map(str, schema["enum"]))
        optional = not info.is_required() and default is None
        return Option(name, meaning, choices, start=default or choices[0], optional=optional)
    low = float(schema.get("minimum", schema.get("exclusiveMinimum", 0.0)))
    high = float(schema.get("maximum", schema.get("exclusiveMaximum", 1.0)))
    start = 0.05 * high if default is None else float(default)
    if default is None:
        low, high = SHARE * low, SHARE * high
    elif default:
        high = min(high, HANDY * float(default))
    step = step_of(low, high)
    if "exclusiveMinimum" in schema:
        low += step
    return Option(name, meaning, (), low, high, round(start / step) * step)


def step_of(low: float, high: float) -> float:
    """A round step that divides a range into about a hundred."""
    return float(10.0 ** math.floor(math.log10((high - low) / STEPS) + 0.5))


class DisturbanceForms:
    """A folder for each kind.

    Args:
        gui: of viser, inside the container to add them to.
        model: of the robot: what can be pushed.
        scenario: whether there is a box.
        press: told of every press.
    """

    def __init__(self, gui: Any, model: Model, scenario: Scenario, press: Press) -> None:
        self._bodies = set(model.bodies) | ({"box"} if scenario.world.box is not None else set())
        for kind, described in KINDS.items():
            with gui.add_folder(kind, expand_by_default=kind == "push"):
                gui.add_markdown((described.__doc__ or "").strip().split("\n")[0])
                inputs = {o.name: self._control(gui, o) for o in options_of(kind)}
                button = gui.add_button(f"{kind} now", color="orange")

                def pressed(event: Any, kind: str = kind, inputs: dict[str, Any] = inputs) -> None:
                    values = {name: handle.value for name, handle in inputs.items()}
                    press(event.client, kind, {k: v for k, v in values.items() if v != DEFAULT})

                button.on_click(pressed)

    def _control(self, gui: Any, option: Option) -> Any:
        if not option.choices:
            step = step_of(option.low, option.high)
            return gui.add_slider(
                option.name, option.low, option.high, step, option.start, hint=option.meaning
            )
        choices = option.choices
        if option.name == "on":
            choices = tuple(body for body in choices if body in self._bodies)
        if option.optional:
            choices = (DEFAULT, *choices)
        start = option.start if option.start in choices and not option.optional else choices[0]
        return gui.add_dropdown(option.name, choices, initial_value=start, hint=option.meaning)


DEFAULT = "as usual"
"""Choice of an option that is then left out."""
