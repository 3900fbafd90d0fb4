"""Toy trials that do what a seed asks for: draw a number, fail, or kill their worker."""

from __future__ import annotations

import os
import time
from pathlib import Path

import numpy as np

from services.trials.experiment import Options as Base
from services.trials.experiment import Row
from services.trials.lines import Line, middle, share


class Options(Base):
    """What may be chosen."""

    scale: float = 1.0
    seconds: float = 0.0
    fails: tuple[int, ...] = ()
    dies: tuple[int, ...] = ()
    dies_once: tuple[int, ...] = ()
    folder: str = ""


def run(seed: int, options: Options) -> Row:
    """A number; in a folder, a mark that this trial was run."""
    tries = 0
    if options.folder:
        mark = Path(options.folder) / str(seed)
        tries = mark.stat().st_size if mark.exists() else 0
        with mark.open("a") as file:
            file.write("x")
    if seed in options.dies or (seed in options.dies_once and not tries):
        os._exit(7)
    if seed in options.fails:
        raise ArithmeticError(f"seed {seed} is to fail")
    time.sleep(options.seconds)
    draws = np.random.default_rng(seed).normal(size=(200, 200))
    return {"x": options.scale * float((draws @ draws).sum()), "even": seed % 2 == 0}


def summary(rows: list[Row]) -> list[Line]:
    """Two lines."""
    return [share("even", (row["even"] for row in rows)), middle("x", (row["x"] for row in rows))]


def pictures(rows: list[Row], folder: Path) -> list[Path]:
    """One file."""
    (folder / "toy.png").write_bytes(b"")
    return [folder / "toy.png"]
