"""Requests are answered accepted or refused with the reason, and act between two steps."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
import zenoh
from patience import until
from service_toys import ToySim

from services.live.clock import EpochClock
from services.live.runner import run_live
from services.requests import RATE, NoAnswer, Requests, ask
from services.service import Reply
from services.wire.bus import open_bus
from services.wire.endpoints import config, local


@contextmanager
def _running(run_dir: Path, looping: bool = True) -> Iterator[tuple[ToySim, Requests]]:
    toy, stop = ToySim(1), threading.Event()
    with open_bus(local(run_dir, "sim"), "r1", "sim", toy.inputs) as bus:
        requests = Requests(bus.session, "r1", toy, timeout=10.0 if looping else 0.3)
        thread = threading.Thread(
            target=run_live, args=(toy, bus, EpochClock(0.0), stop, requests), daemon=True
        )
        if looping:
            thread.start()
        try:
            yield toy, requests
        finally:
            stop.set()
            if looping:
                thread.join()
            requests.close()


def _ask(run_dir: Path, verb: str, args: dict[str, Any]) -> tuple[bool, str]:
    with zenoh.open(config(local(run_dir))) as session:
        reply = ask(session, "r1", "sim", verb, args, timeout=20.0)
        return reply.accepted, reply.reason


def test_accepted_and_refused(tmp_path: Path) -> None:
    """A good request acts; a wrong argument and an unknown verb are refused, saying why."""
    with _running(tmp_path) as (toy, _):
        before = toy.steps
        assert _ask(tmp_path, "stir", {"value": 0.25}) == (True, "")
        assert _ask(tmp_path, "stir", {"value": "much"}) == (False, "stir needs value=NUMBER")
        accepted, reason = _ask(tmp_path, "fly", {})
        assert not accepted
        assert reason == "sim cannot 'fly'; it can: stir"
        assert toy.steps > before


def test_unreadable_arguments_are_refused(tmp_path: Path) -> None:
    """Bytes that are no arguments get an answer as well."""
    with _running(tmp_path), zenoh.open(config(local(tmp_path))) as session:
        ask(session, "r1", "sim", "stir", {"value": 1.0}, timeout=20.0)  # they have met
        reply = next(iter(session.get("r1/request/sim/stir", payload=b"\xc1", timeout=20.0)))
        assert b"cannot read" in reply.ok.payload.to_bytes()  # type: ignore[union-attr]


def test_a_loop_that_does_not_take_it_up_is_reported(tmp_path: Path) -> None:
    """The asker learns that nothing happened, and nothing happens later."""
    with _running(tmp_path, looping=False) as (toy, requests):
        x = toy.x
        accepted, reason = _ask(tmp_path, "stir", {"value": 0.25})
        assert not accepted
        assert "did not take it up" in reason
        assert requests.run_pending(0.0) == []
        assert toy.x == x


def test_who_asks_too_often_is_refused_but_may_always_stop(tmp_path: Path) -> None:
    """So many in a second and no more; a second later again; a stop is taken up at any time."""
    now = [100.0]
    toy = ToySim(1)
    toy.verbs = (*toy.verbs, "stop")
    with zenoh.open(config(local(tmp_path))) as session:
        requests = Requests(session, "r1", toy, clock=lambda: now[0])

        def asked(verb: str) -> str:
            return ask(session, "r1", "sim", verb, {"value": "much"}, timeout=20.0).reason

        try:
            assert {asked("stir") for _ in range(RATE)} == {"stir needs value=NUMBER"}
            assert asked("stir") == f"sim takes {RATE} requests a second; wait"
            assert "requests a second" not in asked("stop")
            now[0] += 1.0
            assert asked("stir") == "stir needs value=NUMBER"
        finally:
            requests.close()


class Slow(ToySim):
    """Its "stir" is a long time in preparation; "stop" is not."""

    verbs = ("stir", "stop")

    def __init__(self) -> None:
        super().__init__(1)
        self.preparing, self.go_on = threading.Event(), threading.Event()

    def prepare(self, verb: str, args: dict[str, Any]) -> Callable[[], Reply]:
        """As asked."""
        if verb == "stir":
            self.preparing.set()
            assert self.go_on.wait(60.0)
        return lambda: Reply(True, verb)


def test_a_stop_waits_behind_nobody_and_counts_for_all_before_it(tmp_path: Path) -> None:
    """It is taken up while a start is being prepared, which then does not begin any more."""
    toy = Slow()
    with zenoh.open(config(local(tmp_path))) as session:
        requests = Requests(session, "r1", toy, timeout=60.0)
        replies: dict[str, Reply] = {}

        def asked(verb: str) -> threading.Thread:
            def run() -> None:
                replies[verb] = ask(session, "r1", "sim", verb, {}, timeout=60.0)

            thread = threading.Thread(target=run)
            thread.start()
            return thread

        try:
            first = asked("stir")
            assert toy.preparing.wait(60.0)
            second = asked("stop")
            until(lambda: requests.run_pending(0.0) or not second.is_alive(), "the stop")
            second.join()
            assert replies["stop"] == Reply(True, "stop")
            toy.go_on.set()
            until(lambda: requests.run_pending(0.0) or not first.is_alive(), "the start")
            first.join()
            assert replies["stir"] == Reply(False, "a stop came after it")
        finally:
            requests.close()


def test_nobody_there(tmp_path: Path) -> None:
    """No answer is an error of its own, not a refusal."""
    with zenoh.open(config(local(tmp_path))) as session, pytest.raises(NoAnswer):
        ask(session, "r1", "sim", "stir", {}, timeout=0.3)
