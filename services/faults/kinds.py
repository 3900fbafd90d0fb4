"""What can go wrong with messages and services, as data; the world's own faults are in ``sim``."""

from __future__ import annotations

import re
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Fault:
    """Something that goes wrong from ``t`` [s] for ``duration`` [s]."""

    t: float
    duration: float

    @property
    def kind(self) -> str:
        """Name of the class, in words."""
        return re.sub(r"(?<=[a-z])(?=[A-Z])", " ", type(self).__name__).lower()

    def active(self, now: float) -> bool:
        """Whether it acts at robot time ``now`` [s]."""
        return self.t <= now < self.t + self.duration


@dataclass(frozen=True)
class OnTopic(Fault):
    """A fault of the messages of one topic on their way; ``reader``: to this service alone."""

    topic: str
    reader: str = field(default="", kw_only=True)


@dataclass(frozen=True)
class Loss(OnTopic):
    """A ``share`` of the messages does not arrive."""

    share: float


@dataclass(frozen=True)
class Duplication(OnTopic):
    """A ``share`` of the messages arrives twice, the second time up to 20 ms later."""

    share: float


@dataclass(frozen=True)
class Reordering(OnTopic):
    """Each message takes up to ``spread`` [s] longer than it should."""

    spread: float


@dataclass(frozen=True)
class Lateness(OnTopic):
    """Every message takes ``extra`` [s] longer."""

    extra: float


@dataclass(frozen=True)
class Replay(OnTopic):
    """With every message one arrives that was sent ``back`` [s] before."""

    back: float


@dataclass(frozen=True)
class Corruption(OnTopic):
    """A ``share`` of the messages has some of its bytes changed."""

    share: float


@dataclass(frozen=True)
class Flood(OnTopic):
    """A stray publisher sends ``count`` messages a tick: its own, and noise."""

    count: int


@dataclass(frozen=True)
class OnService(Fault):
    """A fault of a process."""

    service: str


@dataclass(frozen=True)
class Hang(OnService):
    """The service is not stepped: stopped, or stuck with the interpreter's lock."""


@dataclass(frozen=True)
class Death(OnService):
    """The service dies, and a new one is there after ``duration``."""


@dataclass(frozen=True)
class ClockStep(OnService):
    """The clock of the service's host is ``by`` [s] off, then right again."""

    by: float
