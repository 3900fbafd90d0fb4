"""A bad network in software, for kernels without netem: packets wait, jitter and are lost.

Each host's namespace gets a TUN device as its only link. One thread reads what the hosts send,
draws each packet's fate and delay, and hands it to the host it is addressed to when it is due.
Packets may overtake each other, as with netem.
"""

from __future__ import annotations

import ctypes
import fcntl
import heapq
import os
import select
import socket
import struct
import threading
import time
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from deploy.host_file import Link

_TUNSETIFF, _IFF_TUN, _IFF_NO_PI = 0x400454CA, 0x0001, 0x1000
_CLONE_NEWNET = 0x40000000
_DESTINATION = slice(16, 20)  # in an IPv4 header
_LONGEST = 65536  # [bytes]


def open_tun(namespace: str, device: str) -> int:
    """File of the packets of a new TUN device in a namespace; closing it removes the device.

    Raises:
        OSError: not permitted, or no such namespace.
    """
    out: list[int | OSError] = []

    def enter() -> None:  # only this thread moves into the namespace
        try:
            with Path(f"/run/netns/{namespace}").open("rb") as file:
                libc = ctypes.CDLL(None, use_errno=True)
                if libc.setns(file.fileno(), _CLONE_NEWNET) != 0:
                    raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))
            tun = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK)
            request = struct.pack("16sH22x", device.encode(), _IFF_TUN | _IFF_NO_PI)
            fcntl.ioctl(tun, _TUNSETIFF, request)
            out.append(tun)
        except OSError as error:
            out.append(error)

    thread = threading.Thread(target=enter)
    thread.start()
    thread.join()
    if isinstance(out[0], OSError):
        raise out[0]
    return out[0]


class Switch:
    """Carries packets between TUN devices, badly.

    Args:
        files: address of each host to the file of its packets; closed at the end.
        link: what happens to each packet.
        seed: of what is drawn.
    """

    def __init__(self, files: Mapping[str, int], link: Link, seed: int = 0) -> None:
        self.carried = self.lost = 0
        self.cut: set[str] = set()
        """Addresses that are off the network."""
        self._by_address = {socket.inet_aton(a): (a, file) for a, file in files.items()}
        self._by_file = {file: a for a, file in files.items()}
        self._link = link
        self._random = np.random.default_rng(seed)
        self._waiting: list[tuple[float, int, bytes]] = []
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="switch", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop carrying, and remove the devices."""
        self._stop.set()
        self._thread.join()
        for file in self._by_file:
            os.close(file)

    def _run(self) -> None:
        waiting, files = self._waiting, list(self._by_file)
        while not self._stop.is_set():
            rest = waiting[0][0] - time.monotonic() if waiting else 0.1
            ready = select.select(files, [], [], max(0.0, min(rest, 0.1)))[0]
            for file in ready:
                self._read(file)
            now = time.monotonic()
            while waiting and waiting[0][0] <= now:
                self._deliver(heapq.heappop(waiting)[2])

    def _read(self, file: int) -> None:
        while True:
            try:
                packet = os.read(file, _LONGEST)
            except OSError:  # nothing more, or the device is gone
                return
            self.carried += 1
            lost, turn = self._random.random(2)
            if lost < self._link.loss or self._by_file[file] in self.cut:
                self.lost += 1
                continue
            due = time.monotonic() + self._link.delay + (2 * turn - 1) * self._link.jitter
            heapq.heappush(self._waiting, (due, self.carried, packet))

    def _deliver(self, packet: bytes) -> None:
        address, file = self._by_address.get(packet[_DESTINATION], ("", -1))
        if file < 0 or address in self.cut:
            return
        try:
            os.write(file, packet)
        except OSError:  # its queue is full, or the device is going: lost, as on any network
            self.lost += 1
