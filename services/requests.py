"""Requests from people: accepted or refused, with the reason.

Three threads meet here. Zenoh's thread puts the query into a queue. A worker parses it and lets
the service prepare an action. The loop executes the action between two steps.
"""

from __future__ import annotations

import json
import queue
import threading
import time
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from concurrent.futures import TimeoutError as FutureTimeout
from typing import Any

import zenoh

from services.messages import BadMessage, Request
from services.service import Reply, Service
from services.topics import request_key
from services.wire.codec import pack_plain, unpack_map

TIMEOUT = 2.0  # [s] for the loop to take an action up
WAITING = 16  # requests; people send one at a time
_AT_ONCE = 0.1  # [s]
RATE = 50
"""Requests that a service takes up in a second; who asks more often is refused."""
ALWAYS = ("protective_stop", "stop")
"""Verbs that wait behind no others, however many there are; what came before them is refused."""

Action = Callable[[], Reply]
_Lane = queue.Queue[tuple[zenoh.Query, int] | None]


class NoAnswer(RuntimeError):
    """Nobody answered a request; the text says what to do."""


class Requests:
    """Answers the verbs of one service.

    Args:
        session: open Zenoh session.
        robot: name of the robot.
        service: whose ``prepare`` is asked.
        timeout: how long an action may wait for the loop [s].
        clock: local time, for the rate [s].
    """

    def __init__(
        self,
        session: zenoh.Session,
        robot: str,
        service: Service,
        timeout: float = TIMEOUT,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._clock = clock
        self._service = service
        self._timeout = timeout
        self.flooded = 0
        """Requests that were not even looked at: more came than could be answered."""
        self._stops = 0
        """Requests of ``ALWAYS`` that came."""
        self._plain: _Lane = queue.Queue(WAITING)
        self._urgent: _Lane = queue.Queue(WAITING)
        self._actions: deque[tuple[str, dict[str, Any], Action, Future[Reply]]] = deque()
        self._taken: deque[float] = deque(maxlen=RATE)
        self._queryable = session.declare_queryable(
            request_key(robot, service.name, "*"),
            zenoh.handlers.Callback(self._take, indirect=False),
            complete=True,
        )
        self._workers = [
            threading.Thread(target=self._work, args=(lane,), name="requests", daemon=True)
            for lane in (self._plain, self._urgent)
        ]
        for worker in self._workers:
            worker.start()

    def _take(self, query: zenoh.Query) -> None:
        """On Zenoh's thread: keep a request, or let it go unanswered when too many wait."""
        urgent = _verb(query) in ALWAYS
        self._stops += urgent
        try:
            (self._urgent if urgent else self._plain).put_nowait((query, self._stops))
        except queue.Full:
            self.flooded += 1

    def run_pending(self, now: float) -> list[Request]:
        """Execute what was prepared; called by the loop between two steps. It never raises.

        Args:
            now: robot time [s].

        Returns:
            What was taken up, for the log.
        """
        done = []
        while self._actions:
            verb, args, action, future = self._actions.popleft()
            if not future.set_running_or_notify_cancel():
                continue  # its sender was told that it timed out
            try:
                reply = action()
            except Exception as error:
                reply = Reply(False, f"{type(error).__name__}: {error}")
            future.set_result(reply)
            said = json.dumps(args, default=str, skipkeys=True)
            done.append(
                Request(
                    t=max(now, 0.0),
                    verb=verb,
                    args=said,
                    accepted=reply.accepted,
                    reason=reply.reason,
                )
            )
        return done

    def close(self) -> None:
        """Stop answering."""
        for lane in (self._plain, self._urgent):
            lane.put(None)
        for worker in self._workers:
            worker.join(self._timeout + 1)

    def _work(self, lane: _Lane) -> None:
        while (item := lane.get()) is not None:
            query, stops = item
            reply = self._answer(query, stops)
            try:
                with query:
                    payload = pack_plain({"accepted": reply.accepted, "reason": reply.reason})
                    query.reply(query.key_expr, payload)
            except Exception:  # the asker is gone, or the session is closing
                continue

    def _answer(self, query: zenoh.Query, stops: int) -> Reply:
        """Prepare a request and have the loop act.

        Args:
            query: the request.
            stops: requests of ``ALWAYS`` until it came, itself among them.
        """
        verb = _verb(query)
        if verb not in self._service.verbs:
            known = ", ".join(self._service.verbs) or "nothing"
            return Reply(False, f"{self._service.name} cannot {verb!r}; it can: {known}")
        if verb not in ALWAYS:
            now = self._clock()
            if len(self._taken) == RATE and now - self._taken[0] < 1.0:
                return Reply(False, f"{self._service.name} takes {RATE} requests a second; wait")
            self._taken.append(now)
        try:
            args = unpack_map(query.payload.to_bytes()) if query.payload is not None else {}
            action = self._service.prepare(verb, args)
        except BadMessage as error:
            return Reply(False, f"cannot read the arguments ({error})")
        except ValueError as error:
            return Reply(False, str(error))
        except Exception as error:
            return Reply(False, f"{type(error).__name__}: {error}")
        if verb not in ALWAYS:
            action = self._unless_stopped(action, stops)
        future: Future[Reply] = Future()
        self._actions.append((verb, args, action, future))
        try:
            return future.result(self._timeout)
        except FutureTimeout:
            if future.cancel():
                return Reply(False, f"the loop of {self._service.name} did not take it up in time")
            return Reply(False, f"{self._service.name} is still busy with it; outcome unknown")

    def _unless_stopped(self, action: Action, stops: int) -> Action:
        """Somebody who stops means all that was asked before, also what still waits."""

        def act() -> Reply:
            return Reply(False, "a stop came after it") if stops != self._stops else action()

        return act


def _verb(query: zenoh.Query) -> str:
    return str(query.key_expr).rpartition("/")[2]


def ask(
    session: zenoh.Session,
    robot: str,
    service: str,
    verb: str,
    args: dict[str, Any],
    timeout: float = TIMEOUT + 1,
) -> Reply:
    """Send a request and wait for its answer. Never from a control loop.

    Raises:
        NoAnswer: nobody answered in time, or with something unreadable.
    """
    key, payload = request_key(robot, service, verb), pack_plain(args)
    deadline = time.monotonic() + timeout
    while True:
        asked = time.monotonic()
        channel: Any = zenoh.handlers.FifoChannel(4)
        for reply in session.get(key, channel, payload=payload, timeout=timeout):
            if reply.ok is not None:
                return _reply(service, reply.ok.payload.to_bytes())
        # ended at once: not connected to it yet, so nobody got the request and it may be repeated
        now = time.monotonic()
        if now - asked > _AT_ONCE or now > deadline:
            raise NoAnswer(f"{service} of robot {robot} does not answer")
        time.sleep(_AT_ONCE / 2)


def _reply(service: str, payload: bytes) -> Reply:
    try:
        content = unpack_map(payload)
    except BadMessage as error:
        raise NoAnswer(f"{service} gave an unreadable answer ({error})") from error
    return Reply(content.get("accepted") is True, str(content.get("reason", "")))
