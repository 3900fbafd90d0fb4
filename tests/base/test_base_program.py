"""Programs of the platform: one behaviour among the others, on a lagging drive."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from base.behaviour import Senses, Vote
from base.nodes import REGISTRY
from base.platform import Platform
from base.turn_drive_turn import range_and_bearing
from deploy.robot import load_robot
from deploy.task import BASE_PROGRAMS, BaseTask

HOLONOMIC, DIFFERENTIAL = "xr4000_puma560", "rmp_puma560"
HEAD = "INTERFACE = platform;\nINITIAL = First;\n"


def make(robot: str, program: str, **given: Any) -> Platform:
    """A platform whose task is a program."""
    options = {"behaviour": "program", "program": program, **given}
    return Platform(load_robot(robot), BaseTask.model_validate(options))


def written(tmp_path: Path, text: str) -> str:
    """The path of a program of one's own."""
    file = tmp_path / "own.hds"
    file.write_text(HEAD + text)
    return str(file)


def on(robot: str, plant: Any) -> Any:
    """A plant that lags like the robot."""
    return type(plant)(load_robot(robot))


@pytest.mark.parametrize("goal", [(1.5, 0.5, 2.0), (-1.0, -0.3, 0.0), (0.0, 0.0, 2.5)])
def test_turn_drive_turn_reaches_a_pose_without_moving_sideways(
    plant: Any, goal: tuple[float, float, float]
) -> None:
    """Within 2 cm and 1 degree, with no sideways command ever, and then it stands."""
    plant = on(DIFFERENTIAL, plant)
    platform = make(DIFFERENTIAL, "turn_drive_turn.hds", goal=goal)
    run = plant.run(platform, 25.0)
    assert run.status[-1].state == "finished"
    assert np.hypot(*(plant.pose[:2] - goal[:2])) < 0.02
    assert abs(math.remainder(plant.pose[2] - goal[2], 2 * math.pi)) < math.radians(1.5)
    assert (run.commands[:, 1] == 0).all()
    assert (run.commands[-1] == 0).all()


def test_on_the_goal_already_only_the_heading_is_left(plant: Any) -> None:
    """A goal underfoot has no bearing: the drive is left out."""
    plant = on(DIFFERENTIAL, plant)
    platform = make(DIFFERENTIAL, "turn_drive_turn", goal=(0.0, 0.001, 1.0))
    plant.run(platform, 6.0)
    assert [target for _, target in platform.program.transitions] == [
        "Turn_there",
        "Turn_straight",
        "End",
    ]


@pytest.mark.parametrize("name", [HOLONOMIC, DIFFERENTIAL])
def test_approach_ends_within_reach_of_the_object_facing_it(plant: Any, name: str) -> None:
    """From 2.3 m, 60 degrees off its front; each of the three drives is run once."""
    plant = on(name, plant)
    thing = np.array([1.5, 1.7, math.radians(170)])
    platform = make(name, "approach.hds", object=tuple(thing))
    run = plant.run(platform, 30.0)
    assert run.status[-1].state == "finished"
    distance, bearing = range_and_bearing(thing, plant.pose)
    assert distance < 0.7 and abs(bearing) < math.radians(3)
    nodes = [target for _, target in platform.program.transitions]
    assert nodes == ["Towards", "In_front", "Near", "End"]


def test_a_goal_is_driven_to_in_the_way_the_platform_can(plant: Any) -> None:
    """The plain goal of a person, on a differential platform: nothing sideways, and it arrives."""
    plant = on(DIFFERENTIAL, plant)
    platform = Platform(load_robot(DIFFERENTIAL), BaseTask())
    platform.set_goal(0.0, 1.0, 0.0)
    run = plant.run(platform, 15.0)
    assert run.status[-1].state == "arrived"
    assert np.hypot(plant.pose[0], plant.pose[1] - 1.0) < 0.02
    assert (run.commands[:, 1] == 0).all()


def test_a_path_that_needs_sideways_motion_is_refused_to_a_differential_platform() -> None:
    """A circle is driven with the heading along it, not with a fixed one."""
    circle = {"kind": "circle", "radius": 1.0, "speed": 0.3}
    platform = Platform(load_robot(DIFFERENTIAL), BaseTask())
    with pytest.raises(ValueError, match=r"vy reaches 0\.30; the limit is 0"):
        platform.set_behaviour("follow_path", path=circle)
    platform.set_behaviour("follow_path", path={**circle, "heading": "tangent"})


class Sideways:
    """Wants to go left, and no faster than 0.1 m/s."""

    name = "sideways"
    state = "going"

    def vote(self, now: float, senses: Senses) -> Vote:
        """Left."""
        return Vote(np.array([0.0, 0.3, 0.0]), 1.0, np.array([0.1, 0.1, 1.0]))


def test_other_behaviours_keep_their_say_but_cannot_make_it_slide(plant: Any) -> None:
    """Their bound slows the program; what they want sideways does not reach the drive."""
    plant = on(DIFFERENTIAL, plant)
    platform = make(DIFFERENTIAL, "turn_drive_turn", goal=(1.0, 0.0, 0.0))
    platform.add(Sideways())
    run = plant.run(platform, 6.0)
    assert (run.commands[:, 1] == 0).all()
    assert 0.05 < np.abs(run.commands[:, 0]).max() <= 0.1 + 1e-9
    assert set(run.status[-1].votes) >= {"program", "sideways"}


def test_a_stop_in_mid_drive_interrupts_and_resume_goes_on(plant: Any) -> None:
    """The node is the same after the stop, and its time stood still."""
    plant = on(DIFFERENTIAL, plant)
    platform = make(DIFFERENTIAL, "turn_drive_turn", goal=(1.5, 0.0, 0.0))
    plant.run(platform, 2.0)
    platform.stop()
    assert (plant.run(platform, 3.0).commands[-1] == 0).all()
    assert platform.program.node == "Drive"
    platform.resume()
    plant.run(platform, 12.0)
    assert platform.program.state == "finished"


def test_abort_leads_to_the_abort_node_and_the_platform_stands(plant: Any) -> None:
    """Of a program without one: its end, and the state says so."""
    platform = make(HOLONOMIC, "approach", object=(3.0, 0.0, math.pi))
    plant.run(platform, 1.0)
    platform.program.abort()
    run = plant.run(platform, 2.0)
    assert run.status[-1].state == "aborted"
    assert (run.commands[-1] == 0).all()
    with pytest.raises(ValueError, match="it is aborted"):
        platform.program.abort()


def test_wait_waits_for_its_event_and_refuses_others(plant: Any, tmp_path: Path) -> None:
    """The status names the program and its node."""
    text = (
        "BEGIN NAME = First; TYPE = Wait; Event = go; TRANSITION[Received] = Second; END\n"
        "BEGIN NAME = Second; TYPE = Hold; Time = 1 s; TRANSITION[Timeout] = End; END\n"
    )
    platform = make(HOLONOMIC, written(tmp_path, text))
    assert "own.hds: First" in plant.run(platform, 1.0).status[-1].reason
    with pytest.raises(ValueError, match="waits for 'go', not for 'come'"):
        platform.program.signal("come")
    platform.program.signal("go")
    plant.run(platform, 0.5)
    with pytest.raises(ValueError, match=r"no node waits for an event: .*running in Second"):
        platform.program.signal("go")
    assert plant.run(platform, 1.5).status[-1].state == "finished"


def test_timeout_and_guards_count_the_time_in_the_node(plant: Any, tmp_path: Path) -> None:
    """A drive that takes too long gives way, and a hold ends where its guard holds."""
    text = (
        "BEGIN NAME = First; TYPE = Drive_to; X = 5 m; Timeout = 1 s; "
        "TRANSITION[Arrived] = End; TRANSITION[Timeout] = Second; END\n"
        "BEGIN NAME = Second; TYPE = Hold; TRANSITION[Time > 2 s] = End; END\n"
    )
    platform = make(HOLONOMIC, written(tmp_path, text))
    plant.run(platform, 2.9)
    assert platform.program.node == "Second"
    plant.run(platform, 0.4)
    assert [event for event, _ in platform.program.transitions] == [
        "start",
        "Timeout",
        "Time > 2 s",
    ]


def test_a_drive_that_points_elsewhere_says_so(plant: Any, tmp_path: Path) -> None:
    """Off_course at once for a place behind; the platform has not moved."""
    text = (
        "BEGIN NAME = First; TYPE = Drive_straight; X = -1 m; "
        "TRANSITION[Arrived] = End; TRANSITION[Off_course] = Second; END\n"
        "BEGIN NAME = Second; TYPE = Hold; Time = 9 s; TRANSITION[Timeout] = End; END\n"
    )
    platform = make(DIFFERENTIAL, written(tmp_path, text))
    plant.run(platform, 0.5)
    assert platform.program.node == "Second"
    assert (plant.pose == 0).all()


def test_refusals_say_what_is_allowed(tmp_path: Path) -> None:
    """Unknown programs, programs of the arm, unknown types, and frames the task does not give."""
    arm = "BEGIN NAME = First; TYPE = Whiteboard_line; END\n"
    foreign = tmp_path / "foreign.hds"
    foreign.write_text(
        "INTERFACE = r1;\nINITIAL = First;\n"
        "BEGIN NAME = First; TYPE = Hold; Time = 1 s; TRANSITION[Timeout] = End; END\n"
    )
    for words, program, given in (
        ("Known: approach.hds, turn_drive_turn.hds", "aproach", {}),
        ("valid names: Turn_to, Drive_straight", written(tmp_path, arm), {}),
        ("a program of the platform says platform", str(foreign), {}),
        ("speaks of the object, which the task does not give", "approach", {"goal": (0, 0, 0)}),
    ):
        with pytest.raises(ValueError, match=words):
            make(HOLONOMIC, program, **given)


def test_every_type_states_control_law_goal_region_and_domain() -> None:
    """In the docstring of the class that runs it; and every shipped program is documented."""
    for kind in REGISTRY.values():
        text = " ".join((kind.make.__doc__ or "").split()) if kind.make else ""
        for what in ("Control law:", "Goal region:", "Domain:"):
            assert kind.terminal or what in text, f"{kind.name} does not state its {what}"
    page = (Path(__file__).parents[2] / "docs" / "policies.md").read_text()
    for name in [*REGISTRY, *(p.name for p in BASE_PROGRAMS.glob("*.hds"))]:
        assert f"`{name}`" in page, name
