"""Who has no right to say something is not heard, and who has, is."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pytest
import zenoh
from patience import PATIENCE, until
from secure_place import Place

from services.messages import ArmCommand, ArmState, Truth
from services.requests import NoAnswer, Requests, ask
from services.service import Inbox, Reply
from services.topics import ARM_COMMAND, ARM_STATE, TRUTH, Topic
from services.wire.access import OPERATOR, WATCHER
from services.wire.bus import Bus
from services.wire.endpoints import LARGEST
from services.wire.keys import new_authority

LAST = 10**6
"""Number of a message after all others."""
SILENCE = 1.0  # [s] of sending what must not


@pytest.fixture
def place(tmp_path: Path) -> Iterator[Place]:
    """Processes are closed in the end."""
    with ExitStack() as stack:
        yield Place(tmp_path, stack)


def _command(k: int) -> ArmCommand:
    return ArmCommand(0.001 * k, np.zeros(6))


def heard(reader: Bus, topic: Topic, send: Callable[[int], object], seconds: float) -> bool:
    """Whether anything sent within some time is accepted; ends at the first that is."""
    inbox, deadline, k = Inbox([topic]), time.monotonic() + seconds, 0
    while time.monotonic() < deadline:
        k += 1
        send(k)
        time.sleep(0.01)
        if reader.drain(inbox, None):
            return True
    return False


def met(sim: Bus, arm: Bus) -> None:
    """The arm is heard, and nothing that it said is on its way any more."""
    assert heard(sim, ARM_COMMAND, speaks(arm, ARM_COMMAND, "arm"), PATIENCE)
    arm.publish(ARM_COMMAND, _command(LAST))
    inbox = Inbox([ARM_COMMAND])

    def last() -> bool:
        return any(c.t == _command(LAST).t for _, c, _ in sim.drain(inbox, None))

    until(last, "the last of it")


def speaks(bus: Bus, topic: Topic, owner: str) -> Callable[[int], object]:
    """Sends torques as the owner of the topic would, whoever we are."""
    bus.service = owner
    return lambda k: bus.publish(topic, _command(k))


def test_the_right_certificate_is_heard(place: Place) -> None:
    """Otherwise nothing else here says anything."""
    sim = place.listening("sim", ARM_COMMAND)
    arm = place.connecting("arm", place.identity("arm"), "sim")
    assert heard(sim, ARM_COMMAND, speaks(arm, ARM_COMMAND, "arm"), PATIENCE)


@pytest.mark.parametrize("role", ["base", "observer", "recorder", OPERATOR, WATCHER])
def test_a_right_certificate_of_the_wrong_role_is_not_heard(place: Place, role: str) -> None:
    """Who holds base's key cannot move the arm, even if it says that it is the arm."""
    sim = place.listening("sim", ARM_COMMAND)
    arm = place.connecting("arm", place.identity("arm"), "sim")
    met(sim, arm)
    stranger = place.connecting("x", place.identity(role), "sim")
    _connected(stranger)
    assert not heard(sim, ARM_COMMAND, speaks(stranger, ARM_COMMAND, "arm"), SILENCE)
    assert not sim.refused  # it was dropped before Python saw it


@pytest.mark.parametrize("case", ["wrong authority", "expired", "plain tcp"])
def test_without_a_good_certificate_nobody_gets_in(place: Place, case: str) -> None:
    """Not one message, and not even a session."""
    sim = place.listening("sim", ARM_COMMAND)
    if case == "plain tcp":
        settings = zenoh.Config()
        settings.insert_json5("mode", '"client"')
        settings.insert_json5("connect/endpoints", f'["tcp/{place.doors["sim"]}"]')
        settings.insert_json5("scouting/multicast/enabled", "false")
        with pytest.raises(zenoh.ZError):
            zenoh.open(settings)
        return
    authority = new_authority("r1") if case == "wrong authority" else None
    identity = place.identity("arm", authority, days=-0.1 if case == "expired" else 1)
    stranger = place.connecting("arm", identity, "sim")
    assert not heard(sim, ARM_COMMAND, speaks(stranger, ARM_COMMAND, "arm"), SILENCE)
    assert not list(stranger.session.info.peers_zid())


def test_no_certificate_no_session(place: Place) -> None:
    """TLS alone is not enough: whoever connects must show a certificate."""
    place.listening("sim", ARM_COMMAND)
    settings = zenoh.Config()
    folder = place.identity("arm").folder
    for name, value in {
        "mode": '"client"',
        "scouting/multicast/enabled": "false",
        "connect/endpoints": f'["tls/{place.doors["sim"]}"]',
        "connect/timeout_ms": "1000",
        "transport/link/tls/root_ca_certificate": f'"{folder}/authority.pem"',
    }.items():
        settings.insert_json5(name, value)
    with pytest.raises(zenoh.ZError):
        zenoh.open(settings)


def test_truth_is_for_people_only(place: Place) -> None:
    """A controller that subscribes to the truth is sent nothing; a watcher is."""
    sim = place.listening("sim")
    watcher = place.connecting("watch", place.identity(WATCHER), "sim", TRUTH)
    arm = place.connecting("arm", place.identity("arm"), "sim", TRUTH, ARM_STATE)
    z = np.zeros(6)

    def send(k: int) -> None:
        three = np.zeros(3)
        sim.publish(ARM_STATE, ArmState(0.001 * k, z, z, z, z))
        sim.publish(TRUTH, Truth(0.001 * k, three, three, three, z, z, three, 0.0))

    assert heard(watcher, TRUTH, send, PATIENCE)
    inbox, k = Inbox([TRUTH, ARM_STATE]), itertools.count(LAST)

    def state() -> bool:
        send(next(k))
        arm.drain(inbox, None)
        return inbox.latest(ARM_STATE) is not None

    until(state, "the state of the arm")
    assert inbox.latest(TRUTH) is None


class _Stirred:
    """A service that counts what it is asked for."""

    name = "sim"
    period = 0.001
    inputs: tuple[Topic, ...] = ()
    verbs = ("stir",)

    def __init__(self) -> None:
        self.stirred = 0

    def step(self, now: float, inbox: Inbox) -> list[tuple[Topic, ArmCommand]]:
        return []

    def prepare(self, verb: str, args: dict[str, object]) -> Callable[[], Reply]:
        def stir() -> Reply:
            self.stirred += 1
            return Reply(True)

        return stir

    def state(self) -> tuple[str, str]:
        return "running", ""


def test_only_an_operator_is_answered(place: Place) -> None:
    """A watcher's and another service's requests do not even reach the service."""
    import threading

    sim, service = place.listening("sim"), _Stirred()
    requests, done = Requests(sim.session, "r1", service, PATIENCE), threading.Event()  # type: ignore[arg-type]

    def loop() -> None:
        while not done.wait(0.005):
            requests.run_pending(0.0)

    thread = threading.Thread(target=loop)
    thread.start()
    try:
        operator = place.connecting("tool", place.identity(OPERATOR), "sim")
        assert ask(operator.session, "r1", "sim", "stir", {}, PATIENCE).accepted
        for role in (WATCHER, "base"):
            stranger = place.connecting("tool", place.identity(role), "sim")
            _connected(stranger)
            with pytest.raises(NoAnswer):
                ask(stranger.session, "r1", "sim", "stir", {}, 1.0)
        assert service.stirred == 1
    finally:
        done.set()
        thread.join()
        requests.close()


def test_what_is_too_long_never_reaches_us(place: Place) -> None:
    """Whoever may speak may still not fill our memory: 64 kB is dropped, short junk is counted."""
    sim = place.listening("sim", ARM_COMMAND)
    arm = place.connecting("arm", place.identity("arm"), "sim")
    met(sim, arm)
    blocks = zenoh.CongestionControl.BLOCK  # nothing is dropped on our side
    publisher = arm.session.declare_publisher("r1/arm/command", congestion_control=blocks)
    for size in (LARGEST + 1, 1 << 20, 8 << 20):
        publisher.put(b"\x00" * size)
    for junk in (b"", b"\xc1", b"\x83\xa4from", bytes(1000)):
        publisher.put(junk)
    inbox = Inbox([ARM_COMMAND])

    def refused() -> bool:
        assert not sim.drain(inbox, None)
        return sum(sim.refused.values()) >= 4

    until(refused, "the refusal of all junk")
    assert sum(sim.refused.values()) == 4
    assert not any("size" in reason for reason in sim.refused)
    assert heard(sim, ARM_COMMAND, speaks(arm, ARM_COMMAND, "arm"), PATIENCE)


def _connected(bus: Bus) -> None:
    until(lambda: list(bus.session.info.peers_zid()), "a session")
    time.sleep(0.2)  # for what each tells the other about itself
