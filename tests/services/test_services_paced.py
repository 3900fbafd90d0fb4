"""A paced run over the bus is bit-identical to a lockstep run of the same services."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Any

import pytest
from patience import PATIENCE
from service_toys import TOYS

from services.live.paced import PacedError, run_paced
from services.lockstep import Lockstep
from services.messages import ArmState, Message
from services.service import Inbox, Outbox
from services.topics import ARM_STATE, SERVICES, Topic
from services.wire.bus import open_bus
from services.wire.codec import encode
from services.wire.endpoints import local

TICKS = 400


def _lockstep(seed: int) -> tuple[dict[str, float], list[bytes]]:
    log: list[tuple[str, bytes]] = []
    services = [TOYS[name](seed) for name in SERVICES]
    run = Lockstep(
        services, listener=lambda topic, m, _: log.append((topic.name, encode("", 0, m)))
    )
    for _ in range(TICKS):
        run.step()
    return {s.name: s.x for s in services}, sorted(log)  # type: ignore[type-var,return-value]


def _paced(seed: int, run_dir: Path) -> tuple[dict[str, float], list[bytes]]:
    log: list[tuple[str, bytes]] = []
    services = {name: TOYS[name](seed) for name in SERVICES}
    errors: list[BaseException] = []
    stop = threading.Event()

    def run(name: str) -> None:
        try:
            with open_bus(local(run_dir, name), "r1", name, lossless=True) as bus:
                publish = bus.publish

                def record(topic: Topic, message: Message) -> int:
                    if topic.name.split("/")[1] not in ("tick", "health"):
                        log.append((topic.name, encode("", 0, message)))
                    return publish(topic, message)

                bus.publish = record  # type: ignore[method-assign]
                run_paced(services[name], bus, stop, ticks=TICKS)
        except BaseException as error:
            errors.append(error)
            stop.set()

    threads = [threading.Thread(target=run, args=(name,)) for name in reversed(SERVICES)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(120)
    assert not errors
    return {name: s.x for name, s in services.items()}, sorted(log)  # type: ignore[return-value]


@pytest.mark.parametrize("seed", [1, 2])
def test_paced_is_lockstep_bit_for_bit(seed: int, tmp_path: Path) -> None:
    """Every message and every state agree to the last bit, slow services included."""
    expected, messages = _lockstep(seed)
    states, sent = _paced(seed, tmp_path)
    assert states == expected
    assert sent == messages


def test_a_refused_message_does_not_end_the_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is out of range is refused, and the run goes on without it; it will not come again."""
    step = TOYS["sim"].step

    def wild(self: Any, now: float, inbox: Inbox) -> Outbox:
        out = step(self, now, inbox)
        state = out[0][1]
        if 100 < self.steps < 104 and isinstance(state, ArmState):
            state.qd[:] = 1e6
        return out

    monkeypatch.setattr(TOYS["sim"], "step", wild)
    _, sent = _paced(1, tmp_path)
    states = [name for name, _ in sent if name == ARM_STATE.name]  # type: ignore[misc]
    assert len(states) == TICKS


def test_missing_service_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The robot does not wait for ever; it says who did not come."""
    monkeypatch.setattr("services.live.paced.START", 0.5)
    missing = pytest.raises(PacedError, match="arm, base, observer did not come")
    with open_bus(local(tmp_path, "sim"), "r1", "sim", lossless=True) as bus, missing:
        run_paced(TOYS["sim"](1), bus, threading.Event())


def test_stop_ends_a_waiting_run(tmp_path: Path) -> None:
    """A run that waits for others ends when it is asked to."""
    stop = threading.Event()
    stop.set()
    with open_bus(local(tmp_path, "arm"), "r1", "arm", lossless=True) as bus:
        run = threading.Thread(target=run_paced, args=(TOYS["arm"](1), bus, stop), daemon=True)
        run.start()
        run.join(PATIENCE)
        assert not run.is_alive()
