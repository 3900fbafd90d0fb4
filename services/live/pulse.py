"""A loop's pulse: a datagram from inside it to the supervisor of its machine, past the bus.

A heartbeat over the bus waits for the bus' threads, here and there, and its figures cost the loop
time. A pulse says only that the loop goes round. The kernel has it when ``beat`` returns.
"""

from __future__ import annotations

import socket
from contextlib import suppress
from pathlib import Path

PERIOD = 0.05  # [s]
_LONGEST = 32  # [bytes]


class Pulse:
    """The loop's side: never waits, never raises, and does nothing where nobody listens.

    Args:
        run_dir: of the supervisor.
        pid: whose pulse it is.
    """

    def __init__(self, run_dir: Path, pid: int) -> None:
        self._to, self._said = str(_address(run_dir)), str(pid).encode()
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK)
        self._next = 0.0

    def beat(self, now: float) -> None:
        """Say so if it is time to.

        Args:
            now: local monotonic time [s].
        """
        if now < self._next:
            return
        self._next = now + PERIOD
        with suppress(OSError):  # nobody listens, or it has not listened to those before
            self._socket.sendto(self._said, self._to)


class Pulses:
    """The supervisor's side, closed at the end of a ``with``.

    Args:
        run_dir: its own, with nobody else's supervisor in it.
    """

    def __init__(self, run_dir: Path) -> None:
        address = _address(run_dir)
        address.unlink(missing_ok=True)
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK)
        self._socket.bind(str(address))

    def heard(self) -> set[int]:
        """Process ids of those whose loops went round since the last call."""
        pids = set()
        with suppress(BlockingIOError):
            while True:
                said = self._socket.recv(_LONGEST)
                if said.isdigit():
                    pids.add(int(said))
        return pids

    def __enter__(self) -> Pulses:
        return self

    def __exit__(self, *_: object) -> None:
        self._socket.close()


def _address(run_dir: Path) -> Path:
    return run_dir / "pulse"
