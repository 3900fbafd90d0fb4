"""A recording that came from files: what had to be dropped, and what is to be estimated."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from observer.recordings.recording import Recording

Severity = Literal["note", "warning"]


@dataclass(frozen=True)
class Verdict:
    """One thing to know about a recording.

    Attributes:
        severity: ``note`` (good to know) or ``warning`` (results suffer).
        code: short name, stable, for programs.
        text: what is so, in plain words.
        advice: what to do about it; empty if nothing.
    """

    severity: Severity
    code: str
    text: str
    advice: str = ""

    def __str__(self) -> str:
        return f"{self.severity}: {self.text}" + (f": {self.advice}" if self.advice else "")


@dataclass(frozen=True)
class Log(Recording):
    """A recording read from files by `observer.recordings.load.load_recording`.

    Attributes:
        auto: keys of the description that are to be estimated, as ``odometry.delay``; what
            ``base`` says of those is a stand-in.
        findings: what was dropped, inferred or strange, in the order of the files.
    """

    auto: frozenset[str] = frozenset()
    findings: tuple[Verdict, ...] = ()


UNTOLD = frozenset({"odometry.delay", "speeds.delay"})
"""To be estimated of a recording that does not say: stamps may be late whatever is known."""


def auto_of(recording: Recording) -> frozenset[str]:
    """What is to be estimated of a recording (keys as ``odometry.delay``)."""
    return recording.auto if isinstance(recording, Log) else UNTOLD
