"""What is shown while a person waits for more than a second; nothing where nobody looks."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

from services.cli.common import errors

Tell = Callable[[float, str], None]
"""Called with how far it is and a few words."""


@contextmanager
def progress(what: str, total: float, unit: str, quiet: bool = False) -> Iterator[Tell]:
    """A bar on standard error, gone when it is over.

    Args:
        what: is being done.
        total: when it will be over at the latest, in ``unit``.
        unit: of how far it is.
        quiet: show nothing; nothing is shown either where standard error is no terminal.
    """
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.completed:.1f} of {task.total:g} " + unit),
        TextColumn("{task.fields[words]}"),
        TimeElapsedColumn(),
    )
    hidden = quiet or not errors.is_terminal
    with Progress(*columns, console=errors, transient=True, disable=hidden) as bar:
        task = bar.add_task(what, total=total, words="")
        yield lambda at, words: bar.update(task, completed=at, words=words)


@contextmanager
def busy(what: str, quiet: bool = False) -> Iterator[None]:
    """A spinner for what has no measure; otherwise as ``progress``."""
    columns = (SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn())
    hidden = quiet or not errors.is_terminal
    with Progress(*columns, console=errors, transient=True, disable=hidden) as bar:
        bar.add_task(what, total=None)
        yield
