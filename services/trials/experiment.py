"""What an experiment is, and how one is found by its name or file."""

from __future__ import annotations

import ast
import difflib
import importlib
import importlib.util
import sys
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

from pydantic import BaseModel, ConfigDict

FOLDER = Path(__file__).parent / "experiments"
PACKAGE = "services.trials.experiments"
NEEDED = ("Options", "run", "summary", "pictures")

Row = dict[str, Any]
"""What a trial found: plain data by key, as JSON can hold it."""


class BadExperiment(ValueError):
    """What was asked for cannot be run; the text says what could be."""


class Options(BaseModel):
    """Base of an experiment's options: nothing unknown, nothing changed later."""

    model_config = ConfigDict(extra="forbid", frozen=True)


@dataclass(frozen=True)
class Experiment:
    """An experiment that can be run.

    Its module has a docstring whose first line describes it, and

    - ``Options``: a model; every option has a default,
    - ``run(seed, options) -> Row``: one trial. It depends on nothing else: no clock, no file that
      somebody may change, nothing kept from an earlier trial,
    - ``summary(rows) -> list[Line]``: the table, from the rows in the order of their seeds,
    - ``pictures(rows, folder) -> list[Path]``: files that it drew,
    - ``show(seed, options, folder) -> Row`` if it likes: a trial again, with all there is to see
      of it written into the folder.

    Attributes:
        name: as people ask for it.
        source: from which any process can load it: the name, or an absolute path.
        module: the above.
    """

    name: str
    source: str
    module: ModuleType

    @property
    def file(self) -> Path:
        """Where it is written."""
        return Path(str(self.module.__file__))


def known() -> dict[str, str]:
    """Name and description of every experiment; imports none of them."""
    files = sorted(path for path in FOLDER.glob("*.py") if not path.name.startswith("_"))
    return {path.stem.replace("_", "-"): _described(path) for path in files}


def load(source: str) -> Experiment:
    """Find an experiment.

    Args:
        source: one of ``known()``, or a Python file.

    Raises:
        BadExperiment: there is none, or it lacks something.
    """
    if source.endswith(".py"):
        path = Path(source).resolve()
        experiment = Experiment(path.stem.replace("_", "-"), str(path), _import_file(path))
    else:
        names = list(known())
        if source not in names:
            near = difflib.get_close_matches(source, names, n=3, cutoff=0.5)
            hint = f"; did you mean {' or '.join(near)}?" if near else "."
            raise BadExperiment(
                f"no experiment {source!r}{hint} Known: {', '.join(names)}; or give a Python file"
            )
        module = importlib.import_module(f"{PACKAGE}.{source.replace('-', '_')}")
        experiment = Experiment(source, source, module)
    missing = [name for name in NEEDED if not hasattr(experiment.module, name)]
    if missing:
        raise BadExperiment(
            f"{experiment.file} is no experiment: it has no {', '.join(missing)} "
            f"(an experiment has {', '.join(NEEDED)})"
        )
    return experiment


def _described(path: Path) -> str:
    text = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
    return text.partition("\n")[0]


def _import_file(path: Path) -> ModuleType:
    if not path.is_file():
        raise BadExperiment(f"no file {path}. Experiments by name: {', '.join(known())}")
    name = f"steadyhand_experiment_{path.stem}"
    loaded = sys.modules.get(name)
    if loaded is not None and loaded.__file__ == str(path):
        return loaded
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # where pydantic looks up what annotations mean
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        del sys.modules[name]
        raise BadExperiment(f"{path}: {type(error).__name__}: {error}") from error
    return module
