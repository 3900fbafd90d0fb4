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
from pathlib import Path

import zenoh

from services.bench.hostile import HOSTILE, ROBOT
from services.components import build_service
from services.live.clock import HeardClock
from services.live.runner import run_live
from services.messages import Message
from services.requests import Requests
from services.wire.bus import Bus, _Reader
from services.wire.endpoints import Endpoints, Identity, config


class Counting(Bus):
    """Counts hostile messages that passed every check."""

    hostile = 0

    def _accept(self, reader: _Reader, payload: bytes, now: float | None) -> Message | None:
        message = super()._accept(reader, payload, now)
        if message is not None and reader.admission.seq >= HOSTILE:
            self.hostile += 1
        return message


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
        requests = Requests(session, ROBOT, service)
        realtime.set_up("auto", 2)
        run_live(service, bus, HeardClock(), stop, requests)
        refused = dict(bus.refused) | {"requests: flooded": requests.flooded}
        print(json.dumps({"accepted": bus.hostile, "refused": refused}), flush=True)  # noqa: T201
        os._exit(0)


if __name__ == "__main__":
    main()
