"""Processes and the wire: topics, bus, runners, supervisor, command line.

For scripts: ``from services import connect`` (``services/script.py``).
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from services.script import connect as connect


def __getattr__(name: str) -> Any:
    if name == "connect":  # imported when asked for: the rooms need no bus to speak the vocabulary
        from services.script import connect

        return connect
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
