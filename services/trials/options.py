"""Options of an experiment from ``key=value``, refused with what is allowed."""

from __future__ import annotations

import difflib
import json
from collections.abc import Iterable, Mapping
from typing import Any

from pydantic import BaseModel, ValidationError

from services.trials.experiment import BadExperiment, Experiment


def parse(experiment: Experiment, words: Iterable[str]) -> dict[str, Any]:
    """What ``key=value`` words say; a value is JSON if it can be read as such, text otherwise.

    Raises:
        BadExperiment: a word is no such pair, or names a key twice.
    """
    given: dict[str, Any] = {}
    for word in words:
        key, sign, value = word.partition("=")
        if not sign or not key:
            raise BadExperiment(f"options are key=value, not {word!r}. {described(experiment)}")
        if key in given:
            raise BadExperiment(f"option {key!r} is given twice")
        try:
            given[key] = json.loads(value)
        except json.JSONDecodeError:
            given[key] = value
    return given


def checked(experiment: Experiment, given: Mapping[str, Any]) -> BaseModel:
    """The options of an experiment.

    Raises:
        BadExperiment: every finding, and which options there are.
    """
    model: type[BaseModel] = experiment.module.Options
    try:
        return model.model_validate(given)
    except ValidationError as error:
        findings = "; ".join(_finding(model, dict(e)) for e in error.errors())
        raise BadExperiment(f"{experiment.name}: {findings}. {described(experiment)}") from None


def described(experiment: Experiment) -> str:
    """Names and defaults of an experiment's options, in one sentence."""
    fields = experiment.module.Options.model_fields
    if not fields:
        return f"{experiment.name} has no options"
    told = (
        f"{name} (needed)" if field.is_required() else f"{name}={field.default}"
        for name, field in fields.items()
    )
    return f"Options of {experiment.name}, with their defaults: {', '.join(told)}"


def _finding(model: type[BaseModel], error: dict[str, Any]) -> str:
    where = ".".join(str(part) for part in error["loc"]) or "options"
    if error["type"] == "extra_forbidden":
        near = difflib.get_close_matches(where, list(model.model_fields), n=1)
        return f"unknown option {where!r}" + (f", did you mean {near[0]!r}?" if near else "")
    if error["type"] == "missing":
        return f"{where}=VALUE is needed"
    if error["type"] == "value_error":  # of a validator of the experiment's, that says it all
        return f"{where}: {error['ctx']['error']}"
    wrong = error["msg"].partition(", unable to parse")[0]
    return f"{where}: {wrong} (got {error['input']!r})"
