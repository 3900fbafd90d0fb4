"""``from services import connect``: topics, events and requests for scripts."""

from __future__ import annotations

import contextlib
import itertools
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from patience import PATIENCE, until

from services import connect
from services import messages as m
from services.requests import Requests
from services.script import NotRunning, Refused, Silent
from services.topics import ARM_STATUS, BASE_STATUS, ODOMETRY
from services.wire.bus import Bus, open_bus
from services.wire.endpoints import local, make_run_dir

SOON = PATIENCE


@pytest.fixture
def run_dir(tmp_path: Path) -> Path:
    """A short name: unix sockets are made in it."""
    return make_run_dir(tmp_path / "r")


@pytest.fixture
def arm(run_dir: Path) -> Iterator[Bus]:
    """What the arm says, for a test to say it."""
    with open_bus(local(run_dir, "arm"), "r1", "arm", lossless=True) as bus:
        yield bus


class Says:
    """Says something over and over from a thread of its own, ever newer, until it is left.

    Of several it says the first until ``go_on``, and each of those between ten times.
    """

    def __init__(self, bus: Bus, *statuses: m.ArmStatus) -> None:
        self._bus, self._statuses = bus, statuses
        self._stop, self._heard = threading.Event(), threading.Event()
        self._thread = threading.Thread(target=self._work, daemon=True)

    def go_on(self) -> None:
        """The first was heard."""
        self._heard.set()

    def _work(self) -> None:
        n = after = 0
        while not self._stop.wait(0.01):
            message = self._statuses[min((after + 9) // 10, len(self._statuses) - 1)]
            n, after = n + 1, after + self._heard.is_set()
            message.t = n * 0.01
            self._bus.publish(ARM_STATUS, message)

    def __enter__(self) -> Says:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join()


def test_nobody_there_is_said_with_what_to_do(tmp_path: Path) -> None:
    """A script started before the robot hears how to start it."""
    with pytest.raises(NotRunning, match="steadyhand up"):
        connect(run_dir=tmp_path)


def test_latest_waits_for_the_first_and_says_who_is_silent(arm: Bus, run_dir: Path) -> None:
    """What is said arrives; what nobody says is named; a wrong name gets the right one."""
    with connect(run_dir=run_dir) as robot, Says(arm, m.ArmStatus(0.0, node="Line1")):
        assert robot.latest("arm/status", SOON).node == "Line1"
        assert robot.latest(ARM_STATUS, SOON).t > 0
        with pytest.raises(Silent, match="observer/estimate"):
            robot.latest("observer/estimate", 0.1)
        with pytest.raises(ValueError, match=r"did you mean 'arm/status'\?"):
            robot.latest("arm/satus")


def test_latest_is_never_old(arm: Bus, run_dir: Path) -> None:
    """Of a service that has fallen silent nothing is given for new."""
    with connect(run_dir=run_dir) as robot:
        with Says(arm, m.ArmStatus(0.0)):
            robot.latest("arm/status", SOON)

        def silent() -> bool:
            with contextlib.suppress(Silent):
                return robot.latest("arm/status", 0.0) is None
            return True

        until(silent, "silence")


def test_messages_are_all_there_in_order(run_dir: Path) -> None:
    """A burst faster than the script reads loses nothing; then it waits, and says for whom."""
    with (
        open_bus(local(run_dir, "sim"), "r1", "sim", lossless=True) as sim,
        connect(run_dir=run_dir) as robot,
    ):
        heard = robot.messages(ODOMETRY, SOON)
        ready = threading.Event()

        def burst() -> None:
            while not ready.wait(0.01):  # until the line is open
                sim.publish(ODOMETRY, m.Odometry(0.0, np.zeros(3)))
            for i in range(1, 2001):
                sim.publish(ODOMETRY, m.Odometry(float(i), np.full(3, i)))

        thread = threading.Thread(target=burst, daemon=True)
        thread.start()
        assert next(heard).t == 0.0
        ready.set()
        thread.join()
        times: list[float] = []
        while len(times) < 2000:
            t = next(heard).t
            if t > 0:
                times.append(t)
        assert times == [float(i) for i in range(1, 2001)]
        assert robot.lost.get("robot/odometry", 0) == 0
        with pytest.raises(Silent, match="robot/odometry"):
            next(robot.messages(ODOMETRY, 0.1))


def test_what_a_script_did_not_read_in_time_is_counted(
    run_dir: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever it waited for meanwhile: what it reads and what it lost is all that was said."""
    monkeypatch.setattr("services.script.QUEUE", 10)
    with (
        open_bus(local(run_dir, "sim"), "r1", "sim", lossless=True) as sim,
        connect(run_dir=run_dir) as robot,
    ):
        heard = robot.messages(ODOMETRY, SOON)
        said = iter(range(10**6))

        def say() -> int:
            i = next(said)
            sim.publish(ODOMETRY, m.Odometry(float(i), np.zeros(3)))
            return i

        def met() -> bool:
            say()
            robot._drain()
            return robot._inbox.latest(ODOMETRY) is not None

        until(met, "the line to open")
        first = next(heard).t
        for _ in range(500):
            last = say()
            robot._drain()
        until(lambda: robot.latest(ODOMETRY, SOON).t == last, "the last of it")
        read = [first]
        while read[-1] < last:
            read.append(next(heard).t)
        assert robot.lost["robot/odometry"] > 100
        assert len(read) + robot.lost["robot/odometry"] == last - first + 1


def test_wait_for_gives_the_first_that_fits(arm: Bus, run_dir: Path) -> None:
    """And when none does in time, what was heard last."""
    statuses = [m.ArmStatus(0.0, state="running", node=n) for n in ("A", "B", "C")]
    with connect(run_dir=run_dir) as robot, Says(arm, *statuses) as says:
        robot.latest("arm/status", SOON)
        says.go_on()
        assert robot.wait_for("arm/status", lambda s: s.node == "C", SOON).state == "running"
        with pytest.raises(Silent, match="node='C'"):
            robot.wait_for("arm/status", lambda s: s.node == "D", 1.0)


def test_events_are_what_changes(arm: Bus, run_dir: Path) -> None:
    """A change of node is its event, a change of state the state; what stays is no event."""
    statuses = [
        m.ArmStatus(0.0, state="running", node="A", transitions=0, event="start"),
        m.ArmStatus(0.0, state="running", node="B", transitions=1, event="Contact"),
        m.ArmStatus(
            0.0, state="safe_hold", node="B", transitions=1, event="Contact", reason="late"
        ),
    ]
    with connect(run_dir=run_dir) as robot, Says(arm, *statuses) as says:
        robot.latest("arm/status", SOON)
        says.go_on()
        first = robot.wait_for_event("Contact", "arm", SOON)
        assert (first.service, first.detail) == ("arm", "A -> B")
        held = next(robot.events(SOON))
        assert (held.name, held.detail) == ("safe_hold", "late")
        with pytest.raises(Silent):
            next(robot.events(0.2))
        with pytest.raises(Silent, match="nothing"):
            robot.wait_for_event("Contact", timeout=0.1)


def test_the_platform_has_events_too(run_dir: Path) -> None:
    """By its states."""
    with (
        open_bus(local(run_dir, "base"), "r1", "base", lossless=True) as base,
        connect(run_dir=run_dir) as robot,
    ):
        t = itertools.count(1)

        def heard() -> bool:
            base.publish(BASE_STATUS, m.BaseStatus(0.05 * next(t), "driving"))
            with contextlib.suppress(Silent):
                return robot.latest("base/status", 0.01).state == "driving"
            return False

        until(heard, "the first status")
        base.publish(BASE_STATUS, m.BaseStatus(0.05 * next(t), "arrived"))
        assert robot.wait_for_event("arrived", "base", SOON).t > 0


def test_requests_are_accepted_or_refused_with_the_reason(arm: Bus, run_dir: Path) -> None:
    """The reason is the text of the error, whichever way it was refused."""
    from service_toys import ToyArm

    toy = ToyArm(0)
    requests = Requests(arm.session, "r1", toy)
    done = threading.Event()

    def loop() -> None:
        while not done.wait(0.001):
            requests.run_pending(0.0)

    thread = threading.Thread(target=loop, daemon=True)
    thread.start()
    try:
        with connect(run_dir=run_dir) as robot:
            assert robot.request("arm", "stir", value=0.25) == ""
            with pytest.raises(Refused, match="stir needs value=NUMBER"):
                robot.request("arm", "stir", value="x")
            with pytest.raises(Refused, match="it can: stir"):
                robot.request("arm", "dance")
    finally:
        done.set()
        thread.join()
        requests.close()


def test_the_vocabulary_does_not_bring_in_the_bus() -> None:
    """``connect`` is imported when it is asked for: who only speaks messages starts as before."""
    code = "import sys, services.messages; sys.exit('zenoh' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
