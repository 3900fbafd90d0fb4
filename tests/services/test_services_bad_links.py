"""Three hosts on bad links: the drawing is kept up, and a host that was away is got over."""

from __future__ import annotations

import pytest

from deploy.host_file import load_hosts
from services.faults.kinds import Loss
from services.faults.links import bad_links, crossing, partition
from services.faults.run import Faulty, run_faulty
from services.faults.verdict import Witness, starves
from services.messages import ArmStatus
from services.reports.evaluation import figures_of
from services.topics import ARM_STATUS, TOPICS
from sim.scenario import load_scenario

THREE = load_hosts("three")
MOVING = load_scenario("whiteboard_moving")


def states(run: Faulty) -> list[tuple[str, str]]:
    """States of the arm with their reasons, in order."""
    assert run.log is not None
    said: list[ArmStatus] = run.log.series(ARM_STATUS)
    return list(dict.fromkeys((s.state, s.reason) for s in said))


def test_what_crosses_is_what_is_read_elsewhere() -> None:
    """The torque loop stays on its host; every other way between two hosts is on the network."""
    ways = list(crossing(THREE))
    assert ("observer/estimate", "observer", "arm") in ways
    assert ("base/command", "base", "sim") in ways
    assert not {("arm/command", "arm", "sim"), ("robot/arm_state", "sim", "arm")} & set(ways)
    assert all(reader in TOPICS[topic].readers for topic, _, reader in ways)
    assert all(THREE.place(owner) != THREE.place(reader) for _, owner, reader in ways)


def test_a_host_that_is_cut_off_loses_only_its_own_ways() -> None:
    """What the others say to each other goes on."""
    lost = {(f.topic, f.reader) for f in partition(THREE, "vision", 8.0, 1.0)}  # type: ignore[attr-defined]
    assert ("observer/estimate", "arm") in lost and ("robot/imu", "observer") in lost
    assert ("base/command", "observer") in lost and ("base/command", "sim") not in lost


def test_drawing_is_kept_up_on_bad_links() -> None:
    """5 +- 2 ms and 1 % loss on every way between hosts, the platform moving: within 1 mm rms."""
    link = THREE.link
    assert (link.delay, link.jitter, link.loss) == (0.005, 0.002, 0.01)
    run = run_faulty(MOVING, 1, bad_links(THREE, MOVING.duration), [], keep=True)
    assert run.row["finished"] and run.row["resumed"] == 0
    assert run.log is not None
    assert figures_of(run.log)["line_rms_mm"] < 1.0


def test_a_partition_of_a_second_is_a_safe_hold_and_resumed() -> None:
    """The arm holds within 50 ms and says why; somebody resumes; the drawing is finished."""
    run = run_faulty(MOVING, 1, partition(THREE, "vision", 8.0, 1.0), [], keep=True)
    assert run.row["finished"], run.row["end"]
    assert max(run.row["safe_after_s"]) <= 0.05 and run.row["never_safe"] == 0
    assert run.row["resumed"] >= 1
    assert any(s == "safe_hold" and "estimate of the platform is" in why for s, why in states(run))


def seen(*states: tuple[float, str]) -> Witness:
    """Who saw the arm in these states."""
    witness = Witness("xr4000_puma560", [])
    witness.states = [(t, state, "") for t, state in states]
    return witness


def test_an_arm_that_goes_on_without_its_input_is_never_safe() -> None:
    """Told apart from one that had not been at work, and from one that held late."""
    loss = Loss(2.0, 0.5, "observer/estimate", 1.0, reader="arm")
    assert seen((1.0, "running")).safe_after(loss) == float("inf")
    assert seen((1.0, "running"), (3.0, "safe_hold")).safe_after(loss) == float("inf")
    assert seen((1.0, "running"), (2.04, "safe_hold")).safe_after(loss) == pytest.approx(0.04)
    assert seen((1.0, "paused")).safe_after(loss) is None


def test_what_somebody_else_does_not_hear_starves_no_arm() -> None:
    """Of an estimate it matters whether the arm hears it, of a command whether the motors do."""
    for topic, reader in (("observer/estimate", "arm"), ("arm/command", "sim")):
        assert starves(Loss(2.0, 0.5, topic, 1.0, reader=reader))
        assert starves(Loss(2.0, 0.5, topic, 1.0))
        assert not starves(Loss(2.0, 0.5, topic, 1.0, reader="base"))
        assert not starves(Loss(2.0, 0.5, topic, 0.9))
    assert not starves(Loss(2.0, 0.5, "robot/imu", 1.0))
