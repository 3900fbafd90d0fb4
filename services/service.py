"""What a process is made of: an inbox, a step, and requests from people.

The same service objects run live over Zenoh, paced over Zenoh, and in lockstep inside one
process; only the runner around them differs (docs/architecture.md).
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

from services.messages import Message
from services.topics import Topic

M = TypeVar("M", bound=Message)
Outbox = list[tuple[Topic, Message]]


@dataclass(frozen=True)
class Reply:
    """Answer to a request: accepted, or refused with the reason."""

    accepted: bool
    reason: str = ""


class Inbox:
    """The newest messages a service has heard, by topic. It never blocks and never waits."""

    def __init__(self, topics: Iterable[Topic]) -> None:
        self._latest: dict[str, Message] = {}
        self._topics = {topic.name: topic for topic in topics}
        self._unread: dict[str, deque[tuple[float, Message]]] = {
            topic.name: deque(maxlen=topic.depth) for topic in self._topics.values()
        }
        self.dropped: Counter[str] = Counter()
        """Messages that gave way to newer ones before anybody read them, by topic."""

    def offer(self, topic: Topic, message: Message, at: float = 0.0) -> None:
        """Put a checked message in; called by the runner between steps.

        Args:
            topic: of the message.
            message: what arrived.
            at: when, by the local clock [s].
        """
        name = topic.name
        # a latest-value topic was put in order on its way; the others may arrive in any order
        if topic.depth == 1 or (newest := self._latest.get(name)) is None or message.t >= newest.t:
            self._latest[name] = message
        unread = self._unread[name]
        self.dropped[name] += len(unread) == unread.maxlen
        unread.append((at, message))

    def latest(self, topic: Topic[M]) -> M | None:
        """The newest message by its own ``t``, or None before the first."""
        return self._latest.get(topic.name)  # type: ignore[return-value]

    def age(self, topic: Topic, now: float) -> float:
        """Age of the newest message at robot time ``now`` [s]; infinite before the first."""
        newest = self._latest.get(topic.name)
        return now - newest.t if newest is not None else float("inf")

    def new(self, topic: Topic[M]) -> list[M]:
        """Messages that arrived since the last call, in order of arrival."""
        unread = self._unread[topic.name]
        out = [message for _, message in unread]
        unread.clear()
        return out  # type: ignore[return-value]

    def heard(self) -> list[tuple[float, Topic, Message]]:
        """Messages of all topics since the last call, each with when it arrived [s], unordered."""
        out = [
            (at, self._topics[name], message)
            for name, unread in self._unread.items()
            for at, message in unread
        ]
        for unread in self._unread.values():
            unread.clear()
        return out


@dataclass(frozen=True)
class Arrivals:
    """What a live service is stepped by instead of a clock.

    Attributes:
        topic: whose arrivals.
        period: nominal time between two [s].
    """

    topic: Topic
    period: float


class Service(Protocol):
    """A process without its process: stepped by a runner, with time and inputs passed in.

    One that has ``driven_by: Arrivals`` is stepped by these when it runs live.

    Attributes:
        name: one of ``topics.SERVICES``.
        period: time between steps [s].
        inputs: topics it reads.
        verbs: requests it answers.
    """

    name: str
    period: float
    inputs: tuple[Topic, ...]
    verbs: tuple[str, ...]

    def step(self, now: float, inbox: Inbox) -> Outbox:
        """Advance to robot time ``now`` [s]; returns what to publish."""
        ...

    def prepare(self, verb: str, args: dict[str, Any]) -> Callable[[], Reply]:
        """Turn a request into an action for the loop.

        Runs outside the real-time thread (it may parse files); the returned action runs inside
        it, between two steps, and must be quick.

        Raises:
            ValueError: the request cannot be granted; its text is the reason given back.
        """
        ...

    def state(self) -> tuple[str, str]:
        """One word and one sentence on how the service is, for its heartbeat."""
        ...


def act_on(acts: dict[str, Callable[[], None]], verb: str) -> Callable[[], Reply]:
    """The action of a verb, refusing with the reason it raises."""
    if verb not in acts:
        raise ValueError(f"unknown request {verb!r}. Known: {', '.join(acts)}")

    def act() -> Reply:
        try:
            acts[verb]()
        except (ValueError, TypeError) as error:
            return Reply(False, str(error))
        return Reply(True)

    return act
