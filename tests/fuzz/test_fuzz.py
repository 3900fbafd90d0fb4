"""Whatever the bytes are, a reader reads them or refuses them with its own error.

``python tests/fuzz/fuzz.py TARGET --seconds 600`` looks for more; what it finds stays in
``corpus``.
"""

from __future__ import annotations

import os
import random
from pathlib import Path
from typing import Any

import msgpack
import pytest
from fuzz import broken, judge
from hypothesis import given, settings
from hypothesis import strategies as st
from targets import CORPUS, targets

from services.messages import BadMessage
from services.topics import TOPICS
from services.wire.codec import decode, encode

TARGETS = targets()
FOUND = sorted(path for path in CORPUS.glob("*/*") if path.parent.name in TARGETS)
COUNT = int(os.environ.get("FUZZ", "300"))
SEED = int(os.environ.get("SEED", "1"))
SLOW_READERS = {"program": 30, "scenario": 6, "hosts": 6, "log": 3}


@pytest.mark.parametrize("path", FOUND, ids=[f"{p.parent.name}-{p.name}" for p in FOUND])
def test_what_was_found_once_stays_refused(path: Path) -> None:
    """Every input that once broke a reader."""
    assert judge(TARGETS[path.parent.name], path.read_bytes()) in ("read", "refused")


@pytest.mark.parametrize("name", TARGETS)
def test_seeds_are_good(name: str) -> None:
    """Otherwise breaking them says nothing."""
    assert [judge(TARGETS[name], seed) for seed in TARGETS[name].seeds()].count("read") >= 1


@pytest.mark.parametrize("name", TARGETS)
def test_broken_inputs_are_read_or_refused(name: str) -> None:
    """Bits, bytes, pieces and words of good inputs changed at random."""
    rng, target = random.Random(SEED), TARGETS[name]
    seeds = list(target.seeds())
    for _ in range(max(10, COUNT // SLOW_READERS.get(name, 1))):
        data = broken(rng.choice(seeds), seeds, rng)
        assert judge(target, data) in ("read", "refused"), data


_LEAVES = (
    st.none()
    | st.booleans()
    | st.integers(-(1 << 63), (1 << 64) - 1)
    | st.floats()
    | st.text(max_size=8)
    | st.binary(max_size=8)
    | st.builds(msgpack.ExtType, st.integers(0, 127), st.binary(max_size=8))
)
_VALUES = st.recursive(
    _LEAVES,
    lambda inner: st.lists(inner, max_size=7) | st.dictionaries(st.text(max_size=8), inner),
    max_leaves=20,
)


@settings(max_examples=max(60, COUNT // 4), deadline=None)
@given(data=st.data())
def test_any_value_in_any_field_is_a_message_or_refused(data: st.DataObject) -> None:
    """The envelope is right, a field holds anything; what is accepted can be sent on as it is."""
    topic = data.draw(st.sampled_from(list(TOPICS.values())))
    names = list(topic.type.__dataclass_fields__)
    body: dict[str, Any] = {name: data.draw(_VALUES) for name in names}
    payload = msgpack.packb({"from": topic.owner, "seq": 1, "body": body})
    try:
        _, message = decode(topic, payload)
    except BadMessage:
        return
    assert decode(topic, encode(topic.owner, 1, message))[0] == 1
