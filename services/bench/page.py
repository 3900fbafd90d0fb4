"""What a page gets, as a browser's line sees it: how soon the robot is there, how often it moves.

No browser draws here: a WebSocket is opened as viser's page does, and what arrives is timed.
"""

from __future__ import annotations

import re
import struct
import time
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np
import viser
import zstandard
from websockets.sync.client import connect

from services.bench.live_robot import robot, to_work

FIRST, RATE = 5.0, 20.0
"""Goals: robot on the page after so long [s]; pictures a second, at least."""
_DRAWN = {"MeshMessage", "BoxMessage", "CylinderMessage", "IcosphereMessage"}
_MOVED = {"SetPositionMessage", "SetOrientationMessage"}
_CAMERA = {
    "type": "ViewerCameraMessage",
    "wxyz": (1.0, 0.0, 0.0, 0.0),
    "position": (3.0, 3.0, 3.0),
    "fov": 1.0,
    "near": 0.01,
    "far": 1000.0,
    "image_height": 800,
    "image_width": 1200,
    "look_at": (0.0, 0.0, 0.0),
    "up_direction": (0.0, 0.0, 1.0),
}
"""What a page says first; without it nobody is known to look."""


@dataclass(frozen=True)
class Found:
    """What a page got.

    Attributes:
        ready: from the last service's being ready to the console's [s]; negative if it was sooner.
        first: from opening the line to the first shapes of the scene [s].
        rate: messages in which something moved, a second.
        longest: between two of them [s].
        bytes_per_s: of everything.
    """

    ready: float
    first: float
    rate: float
    longest: float
    bytes_per_s: float

    @property
    def met(self) -> bool:
        """Both goals."""
        return max(self.ready, 0.0) + self.first <= FIRST and self.rate >= RATE


def measure(run_dir: Path, scenario: str, seconds: float) -> Found:
    """Run a robot live, open its page, and time what comes.

    Args:
        run_dir: for its sockets and logs.
        scenario: what it does.
        seconds: how long.

    Raises:
        TimeoutError, Silent: the robot or its page did not come up.
    """
    with robot(run_dir, scenario, "--port", "0") as (_, line):
        said = run_dir / "up.txt"
        deadline = time.monotonic() + 30.0
        while not (page := re.search(r"([\d.]+) +console +ready.*http(://\S+)", said.read_text())):
            if time.monotonic() > deadline:
                raise TimeoutError(f"no page within 30 s; see {said}")
            time.sleep(0.05)
        services = re.findall(r"([\d.]+) +(?!console)\S+ +ready", said.read_text())
        to_work(line)
        began = time.monotonic()
        first, moved, size = None, [], 0
        protocol = f"viser-v{viser.__version__}"
        with connect(f"ws{page[2]}", subprotocols=[protocol], max_size=None) as window:  # type: ignore[list-item]
            window.send(msgspec.msgpack.encode(_CAMERA))
            while (now := time.monotonic()) < began + seconds:
                try:
                    frame = window.recv(timeout=1.0)
                except TimeoutError:
                    continue
                size += len(frame)
                kinds = _kinds(frame) if isinstance(frame, bytes) else set()
                if first is None and kinds & _DRAWN:
                    first = now - began
                if kinds & _MOVED:
                    moved.append(now)
    if first is None or len(moved) < 2:
        raise TimeoutError(f"the page stayed empty for {seconds:g} s")
    return Found(
        ready=float(page[1]) - max(map(float, services)),
        first=first,
        rate=(len(moved) - 1) / (moved[-1] - moved[0]),
        longest=float(np.diff(moved).max()),
        bytes_per_s=size / seconds,
    )


def _kinds(frame: bytes) -> set[str]:
    """Of the messages in a frame, as viser packs them: two lengths, then they compressed."""
    _, packed = struct.unpack_from("<QQ", frame)
    content = zstandard.ZstdDecompressor().decompress(frame[16 : 16 + packed])
    return {message["type"] for message in msgspec.msgpack.decode(content)["messages"]}
