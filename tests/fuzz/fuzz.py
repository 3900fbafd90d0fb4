"""Coverage-guided fuzzing: ``python tests/fuzz/fuzz.py wire --seconds 600 --seed 1``.

An input that takes a new way through the reader's code is kept and broken further (the idea of
AFL, M. Zalewski; here the ways are lines of Python). An input that makes the reader raise anything
but its refusal, or think for more than ``SLOW``, goes to ``corpus/<target>/`` and is a test from
then on.
"""

from __future__ import annotations

import argparse
import hashlib
import random
import sys
import time
from collections.abc import Iterator
from types import FrameType
from typing import Any

from targets import CORPUS, Target, targets

SLOW = 5.0  # [s]
_LONGEST = 20_000  # [bytes]
_WORDS = (
    b"\xc1", b"\xdd\xff\xff\xff\xff", b"\xdf\xff\xff\xff\xff", b"\xca\x7f\xc0\x00\x00", b"\xc0",
    b"\xcf" + b"\xff" * 8, b"\x91" * 600, b"\xc7\x0c\xff" + bytes(12), b"\xd4\x01\x00", b"\x80",
    b"nan", b"inf", b"-1", b"1e999", b"[[", b'"' * 3, b"\x00", b"\xff\xfe", b"[" * 600, b"=",
    b"\n[world]\n", b"\nEND\n", b";", b"0x", b"9" * 400, "é".encode(), b"{", b"1" * 5000,
)  # fmt: skip


def broken(data: bytes, others: list[bytes], rng: random.Random) -> bytes:
    """One to four faults: bits, bytes, pieces, words, or half of another input."""
    out = bytearray(data)
    for _ in range(rng.randint(1, 4)):
        at, end = sorted((rng.randint(0, len(out)), rng.randint(0, len(out))))
        end = min(end, at + 200)
        fault = rng.randrange(7)
        if fault == 0 and out:
            out[min(at, len(out) - 1)] ^= 1 << rng.randrange(8)
        elif fault == 1 and out:
            out[min(at, len(out) - 1)] = rng.randrange(256)
        elif fault == 2:
            del out[at:end]
        elif fault == 3:
            out[at:at] = out[at:end]
        elif fault == 4:
            out[at:at] = rng.choice(_WORDS)
        elif fault == 5:
            out[at:end] = rng.choice(_WORDS)
        else:
            other = rng.choice(others)
            cut = rng.randint(0, len(other))
            out[at:] = other[cut:]
    return bytes(out[:_LONGEST])


class Coverage:
    """Lines of the reader's own code that ran, while it is the trace function."""

    def __init__(self, covers: tuple[str, ...]) -> None:
        self._covers = covers
        self._ours: dict[str, bool] = {}
        self.seen: set[tuple[str, int]] = set()

    def __call__(self, frame: FrameType, event: str, arg: Any) -> Any:
        """Called on every call; traces lines of our files only."""
        name = frame.f_code.co_filename
        ours = self._ours.get(name)
        if ours is None:
            ours = self._ours[name] = any(part in name for part in self._covers)
        return self._line if ours else None

    def _line(self, frame: FrameType, event: str, arg: Any) -> Any:
        self.seen.add((frame.f_code.co_filename, frame.f_lineno))
        return self._line


def judge(target: Target, data: bytes) -> str:
    """``read``, ``refused``, or what is wrong with the reader."""
    start = time.process_time()
    try:
        target.read(data)
        verdict = "read"
    except target.refuses:
        verdict = "refused"
    except Exception as error:
        return f"{type(error).__name__}: {error}"
    took = time.process_time() - start
    return verdict if took < SLOW else f"took {took:.1f} s"


def hunt(
    target: Target, seconds: float, rng: random.Random, count: int | None = None
) -> Iterator[tuple[bytes, str]]:
    """Break inputs until the time or the count is over; yields inputs and what they brought out."""
    pool = list(target.seeds())
    coverage, deadline, done = Coverage(target.covers), time.monotonic() + seconds, 0
    known = 0
    while time.monotonic() < deadline and (count is None or done < count):
        data = broken(rng.choice(pool), pool, rng)
        done += 1
        sys.settrace(coverage)
        try:
            verdict = judge(target, data)
        finally:
            sys.settrace(None)
        if len(coverage.seen) > known:
            known = len(coverage.seen)
            pool.append(data)
        if verdict not in ("read", "refused"):
            yield data, verdict
    print(f"{done} inputs, {len(pool)} kept, {known} lines reached")


def main() -> None:
    """The command line."""
    known = targets()
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("target", choices=sorted(known))
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    found: set[str] = set()
    for data, verdict in hunt(known[options.target], options.seconds, random.Random(options.seed)):
        if verdict[:40] in found:
            continue
        found.add(verdict[:40])
        folder = CORPUS / options.target
        folder.mkdir(parents=True, exist_ok=True)
        path = folder / hashlib.sha256(data).hexdigest()[:12]
        path.write_bytes(data)
        print(f"{path}: {verdict[:200]}")
    sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()
