"""Programs broken at random: the checker never crashes, and what it passes runs.

``tests/arm/hds/fuzz.py`` judges as many as one likes.
"""

import os

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from arm.hds import Registry
from tests.arm.hds.fuzz import TOKEN, judge, judge_all, mutate

_OPERATION = st.sampled_from(["delete", "duplicate", "swap", "replace"])


def test_mutants_of_good_programs_are_refused_or_run() -> None:
    """One token or line deleted, doubled or swapped, in every good program there is."""
    count = int(os.environ.get("FUZZ", "400"))
    verdicts = judge_all(count, int(os.environ.get("SEED", "1")))
    print(dict(verdicts))
    assert verdicts["refused"] > 0.6 * count and verdicts["valid"] > 0.05 * count, verdicts


@pytest.mark.parametrize("unit", ["token", "line"])
@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_mutants_never_crash_and_what_passes_runs(
    unit: str, good: str, types: Registry, data: st.DataObject
) -> None:
    """Up to three deletions, doublings, swaps or replacements of tokens or lines."""
    pieces = TOKEN.findall(good) if unit == "token" else good.splitlines(keepends=True)
    for _ in range(data.draw(st.integers(1, 3))):
        operation = data.draw(_OPERATION)
        where, other = data.draw(st.integers(0, 500)), data.draw(st.integers(0, 500))
        pieces = mutate(pieces, operation, where, other)
    judge("".join(pieces), "mutant.hds", types, seed=len(pieces))


@settings(max_examples=60, deadline=None)
@given(text=st.text(max_size=200), where=st.integers(0, 1000))
def test_any_text_is_judged(text: str, where: int, good: str, types: Registry) -> None:
    """Arbitrary text, alone or dropped into a program, gives findings or a program, no crash."""
    judge(text, "mutant.hds", types, seed=0)
    judge(good[:where] + text + good[where:], "mutant.hds", types, seed=0)


def test_every_single_deletion_and_doubling(good: str, types: Registry) -> None:
    """All programs one token away are judged; nearly all are refused, the rest run."""
    pieces = TOKEN.findall(good)
    passed = 0
    for i, piece in enumerate(pieces):
        if not piece.strip() or piece.startswith("%"):
            continue
        judge("".join(mutate(pieces, "duplicate", i, i)), "mutant.hds", types, seed=i)
        passed += judge("".join(mutate(pieces, "delete", i, i)), "mutant.hds", types, seed=i)
    assert passed <= 4  # dropping the decimals or the sign of a number may leave a good program
