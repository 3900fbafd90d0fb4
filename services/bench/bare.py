"""What the machine itself can do: a loop that does nothing, and messages that carry nothing.

Run as a process of its own: ``python -m services.bench.bare loop|ping|pong …``.
"""

from __future__ import annotations

import argparse
import json
import struct
import threading
import time
from collections import deque
from pathlib import Path

import zenoh

from services.live import realtime
from services.live.loop import Answers, FixedRate
from services.wire.endpoints import Endpoints, config

PERIOD = 0.001
"""Of the loop, and between messages [s]."""
START = 10.0
"""For the other to answer [s]."""
PING, PONG = "bare/ping", "bare/pong"
SIZE = 400
"""Of a message, as an arm's state has on the wire [bytes]."""


def socket(folder: Path, name: str) -> str:
    """Where one of the two listens."""
    return f"unixsock-stream/{folder}/{name}.sock"


def loop(seconds: float, rt: realtime.Mode) -> dict[str, float]:
    """Lateness of a loop of 1 kHz that does nothing [s], and ticks left out, as shares."""
    realtime.favour(rt)
    realtime.set_up(rt, 2)
    pace = FixedRate(PERIOD, realtime.spin(rt, PERIOD))
    end = time.monotonic() + seconds
    while pace.wait() < end:
        pass
    _, lateness = pace.statistics.report()
    ticks = pace.statistics.progress
    return {**lateness, "overruns": pace.statistics.overruns / ticks}


def ping(folder: Path, rt: realtime.Mode, seconds: float) -> dict[str, float]:
    """From a message sent each millisecond until it is heard back [s]: p50, p99, max."""
    realtime.favour(rt)
    endpoints = Endpoints((socket(folder, "ping"),), (socket(folder, "pong"),))
    answers = Answers()
    with zenoh.open(config(endpoints)) as session:
        # keep what is heard for the loop's own thread, as a service does
        heard: deque[tuple[float, bytes]] = deque()
        publisher = session.declare_publisher(PING, congestion_control=zenoh.CongestionControl.DROP)
        _subscriber = session.declare_subscriber(
            PONG, lambda sample: heard.append((time.monotonic(), sample.payload.to_bytes()))
        )
        realtime.set_up(rt, 0)
        pace = FixedRate(PERIOD, realtime.spin(rt, PERIOD))
        end: float | None = None
        deadline = time.monotonic() + START
        while end is None or pace.wait() < end:
            if end is None and heard:  # the other is there: from now on it counts
                answers, end = Answers(), time.monotonic() + seconds
            elif end is None and time.monotonic() > deadline:
                raise TimeoutError(f"no answer within {START:g} s")
            elif end is None:
                pace.wait()
            while heard:
                at, payload = heard.popleft()
                answers.answered(struct.unpack_from("<d", payload)[0], at)
            now = time.monotonic()
            answers.asked(now, now)
            publisher.put(struct.pack("<d", now) + bytes(SIZE - 8))
    return answers.report()


def pong(folder: Path, rt: realtime.Mode) -> None:
    """Say back what is heard, from the loop's own thread as the arm does, for ever."""
    realtime.favour(rt)
    endpoints = Endpoints((socket(folder, "pong"),), (socket(folder, "ping"),))
    newest: list[bytes] = [b""]
    arrived = threading.Event()

    def hear(sample: zenoh.Sample) -> None:
        newest[0] = sample.payload.to_bytes()
        arrived.set()

    with zenoh.open(config(endpoints)) as session:
        publisher = session.declare_publisher(PONG, congestion_control=zenoh.CongestionControl.DROP)
        _subscriber = session.declare_subscriber(PING, hear)
        realtime.set_up(rt, 2)
        while True:
            arrived.wait()
            arrived.clear()
            publisher.put(newest[0])


def main() -> None:
    """Do one of the three."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=("loop", "ping", "pong"))
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--folder", type=Path, default=Path())
    parser.add_argument("--rt", choices=("auto", "on", "off"), default="auto")
    options = parser.parse_args()
    if options.what == "pong":
        pong(options.folder, options.rt)
    elif options.what == "ping":
        print(json.dumps(ping(options.folder, options.rt, options.seconds)))  # noqa: T201
    else:
        print(json.dumps(loop(options.seconds, options.rt)))  # noqa: T201


if __name__ == "__main__":
    main()
