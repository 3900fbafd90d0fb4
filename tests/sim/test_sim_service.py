"""The simulated robot as a service: what it senses goes out on its topics and into the log."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from services.logs.runlog import RunLog, read_log
from services.messages import BaseCommand
from services.service import Inbox
from services.sim_service import SimService
from services.topics import BASE_COMMAND, BUMPER, SCAN, TRUTH, VISION
from services.wire.codec import decode, encode
from sim.obstacle_specs import Wall
from sim.scenario import Board
from tests.sim.sim_loop import scenario


def test_scan_bumpers_and_vision_go_over_the_wire_and_into_the_log(tmp_path: Path) -> None:
    """Arrays of any length come back as they were, an empty one included."""
    wall = Wall(start=(0.9, -1.0), end=(0.9, 1.0))
    service = SimService(scenario(obstacle=(wall,), board=Board(x=3.0, z=1.0)), 1)
    inbox, log = Inbox((BASE_COMMAND,)), RunLog()
    for k in range(1500):
        now = k / 1000
        if k % 50 == 0:
            inbox.offer(BASE_COMMAND, BaseCommand(t=now, velocity=np.array([1.0, 0.0, 0.0])))
        for topic, message in service.step(now, inbox):
            log(topic, message, now)
    log.write(tmp_path / "run.mcap", {})
    back, _ = read_log(tmp_path / "run.mcap")
    pressed = [len(m.pressed) for m in log.series(BUMPER)]
    assert pressed[0] == 0 and pressed[-1] == 1
    assert len(log.series(SCAN)) == 15 and not log.series(VISION)  # the wall hides the board
    for topic, name in ((SCAN, "ranges"), (BUMPER, "pressed"), (TRUTH, "clearance")):
        for a, b in zip(log.series(topic), back.series(topic), strict=True):
            np.testing.assert_array_equal(getattr(a, name), getattr(b, name))
            _, heard = decode(topic, encode("sim", 1, a))
            np.testing.assert_array_equal(getattr(a, name), getattr(heard, name))
