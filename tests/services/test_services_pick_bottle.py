"""A bottle fetched by an arm with a hand, in lockstep."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from deploy.task import PROGRAMS
from services.components import build_service
from services.messages import ArmState, HandState
from services.run import Run, run_lockstep
from services.service import Inbox
from services.topics import ARM_STATE, ARM_STATUS, ESTIMATE, HAND_COMMAND, HAND_STATE
from sim.scenario import Scenario, load_scenario


def short(folder: Path, bottle: bool = True) -> Scenario:
    """From just before the bottle, to a goal not far off, and little to and fro."""
    scenario = load_scenario("pick_bottle")
    world, task = scenario.world, scenario.task
    assert task.bottle is not None
    text = (PROGRAMS / task.program).read_text()
    assert "Time = 8 s;" in text
    program = folder / "short.hds"
    program.write_text(text.replace("Time = 8 s;", "Time = 2.7 s;"))
    start = {"start": None, "platform_start": (-0.55, -0.28, 0.05)}
    if not bottle:
        start["bottle"] = None
    told = task.bottle.model_copy(update={"goal": (0.03, -0.05)})
    return scenario.model_copy(
        update={
            "world": world.model_copy(update=start),
            "task": task.model_copy(update={"program": str(program), "bottle": told}),
        }
    )


@pytest.fixture(scope="module")
def fetched(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """One run, looked at by several tests."""
    return run_lockstep(short(tmp_path_factory.mktemp("programs")), seed=1)


def test_the_bottle_is_placed_upright_at_its_goal(fetched: Run) -> None:
    """Grasped by touch, lifted, carried, put down, let go of."""
    figures = fetched.result
    assert figures["placed"], figures["outcome"]
    assert figures["placed_error_mm"] < 15.0
    assert figures["placed_tilt_deg"] < 2.0
    assert figures["carried_slip_mm"] < 10.0
    assert figures["tip_force_peak_n"] < 80.0


def test_the_hand_is_still_in_the_world_while_the_platform_moves(fetched: Run) -> None:
    """A millimetre, on a platform that moved by sixty and more."""
    assert fetched.result["still_platform_mm"] > 60.0
    assert fetched.result["still_rms_mm"] < 1.0


def test_the_program_says_what_the_fingertips_slid_to(fetched: Run) -> None:
    """Residuals are in the status while they slide, and end small."""
    slid = [s for s in fetched.log.series(ARM_STATUS) if len(s.residuals)]
    assert {s.node for s in slid} == {"Grasp"}
    assert slid[-1].residuals.max() < 0.15 < slid[0].residuals.max()


def test_hand_state_and_command_are_on_the_bus(fetched: Run) -> None:
    """Loads of the fingertips while they squeeze, torques for every drive."""
    squeezed = max(
        np.linalg.norm(m.cells[:, :3], axis=1).min() for m in fetched.log.series(HAND_STATE)
    )
    assert squeezed > 30.0
    assert all(m.of(4) for m in fetched.log.series(HAND_COMMAND))


def test_a_bottle_that_is_not_there_is_said_to_be_missing(tmp_path: Path) -> None:
    """The fingers close on nothing, once more elsewhere, and the program ends."""
    run = run_lockstep(short(tmp_path, bottle=False), seed=1)
    last = run.log.series(ARM_STATUS)[-1]
    assert (last.state, last.node, last.reason) == ("finished", "Missing", "nothing there")
    assert run.result["placed"] is False


def test_states_that_do_not_belong_together_are_not_answered(tmp_path: Path) -> None:
    """A hand's state that is late, or of another hand, moves nothing."""
    service = build_service("arm", short(tmp_path), 0)
    inbox = Inbox(service.inputs)
    inbox.offer(ARM_STATE, ArmState(1.0, *(np.zeros(7) for _ in range(3)), wrench=np.zeros(0)))
    assert ESTIMATE in service.inputs
    assert service.step(1.0, inbox) == []
    for t, fingers, answered in ((0.9, 3, False), (1.0, 2, False), (1.0, 3, True)):
        state = HandState(t, *(np.zeros(4) for _ in range(3)), cells=np.zeros((fingers, 6)))
        inbox.offer(HAND_STATE, state)
        assert bool(service.step(1.0, inbox)) is answered
