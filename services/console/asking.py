"""Sends what people press as requests, and keeps what was answered."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from services.requests import NoAnswer
from services.service import Reply

MOST = 4
"""Requests under way at once; more are refused here, so that a page gone wild floods nobody."""
GAP = 0.1
"""A control that is pressed again sooner than this is refused [s]."""

Ask = Callable[[str, str, dict[str, Any]], Reply]
"""Service, verb, arguments; raises NoAnswer."""


@dataclass(frozen=True)
class Answer:
    """What became of a request: ``label`` is the control's name."""

    label: str
    accepted: bool
    reason: str


class Asking:
    """Asks in the thread that calls; the page's loop goes on.

    Args:
        ask: sends a request and waits for its answer.
    """

    def __init__(self, ask: Ask) -> None:
        self._ask = ask
        self._free = threading.Semaphore(MOST)
        self._pressed: dict[str, float] = {}
        self.answers: deque[Answer] = deque(maxlen=6)

    def __call__(
        self,
        label: str,
        service: str,
        verb: str,
        args: dict[str, Any] | None = None,
        urgent: bool = False,
    ) -> Answer:
        """Ask, and keep the answer; an urgent request is never held back here."""
        now = time.monotonic()
        soon = now - self._pressed.get(label, -GAP) < GAP
        self._pressed[label] = now
        if urgent:
            answer = self._asked(label, service, verb, args or {})
        elif soon:
            answer = Answer(label, False, "pressed twice in a moment; the first counts")
        elif not self._free.acquire(blocking=False):
            answer = Answer(label, False, f"{MOST} requests still wait for their answers")
        else:
            try:
                answer = self._asked(label, service, verb, args or {})
            finally:
                self._free.release()
        self.answers.append(answer)
        return answer

    def _asked(self, label: str, service: str, verb: str, args: dict[str, Any]) -> Answer:
        try:
            reply = self._ask(service, verb, args)
        except NoAnswer as error:
            return Answer(label, False, f"{error}. Is it up and well? See Services")
        except Exception as error:  # a session that is closing
            return Answer(label, False, f"{type(error).__name__}: {error}")
        return Answer(label, reply.accepted, reply.reason)
