"""The nearest valid name, for messages that say what to write instead."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches

_SHOWN = 12


def nearest(name: str, valid: Iterable[str], cutoff: float = 0.6) -> str | None:
    """The valid name most like ``name``, upper and lower case counting as alike; None if none is.

    Args:
        name: what was written.
        valid: what could have been written.
        cutoff: likeness from 0 (anything) to 1 (equal) below which nothing is suggested.
    """
    folded: dict[str, str] = {}
    for candidate in valid:
        folded.setdefault(candidate.casefold(), candidate)
    matches = get_close_matches(name.casefold(), folded, n=1, cutoff=cutoff)
    return folded[matches[0]] if matches else None


def listing(valid: Iterable[str], label: str = "valid names") -> str:
    """``valid names: A, B, C``, cut after a dozen."""
    names = list(valid)
    shown = ", ".join(names[:_SHOWN]) or "none"
    more = f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else ""
    return f"{label}: {shown}{more}"


def hint(name: str, valid: Iterable[str], label: str = "valid names") -> str:
    """``did you mean 'X'? (valid names: X, Y)``; only the list when nothing is near."""
    names = list(valid)
    match = nearest(name, names)
    listed = listing(names, label)
    return f"did you mean '{match}'? ({listed})" if match else listed
