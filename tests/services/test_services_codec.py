"""Whatever arrives is either a message that a robot could have meant, or refused with a reason."""

from __future__ import annotations

from typing import Any

import msgpack
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from service_toys import TOYS

from services import messages as m
from services import topics
from services.messages import BadMessage
from services.service import Inbox
from services.wire.codec import LARGEST, decode, encode

GOOD = m.Odometry(1.5, np.array([1.0, -2.0, 0.25]))


def _wire(**changes: Any) -> bytes:
    body: dict[str, Any] = {"t": 1.5, "pose": [1.0, -2.0, 0.25]}
    envelope: dict[str, Any] = {"from": "sim", "seq": 3, "body": body}
    body |= {k: v for k, v in changes.items() if k not in envelope}
    envelope |= {k: v for k, v in changes.items() if k in envelope}
    return msgpack.packb(envelope)


def _refusal(payload: bytes, topic: topics.Topic = topics.ODOMETRY) -> str:
    with pytest.raises(BadMessage) as caught:
        decode(topic, payload)
    return caught.value.reason


@pytest.mark.parametrize("name", TOYS)
def test_what_is_sent_is_what_is_read(name: str) -> None:
    """Every message comes back with the same numbers, to the last bit."""
    toy = TOYS[name](7)
    for topic, message in toy.step(0.1, Inbox(toy.inputs)):
        seq, back = decode(topic, encode(name, 5, message))
        assert seq == 5
        assert encode(name, 5, back) == encode(name, 5, message)


@pytest.mark.parametrize(
    ("reason", "payload"),
    [
        ("truncated", encode("sim", 1, GOOD)[:-5]),
        ("truncated", b""),
        ("undecodable", b"\xc1"),
        ("undecodable", encode("sim", 1, GOOD) + b"x"),
        ("size", b"\x00" * (LARGEST + 1)),
        ("envelope", msgpack.packb([1, 2, 3])),
        ("envelope", msgpack.packb({"from": "sim", "seq": 1})),
        ("envelope", _wire(seq=-1)),
        ("envelope", _wire(seq=True)),
        ("envelope", _wire(seq=1.5)),
        ("envelope", _wire(body=[1])),
        ("owner", _wire(**{"from": "base"})),
        ("owner", _wire(**{"from": None})),
        ("shape", _wire(pose=[1.0, 2.0])),
        ("shape", _wire(pose=[[1.0, 2.0, 3.0]])),
        ("shape", _wire(pose=1.0)),
        ("type", _wire(pose="abc")),
        ("type", _wire(pose=[1.0, [2.0], 3.0])),
        ("type", _wire(t="now")),
        ("type", _wire(t=True)),
        ("non-finite", _wire(pose=[1.0, float("nan"), 0.0])),
        ("non-finite", _wire(pose=[1.0, float("inf"), 0.0])),
        ("non-finite", _wire(t=float("nan"))),
        ("range", _wire(pose=[1e6, 0.0, 0.0])),
        ("range", _wire(t=-1.0)),
        ("fields", _wire(surprise=1)),
        ("fields", _wire(body={"t": 1.0})),
    ],
)
def test_each_kind_of_bad_message_has_its_reason(reason: str, payload: bytes) -> None:
    """Truncated, undecodable, wrong shape, not finite, out of range, foreign: all told apart."""
    assert _refusal(payload) == reason


@pytest.mark.parametrize(
    ("reason", "field", "value"),
    [
        ("type", "votes", {"line": "left"}),
        ("type", "votes", {"line": [1.0, "x"]}),
        ("type", "votes", [1.0]),
        ("non-finite", "votes", {"line": [float("nan")]}),
        ("type", "state", 5),
    ],
)
def test_containers_are_checked_inside(reason: str, field: str, value: Any) -> None:
    """A number that is none is found however deep it is."""
    status = m.BaseStatus(1.0, "x", "", {"line": [1.0]}, np.zeros(3))
    wire = msgpack.unpackb(encode("base", 1, status))
    wire["body"][field] = value
    assert _refusal(msgpack.packb(wire), topics.BASE_STATUS) == reason


@given(st.binary(max_size=200))
def test_no_bytes_raise_anything_else(payload: bytes) -> None:
    """Random bytes are refused, never a crash."""
    _refusal(payload)


@given(st.data())
def test_no_mutilated_message_raises_anything_else(data: st.DataObject) -> None:
    """A message with bytes changed is read or refused, never a crash."""
    payload = bytearray(encode("sim", 9, GOOD))
    for _ in range(data.draw(st.integers(1, 4))):
        payload[data.draw(st.integers(0, len(payload) - 1))] = data.draw(st.integers(0, 255))
    try:
        decode(topics.ODOMETRY, bytes(payload))
    except BadMessage as error:
        assert error.reason


@pytest.mark.parametrize(("joints", "cells"), [(6, 1), (14, 2)])
def test_an_arm_state_tells_whose_it_is(joints: int, cells: int) -> None:
    """One arm's or two arms' come through the wire; each fits its own robot alone."""
    n = np.zeros(joints)
    state = m.ArmState(1.0, n, n, n, np.zeros(6 * cells))
    _, back = decode(topics.ARM_STATE, encode("sim", 1, state))
    assert back.of(joints, cells)
    assert not back.of(20 - joints, 3 - cells)
    assert not m.ArmState(1.0, n, n[1:], n, np.zeros(6 * cells)).of(joints, cells)
    _, command = decode(topics.ARM_COMMAND, encode("arm", 1, m.ArmCommand(1.0, n)))
    assert command.of(joints) and not command.of(20 - joints)


def test_truth_names_bodies_and_refuses_what_is_no_number() -> None:
    """Poses by name survive the wire; text in one does not."""
    zero, six = np.zeros(3), np.zeros(6)
    truth = m.Truth(
        1.0, zero, zero, zero, six, six, zero, 0.0,
        bodies={"box": [0.0, 0.0, 0.8, 1.0, 0.0, 0.0, 0.0]},
    )  # fmt: skip
    payload = encode("sim", 1, truth)
    assert decode(topics.TRUTH, payload)[1].bodies == truth.bodies
    envelope = msgpack.unpackb(payload)
    envelope["body"]["bodies"]["box"][0] = "left"
    assert _refusal(msgpack.packb(envelope), topics.TRUTH) == "type"
