"""Floods a live arm with what strangers might send, and watches what becomes of it.

Simulation and arm run as real processes. Quiet and hostile blocks take turns, so that both see the
same machine. What is hostile carries numbers that no service of ours ever reaches: were such a
message accepted, the arm's bus would know.
"""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median
from typing import Any, Literal

import msgpack
import numpy as np
import zenoh

from services.messages import Health
from services.requests import NoAnswer, ask
from services.topics import ARM_STATE, HEALTH, TOPICS, Topic, key, request_key
from services.wire.access import OPERATOR, WATCHER
from services.wire.bus import Bus
from services.wire.endpoints import LARGEST, Endpoints, Identity, config, local
from services.wire.keys import issue, new_authority

Profile = Literal["open", "secure"]
HOSTILE = 1 << 60
"""Sequence numbers from here on are ours who attack: a service counts microseconds from boot."""
BLOCK = 5.0  # [s] of quiet, then of flood
ROBOT = "r1"
READABLE: list[Topic] = [ARM_STATE, TOPICS["observer/estimate"], TOPICS["observer/board"]]
"""What the arm reads."""
LONGEST = 120.0  # [s] for what takes a moment on a quiet machine
_SLOT = 0.002  # [s] between bursts of the flood


@dataclass
class Result:
    """What became of the arm.

    Attributes:
        sent: hostile messages and requests.
        accepted: of those, by the arm's bus or its requests.
        refused: by topic and reason, in Python; in the secure profile nothing hostile should get
            that far.
        late: of those refused, by topic, what the simulation itself said, too late.
        quiet: lateness of the arm's loop, p99 of each heartbeat's ticks, in quiet blocks [s].
        flooded: the same in hostile blocks [s].
        alive: the arm's loop still works, and answers a person.
    """

    sent: int = 0
    accepted: int = 0
    refused: dict[str, int] = field(default_factory=dict)
    late: dict[str, int] = field(default_factory=dict)
    quiet: list[float] = field(default_factory=list)
    flooded: list[float] = field(default_factory=list)
    alive: bool = False

    def refused_on(self, topic: str) -> int:
        """Hostile messages on a topic that were refused in Python."""
        refused = sum(n for about, n in self.refused.items() if about.startswith(f"{topic}: "))
        return refused - self.late.get(topic, 0)

    @property
    def ratio(self) -> float:
        """Median p99 lateness under the flood over that in quiet."""
        return median(self.flooded) / median(self.quiet)


def hostile_messages(
    topics: list[Topic], rng: np.random.Generator, forge: bool
) -> Iterator[tuple[str, bytes]]:
    """Topic names and payloads, for ever.

    Args:
        topics: that the victim reads.
        rng: draws kinds and contents.
        forge: also what could be true, as its owner would say it: only keys tell the difference.
    """
    zeros = [0.0] * 6
    while True:
        topic = topics[int(rng.integers(len(topics)))]
        seq, t = HOSTILE + int(rng.integers(1 << 40)), float(rng.uniform(0, 1e4))
        good: dict[str, Any] = {"t": t, "q": zeros, "qd": zeros, "tau": zeros, "wrench": zeros}
        wire: dict[str, Any] = {"from": topic.owner, "seq": seq, "body": good}
        kind = int(rng.integers(9 if forge else 8))
        if kind == 0:
            yield topic.name, rng.bytes(int(rng.integers(0, 300)))
            continue
        if kind == 1:
            packed = msgpack.packb(wire)
            yield topic.name, packed[: int(rng.integers(len(packed)))]
            continue
        if kind == 2:
            yield topic.name, bytes(LARGEST + 1) if rng.random() < 0.02 else b"\x91" * 900
            continue
        if kind == 3:
            wire["from"] = "stranger"
        elif kind == 4:
            good["q"] = [float("nan")] * 6
        elif kind == 5:
            good["tau"] = [1e9] * 6
        elif kind == 6:
            good["t"] = -1.0 if rng.random() < 0.5 else 1e12  # before the start; next millennium
        elif kind == 7:
            good["surprise"] = [[], {}, "x" * 500]
        yield (ARM_STATE.name if kind == 8 else topic.name), msgpack.packb(wire)


def flood_arm(
    messages: int,
    rate: float,
    profile: Profile = "open",
    seed: int = 0,
    told: Callable[[int], None] = lambda sent: None,
) -> Result:
    """Run simulation and arm live and flood the arm.

    Args:
        messages: how many hostile ones.
        rate: of them, in hostile blocks [1/s].
        profile: ``open``: over the unix socket of whoever may open it; ``secure``: over TLS, with a
            certificate that allows to watch.
        seed: of what is sent.
        told: called with how many were sent, after each block.
    """
    result = Result()
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="sh")))
        ours, strangers, people = _endpoints(folder, profile)
        stack.enter_context(_robot(folder))
        arm = stack.enter_context(_arm(ours))
        person = stack.enter_context(zenoh.open(config(people)))
        stranger = stack.enter_context(zenoh.open(config(strangers)))
        watch = Bus(person, ROBOT, "watch", [HEALTH["arm"]], lossless=True)
        lateness = _Lateness(watch)
        lateness.wait_until_running()
        attack = _attack(stranger, rate, profile, np.random.default_rng(seed))
        while result.sent < messages:
            result.quiet += lateness.during(lambda: time.sleep(BLOCK))
            count = min(messages - result.sent, round(rate * BLOCK))
            result.flooded += lateness.during(lambda n=count: attack(n))  # type: ignore[misc]
            result.sent += count
            told(result.sent)
        result.alive = lateness.beats(arm) and _answers(person)
        said = json.loads(arm.communicate(timeout=LONGEST)[0] or "{}")
        result.accepted = said.get("accepted", -1)
        result.refused, result.late = said.get("refused", {}), said.get("late", {})
    return result


class _Lateness:
    """Reads the arm's heartbeats."""

    def __init__(self, bus: Bus) -> None:
        self._bus = bus

    def wait_until_running(self) -> None:
        """Until the arm hears the robot's time."""
        deadline = time.monotonic() + LONGEST
        while not any(beat.state != "waiting" for beat in self._beats()):
            if time.monotonic() > deadline:
                raise RuntimeError("the arm did not come up; is this machine very busy?")
            time.sleep(0.1)
        time.sleep(1.0)

    def during(self, action: Callable[[], object]) -> list[float]:
        """The p99 of each heartbeat that was sent while something is done [s]."""
        self._beats()
        action()
        return [beat.lateness["p99"] for beat in self._beats()[1:] if "p99" in beat.lateness]

    def beats(self, arm: subprocess.Popen[str]) -> bool:
        """Whether the arm's loop still makes progress, from one heartbeat to another."""
        self._beats()
        heard: list[int] = []
        deadline = time.monotonic() + LONGEST
        while arm.poll() is None and time.monotonic() < deadline:
            heard += [beat.progress for beat in self._beats()]
            if heard and heard[-1] > heard[0]:
                return True
            time.sleep(0.1)
        return False

    def _beats(self) -> list[Health]:
        return [message for _, message in self._bus.take(HEALTH["arm"])]


def _attack(
    session: zenoh.Session, rate: float, profile: Profile, rng: np.random.Generator
) -> Callable[[int], None]:
    """A function that sends so many; every 50th is a request nobody waits for."""
    stream = hostile_messages(READABLE, rng, forge=profile == "secure")
    publishers = {t.name: session.declare_publisher(key(ROBOT, t)) for t in READABLE}
    ignore: Any = zenoh.handlers.Callback(lambda reply: None, indirect=False)
    verbs = ("start", "stop", "explode", "reset", "*")

    def send(count: int) -> None:
        started, per_slot = time.monotonic(), max(1, round(rate * _SLOT))
        for number in range(count):
            name, payload = next(stream)
            if number % 50 == 49:
                verb = verbs[int(rng.integers(len(verbs)))]
                # what an operator may ask is no attack in the open profile: never a good one
                wrong = b"\xc1" + payload
                session.get(request_key(ROBOT, "arm", verb), ignore, payload=wrong, timeout=0.5)
            else:
                publishers[name].put(payload)
            if number % per_slot == per_slot - 1:
                rest = started + (number + 1) / rate - time.monotonic()
                if rest > 0:
                    time.sleep(rest)

    return send


def _answers(session: zenoh.Session) -> bool:
    """Whether the arm answers a person: with a reason, for there is nothing to pause."""
    deadline = time.monotonic() + LONGEST
    while time.monotonic() < deadline:
        with suppress(NoAnswer):
            return bool(ask(session, ROBOT, "arm", "pause", {}).reason)
    return False


def own_address() -> str:
    """A loop-back address that no other process uses: our process id is in it."""
    pid = os.getpid()
    return f"127.{64 + (pid >> 16)}.{pid >> 8 & 255}.{pid & 255}"


def free_door() -> str:
    """Our own address and a port of it that nobody listens on, nor will before we do."""
    with socket.socket() as probe:
        probe.bind((own_address(), 0))
        return f"{own_address()}:{probe.getsockname()[1]}"


def _endpoints(folder: Path, profile: Profile) -> tuple[Endpoints, Endpoints, Endpoints]:
    """Of the arm, of the stranger, of a person."""
    inside = local(folder, "arm")
    if profile == "open":
        return inside, local(folder), local(folder)
    door = f"tls/{free_door()}"
    authority = new_authority(ROBOT)
    for role in ("arm", WATCHER, OPERATOR):
        issue(authority, folder / "keys", ROBOT, role, own_address(), days=1)
    arm, watcher, operator = (
        Identity(ROBOT, role, folder / "keys") for role in ("arm", WATCHER, OPERATOR)
    )
    return (
        Endpoints((*inside.listen, door), inside.connect, arm),
        Endpoints((), (door,), watcher),
        Endpoints((), (door,), operator),
    )


@contextmanager
def _robot(folder: Path) -> Iterator[None]:
    """The simulation, as ``up`` starts it."""
    argv = ["-m", "services.live.process", "--service", "sim", "--scenario", "whiteboard"]
    argv += ["--run-dir", str(folder), "--services", "sim,arm", "--parent", str(os.getpid())]
    with subprocess.Popen(
        [sys.executable, *argv],
    ) as process:
        try:
            yield
        finally:
            process.kill()


@contextmanager
def _arm(endpoints: Endpoints) -> Iterator[subprocess.Popen[str]]:
    """The arm's process (``hostile_arm.py``); it ends with its input, and says what it counted."""
    argv = [sys.executable, "-m", "services.bench.hostile_arm", *endpoints.listen]
    if endpoints.identity is not None:
        argv += ["--keys", str(endpoints.identity.folder)]
    for endpoint in endpoints.connect:
        argv += ["--connect", endpoint]
    pipe = subprocess.PIPE
    with subprocess.Popen(argv, stdin=pipe, stdout=pipe, text=True) as process:
        try:
            yield process
        finally:
            process.kill()
