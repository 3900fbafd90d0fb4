"""The arm that ``bench hostile`` floods: that of ``up``, with a bus that counts its mistakes."""

from __future__ import annotations

from services.live import realtime

realtime.one_blas_thread()  # before anything imports numpy

# ruff: noqa: E402
import argparse
import json
import os
import sys
import threading
from collections import Counter
from pathlib import Path
from typing import Any

import zenoh

from services.bench.hostile import HOSTILE, ROBOT
from services.components import build_service
from services.live.clock import HeardClock
from services.live.runner import run_live
from services.messages import BadMessage, Message, Request
from services.requests import Requests
from services.wire.bus import Bus, _Reader
from services.wire.codec import decode
from services.wire.endpoints import Endpoints, Identity, config


class Counting(Bus):
    """Counts hostile messages that passed every check, and others that did not."""

    hostile = 0

    def __init__(self, session: zenoh.Session, robot: str, service: str, inputs: Any) -> None:
        super().__init__(session, robot, service, inputs)
        self.late: Counter[str] = Counter()

    def _accept(self, reader: _Reader, payload: bytes, now: float | None) -> Message | None:
        message = super()._accept(reader, payload, now)
        if message is not None and reader.admission.seq >= HOSTILE:
            self.hostile += 1
        if message is None and not _hostile(reader, payload):
            self.late[reader.topic.name] += 1
        return message


class CountingRequests(Requests):
    """Counts requests that were granted: nobody sends a good one."""

    granted = 0

    def run_pending(self, now: float) -> list[Request]:
        """See ``Requests``."""
        done = super().run_pending(now)
        self.granted += sum(request.accepted for request in done)
        return done


def _hostile(reader: _Reader, payload: bytes) -> bool:
    try:
        return decode(reader.topic, payload)[0] >= HOSTILE
    except BadMessage:
        return True


def main() -> None:
    """Run until standard input ends, then print what was counted as JSON."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("listen", nargs="+")
    parser.add_argument("--connect", action="append", default=[])
    parser.add_argument("--keys", type=Path)
    options = parser.parse_args()
    identity = Identity(ROBOT, "arm", options.keys) if options.keys else None
    endpoints = Endpoints(tuple(options.listen), tuple(options.connect), identity)
    sys.setswitchinterval(1e-4)  # as services.live.process does
    realtime.favour("auto")
    service, stop = build_service("arm", "whiteboard", 0, live=True), threading.Event()

    def wait() -> None:
        sys.stdin.read()
        stop.set()

    threading.Thread(target=wait, daemon=True).start()
    with zenoh.open(config(endpoints)) as session:
        bus = Counting(session, ROBOT, "arm", service.inputs)
        requests = CountingRequests(session, ROBOT, service)
        realtime.set_up("auto", 2)
        run_live(service, bus, HeardClock(), stop, requests)
        refused = dict(bus.refused) | {"requests: flooded": requests.flooded}
        said = {"accepted": bus.hostile + requests.granted, "refused": refused, "late": bus.late}
        print(json.dumps(said), flush=True)  # noqa: T201
        os._exit(0)


if __name__ == "__main__":
    main()
