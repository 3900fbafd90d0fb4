"""Which code this is: what must be the same for the same trial to give the same bits."""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Mapping
from functools import cache
from importlib import metadata
from pathlib import Path

from services.trials.experiment import FOLDER, Experiment

ROOT = Path(__file__).parents[2]
ROOMS = ("services", "observer", "arm", "base", "sim", "deploy")
SUFFIXES = frozenset({".py", ".lark", ".hds", ".toml", ".urdf", ".svg"})
PACKAGES = ("numpy", "scipy", "dartpy", "filterpy", "pydantic")

Code = dict[str, str]
"""Digest of every room's files, version of every package that computes."""


def code_of(experiment: Experiment) -> Code:
    """What an experiment is run with, in this process."""
    code = dict(_shared())
    if experiment.file.parent != FOLDER:
        code["the experiment"] = _digest([experiment.file], experiment.file.parent)
    return code


def differences(expected: Mapping[str, str], found: Mapping[str, str]) -> list[str]:
    """Each part that differs, in words."""
    parts = sorted({*expected, *found})
    return [
        f"{part} ({expected.get(part, 'none')} then, {found.get(part, 'none')} now)"
        for part in parts
        if expected.get(part) != found.get(part)
    ]


@cache  # what a process has imported does not change while it lives
def _shared() -> Code:
    rooms = {room: _digest(_files(ROOT / room), ROOT) for room in ROOMS}
    versions = {name: metadata.version(name) for name in PACKAGES}
    return rooms | versions | {"python": f"{sys.version_info.major}.{sys.version_info.minor}"}


def _files(folder: Path) -> list[Path]:
    return sorted(p for p in folder.rglob("*") if p.suffix in SUFFIXES and p.is_file())


def _digest(files: list[Path], root: Path) -> str:
    digest = hashlib.sha256()
    for path in files:
        content = path.read_bytes()
        digest.update(f"{path.relative_to(root).as_posix()} {len(content)}\n".encode())
        digest.update(content)
    return digest.hexdigest()[:12]
