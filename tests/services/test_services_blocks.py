"""Fast topics in blocks: every message, in order, as if it had come alone, and far fewer sends."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from patience import until

from services.messages import ArmState, BadMessage
from services.service import Inbox
from services.topics import ARM_STATE, ODOMETRY, TOPICS, block_key
from services.wire.blocks import BLOCK, MOST, Blocks, pack, unpack
from services.wire.bus import open_bus
from services.wire.endpoints import local, make_run_dir


@given(st.lists(st.tuples(st.floats(0.0, 9.0), st.binary(max_size=50)), max_size=MOST))
@settings(deadline=None, max_examples=50, derandomize=True)
def test_what_is_packed_comes_out_with_when_it_would_have_come_alone(
    messages: list[tuple[float, bytes]],
) -> None:
    """Whatever the clocks of the two hosts say."""
    out = unpack(pack(messages, 10.0), 510.0)
    assert [payload for payload, _ in out] == [payload for _, payload in messages]
    np.testing.assert_allclose([at for _, at in out], [500.0 + at for at, _ in messages])


def test_a_block_that_was_late_does_not_put_messages_out_of_order() -> None:
    """The next one's begin no sooner than its last."""
    late = unpack(pack([(0.00, b"a"), (0.01, b"b")], 0.02), 5.05)
    after = unpack(pack([(0.02, b"c"), (0.04, b"d")], 0.04), 5.04, late[-1][1])
    np.testing.assert_allclose([at for _, at in late + after], [5.03, 5.04, 5.04, 5.04])


@pytest.mark.parametrize(
    "junk",
    [b"", b"\xc1", b"\x93\x01\x02\x03", pack([(11.0, b"")], 10.0), pack([(0.0, b"")] * 300, 1.0)],
    ids=["empty", "not packed", "no pairs", "of the future", "too many"],
)
def test_junk_is_refused_in_one_word(junk: bytes) -> None:
    """It never raises anything else."""
    with pytest.raises(BadMessage, match=r"^block: "):
        unpack(junk, 10.0)


class Session:
    """Remembers what was put where."""

    def __init__(self) -> None:
        self.put: list[tuple[str, bytes]] = []

    def declare_publisher(self, where: str, **_: Any) -> Any:
        """One that puts into the list."""
        return type(
            "Publisher", (), {"put": lambda _, payload: self.put.append((where, payload))}
        )()


def test_a_block_waits_no_longer_than_it_should_and_goes_with_any_topic() -> None:
    """At 1 kHz, fifty blocks a second; and what a topic that falls silent said is sent as well."""
    session, now = Session(), 0.0
    blocks = Blocks(session, "r1", lambda: now)  # type: ignore[arg-type]
    for tick in range(1000):
        now = 0.001 * tick
        blocks.add(ARM_STATE, b"%d" % tick)
    assert 45 <= len(session.put) <= 50
    assert {where for where, _ in session.put} == {block_key("r1", ARM_STATE)}
    now += BLOCK
    blocks.add(ODOMETRY, b"not of the fast ones")
    said = [payload for _, block in session.put for payload, _ in unpack(block, now)]
    assert said == [b"%d" % tick for tick in range(1000)]


def test_only_fast_control_topics_come_in_blocks() -> None:
    """Of which there are few: the others wake nobody often."""
    fast = {topic.name for topic in TOPICS.values() if topic.in_blocks}
    assert {"robot/arm_state", "arm/command", "observer/estimate"} <= fast
    assert len(fast) == 5


def test_a_reader_in_blocks_hears_all_and_others_hear_each(tmp_path: Path) -> None:
    """Over Zenoh: nothing missing, in order, and as far apart as they were sent."""
    run_dir = make_run_dir(tmp_path / "r")
    whole = replace(ARM_STATE, depth=20_000)
    with (
        open_bus(local(run_dir, "sim"), "r1", "sim") as sim,
        open_bus(local(run_dir, "arm"), "r1", "arm", [ARM_STATE]) as arm,
        open_bus(
            local(run_dir, "recorder"), "r1", "recorder", [whole], lossless=True, in_blocks=True
        ) as recorder,
    ):
        inbox = Inbox([ARM_STATE])
        heard: list[tuple[float, float]] = []
        count = 0

        def say() -> None:
            nonlocal count
            count += 1
            zero = np.zeros(6)
            sim.publish(ARM_STATE, ArmState(float(count), zero, zero, zero, zero))

        def both() -> bool:
            say()
            arm.drain(inbox, None)
            heard.extend((at, message.t) for _, message, at in recorder.drain(Inbox([whole]), None))
            return bool(heard) and inbox.latest(ARM_STATE) is not None

        until(both, "each other", every=0.005)
        for _ in range(100):
            time.sleep(0.002)
            say()
        sim.flush()

        def all_heard() -> bool:
            heard.extend((at, message.t) for _, message, at in recorder.drain(Inbox([whole]), None))
            return heard[-1][1] == count

        until(all_heard, "the last one")
        at, t = np.array(heard).T
        np.testing.assert_array_equal(np.diff(t), 1.0)
        assert not recorder.lost and not recorder.refused
        assert np.median(np.diff(at[-100:])) > 0.001  # not all at once, as their blocks came
