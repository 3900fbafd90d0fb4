"""The bus over real Zenoh sessions: checked, counted, never raising, never waiting."""

from __future__ import annotations

import itertools
import threading
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pytest
import zenoh
from patience import PATIENCE, until

from services import topics
from services.messages import ArmState, Message, Odometry
from services.service import Inbox
from services.topics import ARM_STATE, ODOMETRY, Topic, key
from services.wire.bus import RING, Bus, open_bus
from services.wire.codec import decode, encode
from services.wire.endpoints import (
    BadEndpoint,
    Endpoints,
    check_open,
    config,
    local,
    make_run_dir,
)


def odometry(t: float) -> Odometry:
    """A message."""
    return Odometry(t, np.array([t, 0.0, 0.0]))


def arm_state(t: float) -> ArmState:
    """A message."""
    return ArmState(t, np.full(6, 0.1), np.zeros(6), np.zeros(6), np.zeros(6))


class Pair:
    """A robot that speaks, a reader that hears, and a local clock the test moves."""

    def __init__(self, stack: ExitStack, run_dir: Path) -> None:
        self.local = 0.0
        self.inbox = Inbox([ODOMETRY, ARM_STATE])
        self.sim = stack.enter_context(open_bus(local(run_dir, "sim"), "r1", "sim"))
        self.arm: Bus = stack.enter_context(
            open_bus(
                local(run_dir, "arm"), "r1", "arm", [ODOMETRY, ARM_STATE], clock=lambda: self.local
            )
        )
        self.sim.declare(ODOMETRY, ARM_STATE)

        times = itertools.count()
        until(lambda: self._say(next(times)) or self._heard(0), "each other")
        last = next(times)  # when it is heard nothing older is on its way any more
        self._say(last)
        until(lambda: self._heard(last), "the last of it")
        self.inbox.new(ODOMETRY)
        self.local += 1000.0  # whatever was heard is long ago

    def _say(self, t: float) -> None:
        self.sim.publish(ODOMETRY, odometry(t))
        self.sim.publish(ARM_STATE, arm_state(t))

    def _heard(self, t: float) -> bool:
        """Whether something of instant ``t`` or later was heard on both topics."""
        self.arm.drain(self.inbox, None)
        newest = (self.inbox.latest(ODOMETRY), self.inbox.latest(ARM_STATE))
        return all(message is not None and message.t >= t for message in newest)

    def raw(self, topic: Topic, payload: bytes) -> None:
        """Put bytes on the network, and see them arrive."""
        slot = self.arm._readers[topic.name].slot
        before = len(slot)
        self.sim.session.put(key("r1", topic), payload)
        until(lambda: len(slot) > before or len(slot) == RING, "its arrival", every=0.005)

    def hear(self, now: float | None) -> list[Message]:
        """What the reader accepts."""
        return [message for _, message, _ in self.arm.drain(self.inbox, now)]


@pytest.fixture
def pair(tmp_path: Path) -> Iterator[Pair]:
    """Two sessions that have met."""
    with ExitStack() as stack:
        yield Pair(stack, tmp_path)


def test_a_stray_publisher_is_counted_and_does_no_harm(pair: Pair) -> None:
    """Garbage, foreign and impossible messages leave the good one among them untouched."""
    good = encode("sim", 10, odometry(5.0))
    for payload in (
        b"\xc1garbage",
        good[:-3],
        encode("base", 11, odometry(5.0)),
        good,
        encode("sim", 12, odometry(float("nan"))),
        encode("sim", 13, Odometry(5.0, np.full(3, 1e8))),
        encode("sim", 14, Odometry(5.0, np.zeros(4))),
    ):
        pair.raw(ODOMETRY, payload)
    assert [m.t for m in pair.hear(5.0)] == [5.0]
    assert dict(pair.arm.refused) == {
        f"robot/odometry: {reason}": 1
        for reason in ("undecodable", "truncated", "owner", "non-finite", "range", "shape")
    }


def test_garbage_does_not_push_a_good_latest_value_out(pair: Pair) -> None:
    """A latest-value topic keeps a few payloads and uses the newest good one."""
    pair.raw(ARM_STATE, encode("sim", 10, arm_state(5.0)))
    for _ in range(RING - 1):
        pair.raw(ARM_STATE, b"noise")
    assert [m.t for m in pair.hear(5.0)] == [5.0]


def test_duplicates_and_stale_messages_are_refused(pair: Pair) -> None:
    """What was used already, or is older than that, is not used again."""
    pair.raw(ODOMETRY, encode("sim", 10, odometry(5.0)))
    pair.raw(ODOMETRY, encode("sim", 10, odometry(5.0)))
    pair.raw(ODOMETRY, encode("sim", 9, odometry(4.9)))
    pair.raw(ARM_STATE, encode("sim", 10, arm_state(5.0)))
    assert len(pair.hear(5.0)) == 2
    pair.raw(ARM_STATE, encode("sim", 11, arm_state(5.0)))
    pair.raw(ODOMETRY, encode("sim", 10, odometry(5.0)))
    assert pair.hear(5.0) == []
    assert dict(pair.arm.refused) == {
        "robot/odometry: duplicate": 2,
        "robot/odometry: stale": 1,
        "robot/arm_state: stale": 1,
    }


def test_a_backlog_and_a_foreign_time_are_refused(pair: Pair) -> None:
    """Far behind now is a backlog, far ahead of it is not our robot's time."""
    pair.raw(ODOMETRY, encode("sim", 10, odometry(3.0)))
    assert pair.hear(5.0) == []
    pair.raw(ODOMETRY, encode("sim", 11, odometry(5.0)))
    pair.raw(ODOMETRY, encode("sim", 12, odometry(50.0)))
    assert [m.t for m in pair.hear(5.0)] == [5.0]
    assert dict(pair.arm.refused) == {"robot/odometry: old": 1, "robot/odometry: future": 1}


def test_a_restarted_owner_is_believed_after_silence(pair: Pair) -> None:
    """Numbers that begin anew are accepted once the owner was silent for the age limit."""
    pair.raw(ODOMETRY, encode("sim", 1000, odometry(5.0)))
    assert len(pair.hear(5.0)) == 1
    pair.raw(ODOMETRY, encode("sim", 0, odometry(5.1)))
    assert pair.hear(5.1) == []
    pair.local += ODOMETRY.age_limit + 0.01
    pair.raw(ODOMETRY, encode("sim", 1, odometry(5.9)))
    assert [m.t for m in pair.hear(5.9)] == [5.9]


def test_a_restarted_bus_counts_on_from_above(tmp_path: Path) -> None:
    """A new process' numbers are above its predecessor's, so it need not wait to be believed."""
    with open_bus(local(tmp_path, "sim"), "r1", "sim") as bus:
        first = [bus.publish(ODOMETRY, odometry(1.0)) for _ in range(100)][-1]
    with open_bus(local(tmp_path, "sim"), "r1", "sim") as bus:
        assert bus.publish(ODOMETRY, odometry(1.0)) > first


def test_gaps_are_counted(pair: Pair) -> None:
    """Messages lost on the way are known to be lost."""
    pair.raw(ODOMETRY, encode("sim", 10, odometry(5.0)))
    pair.raw(ODOMETRY, encode("sim", 14, odometry(5.0)))
    pair.hear(5.0)
    assert dict(pair.arm.lost) == {"robot/odometry": 3}


def test_nobody_publishes_what_is_not_theirs(pair: Pair) -> None:
    """A service cannot speak for another by mistake, nor the wrong message."""
    with pytest.raises(ValueError, match="sim's; arm may not"):
        pair.arm.publish(ODOMETRY, odometry(1.0))
    with pytest.raises(ValueError, match="takes Odometry"):
        pair.sim.publish(ODOMETRY, arm_state(1.0))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "endpoint",
    ["tcp/0.0.0.0:7447", "tcp/[::]:7447", "tcp/192.168.1.5:7447", "tcp/robot:7447",
     "udp/127.0.0.1:1", "quic/0.0.0.0:1", "", "serial//dev/ttyS0"],
)  # fmt: skip
def test_no_listener_beyond_this_machine(endpoint: str) -> None:
    """Opening the robot to the network is refused, with what to do instead."""
    with pytest.raises(BadEndpoint, match="mutual TLS"):
        config(Endpoints((endpoint,), ()))


@pytest.mark.parametrize(
    "endpoint",
    ["tcp/127.0.0.1:7447", "tcp/[::1]:7447", "tcp/localhost:1", "unixsock-stream/x.sock"],
)
def test_listeners_on_this_machine_are_fine(endpoint: str) -> None:
    """Loop-back and unix sockets."""
    check_open((endpoint,))


def test_run_directory_is_closed_to_others(tmp_path: Path) -> None:
    """Whoever may connect may move the arm; a name too long for sockets is refused early."""
    assert make_run_dir(tmp_path / "a" / "b").stat().st_mode & 0o077 == 0
    with pytest.raises(BadEndpoint, match="too long"):
        make_run_dir(tmp_path / ("x" * 120))
    public = tmp_path / "public"
    public.mkdir()
    public.chmod(0o777)
    with pytest.raises(BadEndpoint, match=f"{public} belongs to somebody else or others may write"):
        make_run_dir(public / "mine")
    public.chmod(0o1777)  # as /tmp: nobody replaces what is another's
    make_run_dir(public / "mine")


def test_every_topic_has_one_owner_and_a_key() -> None:
    """The table is consistent: names are keys, owners are services."""
    for name, topic in topics.TOPICS.items():
        assert topic.name == name
        assert topic.owner in (*topics.PROCESSES, topics.CONSOLE)


def test_who_comes_first_waits_for_who_comes_later(tmp_path: Path) -> None:
    """A process that only connects meets one that listens later, and meets it again."""
    with zenoh.open(config(local(tmp_path))) as first:
        for _ in range(2):
            with zenoh.open(config(Endpoints(local(tmp_path, "sim").listen, ()))):
                until(lambda: list(first.info.peers_zid()), "the other")
            until(lambda: not list(first.info.peers_zid()), "its end")


@pytest.mark.processes
def test_a_reader_that_is_kept_waiting_loses_nothing(tmp_path: Path) -> None:
    """A second of joint states, more than a socket holds, waits at the sender and comes in turn."""
    go_on, heard = threading.Event(), list[int]()
    go_on.set()

    def slow(sample: zenoh.Sample) -> None:
        go_on.wait(PATIENCE)
        heard.append(decode(ARM_STATE, sample.payload.to_bytes())[0])

    with (
        open_bus(local(tmp_path, "sim"), "r1", "sim") as sim,
        zenoh.open(config(local(tmp_path, "recorder"))) as reader,
    ):
        reader.declare_subscriber(
            key("r1", ARM_STATE), zenoh.handlers.Callback(slow, indirect=False)
        )
        until(lambda: sim.publish(ARM_STATE, arm_state(0.0)) and heard, "each other")
        go_on.clear()
        sent = [sim.publish(ARM_STATE, arm_state(1e-3 * k)) for k in range(1000)]
        go_on.set()
        until(lambda: heard[-1] == sent[-1], "the last of it", patience=60.0)
    assert heard[-len(sent) :] == sent
