"""For scripts and notebooks: read topics, ask for things, wait for what happens.

    from services import connect

    with connect() as robot:
        print(robot.latest("observer/estimate").pose)
        robot.disturb("push", force=200, direction=90)
        robot.wait_for("arm/status", lambda status: status.state == "finished", timeout=60)

A connection listens to what it was asked for and to the events, queues what it hears, and never
slows the robot. It is meant for one thread.
"""

from __future__ import annotations

import difflib
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar, overload

from services.messages import ArmStatus, BaseStatus, Health, Message
from services.requests import ask
from services.service import Inbox
from services.topics import ARM_STATUS, BASE_STATUS, HEALTH, TOPICS, Topic
from services.wire.bus import open_bus
from services.wire.endpoints import default_run_dir, local

M = TypeVar("M", bound=Message)

QUEUE = 10_000
"""Unread messages of a topic that a script may fall behind by, before the oldest are dropped."""
PATIENCE = 10.0
"""For a topic that should be speaking [s]."""
WAIT = 300.0
"""For what is to happen [s]."""


class NotRunning(RuntimeError):
    """Nobody ever listened where the robot's sockets should be."""


class Silent(TimeoutError):
    """What was waited for was not heard in time."""


class Refused(RuntimeError):
    """A service refused a request; the text is its reason."""


@dataclass(frozen=True)
class Event:
    """Something that happened.

    Attributes:
        t: robot time [s].
        service: to which.
        name: of the event that led from one node to another, or of the new state.
        detail: the two nodes, or why the state was entered.
    """

    t: float
    service: str
    name: str
    detail: str = ""


def connect(robot: str = "r1", run_dir: Path | str | None = None) -> Connection:
    """Connect to a running robot on this machine; close it, or use it in a ``with``.

    Args:
        robot: its name on the bus.
        run_dir: where its sockets are, as given to ``steadyhand up``; by default one per robot.

    Raises:
        NotRunning: nobody listens there.
    """
    return Connection(robot, Path(run_dir) if run_dir else default_run_dir(robot))


class Connection:
    """A line to a running robot; made by ``connect``."""

    def __init__(self, robot: str, run_dir: Path) -> None:
        if not any(run_dir.glob("*.sock")):
            raise NotRunning(
                f"robot {robot} is not running (nothing listens in {run_dir}). Start it: "
                "steadyhand up; if it runs elsewhere, give its run_dir"
            )
        self._robot = robot
        self._topics = {name: replace(t, depth=max(t.depth, QUEUE)) for name, t in TOPICS.items()}
        self._inbox = Inbox(self._topics.values())
        self._heard_at: dict[str, float] = {}
        self._followed: set[str] = set()
        self._events: list[Event] = []
        self._was: dict[str, Any] = {}
        self._open = ExitStack()
        self._bus = self._open.enter_context(open_bus(local(run_dir), robot, "script"))
        for name in (ARM_STATUS.name, BASE_STATUS.name, *(t.name for t in HEALTH.values())):
            self._listen(name)

    def __enter__(self) -> Connection:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Hang up."""
        self._open.close()

    # --- topics -------------------------------------------------------------------------------

    @overload
    def latest(self, topic: Topic[M], timeout: float = PATIENCE) -> M: ...
    @overload
    def latest(self, topic: str, timeout: float = PATIENCE) -> Any: ...
    def latest(self, topic: str | Topic[Any], timeout: float = PATIENCE) -> Any:
        """The newest message of a topic; waits for one if the last is older than it may be.

        Args:
            topic: name, for example ``observer/estimate``, or row of ``services.topics``.
            timeout: [s].

        Raises:
            ValueError: no such topic; the known ones are named.
            Silent: nobody said anything in time.
        """
        heard = self._listen(topic)
        deadline = time.monotonic() + timeout
        self._drain()
        while time.monotonic() - self._heard_at.get(heard.name, -1e9) > heard.age_limit:
            self._wait(deadline, f"nobody speaks on {heard.name}")
        return self._inbox.latest(heard)

    @overload
    def messages(self, topic: Topic[M], timeout: float = PATIENCE) -> Iterator[M]: ...
    @overload
    def messages(self, topic: str, timeout: float = PATIENCE) -> Iterator[Any]: ...
    def messages(self, topic: str | Topic[Any], timeout: float = PATIENCE) -> Iterator[Any]:
        """Every message of a topic from now on, one after the other, for ever.

        Whoever falls ``QUEUE`` messages behind loses the oldest; ``lost`` counts them.

        Args:
            topic: as for ``latest``.
            timeout: how long the topic may be silent [s].

        Raises:
            ValueError, Silent: as for ``latest``.
        """
        heard = self._listen(topic)
        self._drain()
        self._inbox.new(heard)
        if heard.name not in self._followed:
            self._followed.add(heard.name)
            self._inbox.dropped[heard.name] = 0
        return self._follow(heard, timeout)

    def _follow(self, topic: Topic[M], timeout: float) -> Iterator[M]:
        while True:
            deadline = time.monotonic() + timeout
            while not (new := self._inbox.new(topic)):
                self._wait(deadline, f"nobody speaks on {topic.name} any more")
            yield from new

    @overload
    def wait_for(
        self, topic: Topic[M], condition: Callable[[M], bool], timeout: float = WAIT
    ) -> M: ...
    @overload
    def wait_for(
        self, topic: str, condition: Callable[[Any], bool], timeout: float = WAIT
    ) -> Any: ...
    def wait_for(
        self,
        topic: str | Topic[Any],
        condition: Callable[[Any], bool],
        timeout: float = WAIT,
    ) -> Any:
        """The first message from now on, the newest included, for which a condition holds.

        Args:
            topic: as for ``latest``.
            condition: of one message.
            timeout: [s].

        Raises:
            ValueError: no such topic.
            Silent: it did not hold in time; the text has the last message.
        """
        heard = self._listen(topic)
        deadline = time.monotonic() + timeout
        message = self.latest(topic, timeout)
        self._inbox.new(heard)
        new = [message]
        while True:
            for message in new:
                if condition(message):
                    return message
            while not (new := self._inbox.new(heard)):
                self._wait(deadline, f"waited {timeout:g} s in vain; {heard.name} last: {message}")
            if time.monotonic() > deadline:
                raise Silent(f"waited {timeout:g} s in vain; {heard.name} last: {message}")

    @property
    def lost(self) -> dict[str, int]:
        """Messages that did not come, or that nobody read in time, by topic."""
        asked = {name: self._inbox.dropped[name] for name in self._followed}
        return dict(self._bus.lost + Counter(asked))

    # --- events -------------------------------------------------------------------------------

    def events(self, timeout: float = WAIT) -> Iterator[Event]:
        """What happened since the last call, and what happens: nodes, states, services.

        Args:
            timeout: how long nothing may happen [s].

        Raises:
            Silent: nothing happened for so long.
        """
        while True:
            deadline = time.monotonic() + timeout
            self._drain()
            while not self._events:
                self._wait(deadline, f"nothing happened for {timeout:g} s")
            yield self._events.pop(0)

    def wait_for_event(self, name: str, service: str = "", timeout: float = WAIT) -> Event:
        """The next event of a name; those before it are passed over.

        Args:
            name: event of a program (``Contact``) or state of a service (``finished``).
            service: of which; any if empty.
            timeout: [s].

        Raises:
            Silent: it did not happen in time; the text has what did.
        """
        deadline = time.monotonic() + timeout
        seen: list[Event] = []
        while True:
            self._drain()
            while not self._events:
                happened = ", ".join(f"{e.service} {e.name}" for e in seen) or "nothing"
                self._wait(deadline, f"no {name!r} in {timeout:g} s; what happened: {happened}")
            event = self._events.pop(0)
            if event.name == name and service in ("", event.service):
                return event
            seen.append(event)

    # --- requests -----------------------------------------------------------------------------

    def request(self, service: str, verb: str, **args: Any) -> str:
        """Ask a service for something; what the verbs are is said by asking for a wrong one.

        Args:
            service: ``sim``, ``arm`` or ``base``.
            verb: for example ``start``, ``pause``, ``goal``.
            **args: of the verb.

        Returns:
            What the service said when it accepted.

        Raises:
            Refused: with the reason.
            NoAnswer: nobody answered.
        """
        reply = ask(self._bus.session, self._robot, service, verb, args)
        if not reply.accepted:
            raise Refused(f"{service} refused {verb}: {reply.reason}")
        return reply.reason

    def disturb(self, kind: str, **options: Any) -> str:
        """Disturb the simulation; kinds and options as in a scenario (docs/scenario.md).

        Raises:
            Refused: the text lists what is allowed.
        """
        return self.request("sim", "disturb", kind=kind, **options)

    # ------------------------------------------------------------------------------------------

    def _listen(self, topic: str | Topic[Any]) -> Topic[Any]:
        name = topic if isinstance(topic, str) else topic.name
        if name not in self._topics:
            near = difflib.get_close_matches(name, self._topics, n=1)
            hint = f"; did you mean {near[0]!r}?" if near else "."
            raise ValueError(f"no topic {name!r}{hint} Known: {', '.join(self._topics)}")
        heard = self._topics[name]
        self._bus.wake_on(heard)
        self._bus.hear(heard)
        return heard

    def _wait(self, deadline: float, otherwise: str) -> None:
        """Sleep until something arrives, and take it in."""
        left = deadline - time.monotonic()
        if left <= 0:
            raise Silent(otherwise)
        self._bus.arrived.wait(min(left, 0.1))
        self._drain()

    def _drain(self) -> None:
        self._bus.arrived.clear()
        for topic, message, at in self._bus.drain(self._inbox, None):
            self._heard_at[topic.name] = at
            self._events += self._happened(topic, message)

    def _happened(self, topic: Topic, message: Message) -> list[Event]:
        """What a status says that the one before it did not."""
        before, self._was[topic.name] = self._was.get(topic.name), message
        if before is None:
            return []
        out = []
        if isinstance(message, ArmStatus) and message.node and _place(message) != _place(before):
            way = f"{before.node} -> {message.node}" if before.node else message.node
            out.append(Event(message.t, "arm", message.event, way))
        if isinstance(message, ArmStatus | BaseStatus) and message.state != before.state:
            out.append(Event(message.t, topic.owner, message.state, message.reason))
        if isinstance(message, Health):
            who = message.service
            if message.pid != before.pid:
                out.append(Event(message.t, who, "restarted", f"process {message.pid}"))
            # of arm and platform their statuses tell, sooner
            if who not in ("arm", "base") and message.state != before.state:
                out.append(Event(message.t, who, message.state, message.detail))
        return out


def _place(status: ArmStatus) -> tuple[str, str, int]:
    """Where a program is."""
    return status.program, status.node, status.transitions
