"""The platform as a whole, against a drive that lags as described."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from base.behaviour import Senses, Vote
from base.platform import Platform
from deploy.robot import Robot
from deploy.task import BaseTask
from services.messages import Array, BaseCommand, BaseStatus, Estimate, check

SWAY = {"kind": "sway", "amplitude": [0.1, 0.3], "yaw_deg": 5.0, "frequency": [1.3, 1.0, 0.8]}
LOOP = {"kind": "polyline", "points": [[0, 0.25, 0], [0, -0.25, 0]], "speed": 0.1, "loop": True}


def make(robot: Robot, behaviour: str = "hold_still", **options: Any) -> Platform:
    """A platform with a task given by the keys of its table."""
    return Platform(robot, BaseTask.model_validate({"behaviour": behaviour, **options}))


def references(platform: Platform, t: list[float]) -> Array:
    """(n, 3) where the path would have the platform."""
    main: Any = platform._main
    return np.array([main.reference(x) for x in t])


def moved(plant: Any, x: float, y: float, heading: float) -> None:
    """Put the platform somewhere else."""
    plant.pose = plant.pose + np.array([x, y, heading])


# --- follow path ----------------------------------------------------------------------------


@pytest.mark.parametrize(("path", "limit"), [(SWAY, 0.0005), (LOOP, 0.001)])
def test_path_is_tracked_to_a_millimetre(
    robot: Robot, plant: Any, path: dict[str, Any], limit: float
) -> None:
    """With the drive as described: 0.5 mm, and 1 mm where the path's corners ask for more jerk."""
    platform = make(robot, "follow_path", path=path)
    run = plant.run(platform, 25.0)
    error = run.poses - references(platform, run.t)
    assert np.hypot(error[:, 0], error[:, 1]).max() < limit
    assert np.abs(error[:, 2]).max() < 0.001


def test_path_is_tracked_by_a_drive_that_lags_more_than_described(
    robot: Robot, late_plant: Any
) -> None:
    """10 % more lag than described costs less than 5 mm on the sway."""
    platform = make(robot, "follow_path", path=SWAY)
    run = late_plant.run(platform, 25.0)
    error = run.poses - references(platform, run.t)
    assert np.hypot(error[:, 0], error[:, 1]).max() < 0.005


def test_sway_starts_smoothly(robot: Robot, plant: Any) -> None:
    """From rest on, no command differs from the one before by more than 0.02 m/s."""
    run = plant.run(make(robot, "follow_path", path=SWAY), 25.0)
    steps = np.diff(np.vstack([np.zeros(3), run.commands]), axis=0)
    assert np.abs(steps).max() < 0.02


def test_task_waits_for_its_start(robot: Robot, plant: Any) -> None:
    """Before ``start_at`` the platform holds still and says what it waits for."""
    platform = make(robot, "follow_path", path=SWAY, start_at=1.0)
    run = plant.run(platform, 3.0)
    early = [s for s in run.status if s.t < 1.0]
    assert {s.state for s in early} == {"holding"}
    assert all("starts at 1 s" in s.reason for s in early)
    assert np.abs(run.commands[: len(early)]).max() == 0.0
    assert run.status[-1].state == "following" and not run.status[-1].reason


def test_a_platform_that_does_not_move_yet_announces_no_motion(robot: Robot, plant: Any) -> None:
    """The observer predicts with what is announced when a command is late."""
    platform = make(robot, "follow_path", path=SWAY, start_at=1.0)
    for step in range(20):
        command, _ = platform.step(0.05 * step, plant.estimate(0.05 * step))
        assert not command.planned.any()


def test_path_with_an_end_finishes_there(robot: Robot, plant: Any) -> None:
    """A path that ends leaves the platform standing at its last point, and says finished."""
    platform = make(
        robot, "follow_path", path={"kind": "line", "points": [[0.3, 0, 0.2]], "speed": 0.2}
    )
    run = plant.run(platform, 8.0)
    assert run.status[-1].state == "finished"
    np.testing.assert_allclose(plant.pose, [0.3, 0, 0.2], atol=1e-3)


def test_interrupted_path_goes_on_where_it_stopped(robot: Robot, plant: Any) -> None:
    """After a stop in mid-path the path is taken up from there, within the limits, in 3 s."""
    platform = make(robot, "follow_path", path=SWAY)
    plant.run(platform, 6.3)
    platform.stop()
    plant.run(platform, 4.0)
    platform.resume()
    run = plant.run(platform, 8.0)
    assert np.abs(np.diff(run.commands, axis=0)).max() < 0.075 + 1e-9
    error = run.poses - references(platform, run.t)
    assert np.hypot(error[3000:, 0], error[3000:, 1]).max() < 0.02


def test_restarted_path_with_an_origin_finds_back(robot: Robot, plant: Any) -> None:
    """A new process takes up a path about its stated origin from wherever the platform is."""
    moved(plant, 0.05, 0.25, 0.05)
    task = BaseTask.model_validate(
        {"behaviour": "follow_path", "path": SWAY, "origin": [0.0, 0.0, 0.0]}
    )
    platform = Platform(robot, task, restarted=True)
    assert {s.state for s in plant.run(platform, 0.5).status} == {"stopped"}
    platform.resume()
    run = plant.run(platform, 12.0)
    sway = np.array([0.1, 0.3, np.radians(5.0)])
    assert (np.abs(run.poses[6000:]) <= sway + 0.005).all()


# --- drive to -------------------------------------------------------------------------------


@pytest.mark.parametrize("goal", [(1.0, 0.0, 0.0), (-0.5, 0.8, 2.0), (0.0, 0.02, -3.0)])
def test_drive_to_arrives_without_overshoot(
    robot: Robot, plant: Any, goal: tuple[float, float, float]
) -> None:
    """It stops within 5 mm and 0.6 deg of the goal, having passed it by no more than 5 mm."""
    run = plant.run(make(robot, "drive_to", goal=goal), 12.0)
    assert run.status[-1].state == "arrived"
    assert np.hypot(*(plant.pose[:2] - goal[:2])) < 0.005
    assert abs(plant.pose[2] - goal[2]) < 0.01
    distance = np.hypot(goal[0], goal[1])
    along = run.poses[:, :2] @ np.array(goal[:2]) / distance
    assert along.max() < distance + 0.005
    assert (run.commands[-1] == 0).all()


def test_drive_to_turns_the_short_way(robot: Robot, plant: Any) -> None:
    """From a heading of 3 rad to -3 rad it turns 0.28 rad, not 6."""
    moved(plant, 0, 0, 3.0)
    plant.run(make(robot, "drive_to", goal=(0.0, 0.0, -3.0)), 6.0)
    assert plant.pose[2] == pytest.approx(2 * np.pi - 3.0, abs=0.011)


def test_drive_to_returns_when_carried_away(robot: Robot, plant: Any) -> None:
    """Arrived is not for ever: moved by 0.2 m it drives back."""
    platform = make(robot, "drive_to", goal=(0.0, 0.0, 0.0))
    plant.run(platform, 1.0)
    moved(plant, 0.2, 0, 0)
    run = plant.run(platform, 6.0)
    assert {s.state for s in run.status} == {"driving", "arrived"}
    assert abs(plant.pose[0]) < 0.006


# --- hold still -----------------------------------------------------------------------------


def test_hold_still_does_not_fidget(robot: Robot, plant: Any) -> None:
    """An estimate that wanders by centimetres below the threshold moves nothing."""
    rng = np.random.default_rng(1)

    def noisy(now: float, estimate: Estimate) -> Estimate:
        estimate.pose[:2] += rng.uniform(-0.01, 0.01, 2)
        return estimate

    assert np.abs(plant.run(make(robot), 5.0, noisy).commands).max() == 0.0


def test_hold_still_returns_slowly_after_a_push(robot: Robot, plant: Any) -> None:
    """Pushed away by 60 mm it comes back to within 6 mm, at 0.05 m/s at most."""
    platform = make(robot)
    plant.run(platform, 0.5)
    moved(plant, 0.0, 0.06, 0.0)
    run = plant.run(platform, 8.0)
    assert abs(plant.pose[1]) < 0.006
    assert np.abs(run.commands[:, :2]).max() <= 0.05 + 1e-9
    assert run.status[-1].state == "holding"


# --- stopping -------------------------------------------------------------------------------


def missing(now: float, estimate: Estimate) -> Estimate | None:
    """Nothing heard."""
    return None


def invalid(now: float, estimate: Estimate) -> Estimate:
    """The observer gave up."""
    return Estimate(
        **{f: getattr(estimate, f) for f in Estimate.__dataclass_fields__ if f != "valid"}
        | {"reason": "covariance"},
        valid=False,
    )


@pytest.mark.parametrize(
    ("see", "word"), [(missing, "no estimate"), (invalid, "invalid: covariance")]
)
def test_without_an_estimate_the_command_is_zero_within_0_45_s(
    robot: Robot, plant: Any, see: Any, word: str
) -> None:
    """From the sway's full speed: zero in 0.45 s, within the limits, with the reason stated."""
    platform = make(robot, "follow_path", path=SWAY)
    before = plant.run(platform, 7.2).commands[-1]
    assert np.hypot(*before[:2]) > 0.29
    run = plant.run(platform, 1.0, see)
    assert (run.commands[9:] == 0).all()
    steps = np.abs(np.diff(np.vstack([before, run.commands]), axis=0))
    assert (steps <= np.array(robot.platform.acceleration_limit) * 0.05 + 1e-9).all()
    assert {s.state for s in run.status} == {"blind"}
    assert all(word in s.reason for s in run.status)
    assert run.status[-1].votes == {"stop": [0.0, 0.0, 0.0, 1.0]}


def test_an_estimate_older_than_50_ms_stops_and_a_fresh_one_goes_on(
    robot: Robot, plant: Any
) -> None:
    """50 ms are driven on; 60 ms are not; the age is stated; it goes on by itself afterwards."""
    platform = make(robot, "follow_path", path=SWAY)
    estimate = plant.estimate(0.0)
    assert platform.step(0.05, estimate)[1].state == "following"
    status = platform.step(0.06, estimate)[1]
    assert status.state == "blind" and "60 ms old; the limit is 50 ms" in status.reason
    assert platform.step(0.10, plant.estimate(0.10))[1].state == "following"


def test_stop_lasts_until_resume(robot: Robot, plant: Any) -> None:
    """A stop outlives a new goal; resume then drives to it."""
    platform = make(robot)
    platform.stop("asked for by a person")
    platform.set_goal(0.3, 0.0, 0.0)
    run = plant.run(platform, 1.0)
    assert {(s.state, s.reason) for s in run.status} == {("stopped", "asked for by a person")}
    assert (run.commands == 0).all()
    platform.resume()
    plant.run(platform, 5.0)
    assert plant.pose[0] == pytest.approx(0.3, abs=0.006)


def test_restarted_process_comes_up_stopped(robot: Robot, plant: Any) -> None:
    """Whoever was killed does not set off by itself again."""
    platform = Platform(robot, BaseTask(behaviour="drive_to", goal=(1.0, 0.0, 0.0)), restarted=True)
    run = plant.run(platform, 1.0)
    assert (run.commands == 0).all()
    assert "resume" in run.status[-1].reason
    platform.resume()
    assert plant.run(platform, 1.0).status[-1].state == "driving"


# --- requests and extension -----------------------------------------------------------------


def test_bad_request_is_refused_and_changes_nothing(robot: Robot, plant: Any) -> None:
    """Unknown names, missing keys, nonsense and impossible paths are refused with the reason."""
    platform = make(robot)
    fast = {"kind": "circle", "radius": 1.0, "speed": 2.0}
    for word, request in (
        ("'keep_in_reach' or 'program'", {"behaviour": "dance"}),
        ("needs 'goal'", {"behaviour": "drive_to"}),
        ("goal", {"behaviour": "drive_to", "goal": (float("nan"), 0, 0)}),
        ("goall", {"behaviour": "drive_to", "goall": (0, 0, 0)}),
        ("vx reaches 2.00; the limit is 1.2", {"behaviour": "follow_path", "path": fast}),
    ):
        with pytest.raises(ValueError, match=word):
            platform.set_behaviour(**request)
    assert plant.run(platform, 0.2).status[-1].state == "holding"


class Crawl:
    """A behaviour of somebody else's, known to nobody: slower than 0.1 m/s, please."""

    name = "crawl"
    state = "crawling"

    def vote(self, now: float, senses: Senses) -> Vote:
        """Only a bound."""
        return Vote(np.zeros(3), weight=0.0, bound=np.array([0.1, 0.1, 0.1]))


def test_a_new_behaviour_takes_part_by_being_added(robot: Robot, plant: Any) -> None:
    """One class elsewhere bounds a drive, is shown with its vote, and cannot be added twice."""
    platform = make(robot, "drive_to", goal=(1.0, 0.0, 0.0))
    platform.add(Crawl())
    run = plant.run(platform, 5.0)
    assert np.abs(run.commands).max() <= 0.1 + 1e-12
    assert run.status[-1].votes["crawl"] == [0.0, 0.0, 0.0, 0.0]
    assert run.status[-1].votes["drive_to"][0] > 0.1
    with pytest.raises(ValueError, match="crawl"):
        platform.add(Crawl())


class Broken(Crawl):
    """Divides by zero now and then."""

    name = "broken"

    def vote(self, now: float, senses: Senses) -> Vote:
        """Not a number."""
        return Vote(np.full(3, np.nan))


def test_a_behaviour_that_votes_nonsense_stops_the_platform_by_name(
    robot: Robot, plant: Any
) -> None:
    """A velocity that is no number counts as a stop, and its author is named."""
    platform = make(robot, "drive_to", goal=(1.0, 0.0, 0.0))
    platform.add(Broken())
    run = plant.run(platform, 1.0)
    assert (run.commands == 0).all()
    assert "broken" in run.status[-1].reason


def test_what_is_published_passes_the_check_of_the_wire(robot: Robot, plant: Any) -> None:
    """Command and status are messages that any receiver accepts."""
    platform = make(robot, "follow_path", path=SWAY)
    for message in platform.step(0.0, plant.estimate(0.0)):
        kind: Any = type(message)
        content = {name: getattr(message, name) for name in kind.__dataclass_fields__}
        assert isinstance(check(kind, content), (BaseCommand, BaseStatus))


def test_same_inputs_give_bit_identical_commands(robot: Robot, plant: Any) -> None:
    """Stepped twice through the same story, the platform does the same to the last bit."""
    runs = [
        type(plant)(robot).run(make(robot, "follow_path", path=SWAY), 5.0).commands
        for _ in range(2)
    ]
    np.testing.assert_array_equal(runs[0], runs[1])
