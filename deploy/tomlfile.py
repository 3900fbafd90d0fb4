"""Reads a TOML file into a pydantic model; every error names the file, the key and the fix."""

from __future__ import annotations

import difflib
import tomllib
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError

T = TypeVar("T", bound=BaseModel)


class Strict(BaseModel):
    """A table that allows no unknown key and cannot be changed once read."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class BadFile(ValueError):
    """A file that cannot be used; the text lists every finding as ``file: key: what is wrong``."""

    def __init__(self, path: Path, findings: list[str]) -> None:
        super().__init__("\n".join(f"{path}: {finding}" for finding in findings))
        self.path = path
        self.findings = findings


def load_toml(path: Path, model: type[T]) -> T:
    """Read and validate a TOML file.

    Args:
        path: the file.
        model: pydantic model of its content.

    Raises:
        BadFile: missing file, bad TOML, or findings by key, all at once.
    """
    content = _read(path)
    try:
        return model.model_validate(content)
    except ValidationError as error:
        raise BadFile(path, [_finding(model, dict(e)) for e in error.errors()]) from None


def toml_entry(path: Path, key: str, default: Any) -> Any:
    """One entry at the top of a TOML file, ``default`` if it has none.

    Raises:
        BadFile: missing file or bad TOML.
    """
    return _read(path).get(key, default)


def _read(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise BadFile(path, ["no such file"]) from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise BadFile(path, [f"not TOML: {error}"]) from None
    except RecursionError:
        raise BadFile(path, ["not TOML of ours: tables or lists nested too deep"]) from None


def _finding(model: type[BaseModel], error: dict[str, Any]) -> str:
    where = ".".join(str(part) for part in error["loc"]) or "(top)"
    if error["type"] == "extra_forbidden":
        known = sorted(_keys_at(model, error["loc"][:-1]))
        near = difflib.get_close_matches(str(error["loc"][-1]), known, n=1)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        return f"{where}: unknown key{hint} Allowed: {', '.join(known)}"
    if error["type"] == "union_tag_invalid":
        tag, known = error["ctx"]["tag"], error["ctx"]["expected_tags"].replace("'", "").split(", ")
        near = difflib.get_close_matches(str(tag), known, n=1)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        key = error["ctx"]["discriminator"].strip("'")
        return f"{where}.{key}: unknown {key} {tag!r}{hint} Allowed: {', '.join(known)}"
    got = "" if error["type"] == "missing" else f" (got {error['input']!r})"
    return f"{where}: {error['msg'].removeprefix('Value error, ')}{got}"


def _keys_at(model: type[BaseModel], loc: tuple[Any, ...]) -> set[str]:
    """Keys allowed in the table at ``loc``; of a union, those of the member named by its tag."""
    models: list[type[BaseModel]] = [model]
    for part in loc:
        if isinstance(part, int):
            continue
        found: list[type[BaseModel]] = []
        for candidate in models:
            info = candidate.model_fields.get(str(part))
            if info is not None:
                found += _models_in(info.annotation)
        tagged = [c for c in models if part in _tags(c)]
        models = found or tagged or models
    return {name for candidate in models for name in candidate.model_fields}


def _models_in(annotation: Any) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    inner = getattr(annotation, "__args__", ())
    return [found for part in inner for found in _models_in(part)]


def _tags(model: type[BaseModel]) -> set[Any]:
    info = model.model_fields.get("kind")
    return set(getattr(info.annotation, "__args__", ())) if info is not None else set()
