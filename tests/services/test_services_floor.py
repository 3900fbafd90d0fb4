"""The picture of the floor and the platform's figures, on ways whose figures are known."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from deploy.task import BaseTask
from services.cli.common import console
from services.cli.run import show
from services.logs.runlog import RunLog
from services.messages import ArmStatus, BaseCommand, BaseStatus, Estimate, Truth
from services.reports.floor_picture import floor
from services.reports.force_picture import force
from services.reports.pictures import write_pictures
from services.reports.platform_figures import PLATFORM_FIGURES, platform_figures
from services.run import all_figures
from services.topics import ARM_STATUS, BASE_COMMAND, BASE_STATUS, ESTIMATE, TRUTH
from sim.obstacle_specs import Mover, Pillar
from sim.scenario import Scenario, World

TASK = BaseTask(behaviour="drive_to", goal=(2.0, 0.0, 0.0), start_at=1.0)
PILLAR = Pillar(x=1.0, y=0.5, radius=0.1)
RADIUS = 0.31


def speed_at(t: float) -> float:
    """Along x [m/s]: 0.5 from 1 s on, a stop of 1 s at 2 s, 0.5 until 5.8 s."""
    return 0.5 if 1.0 <= t < 2.0 or 3.0 <= t < 5.8 else 0.0


def drive(
    speed: Callable[[float], float] = speed_at, clearance: float = 0.09, drift: float = 0.0
) -> RunLog:
    """7 s straight along x at the commanded speed; the estimate lies ``drift`` [m] to the left."""
    log, zero, six, x = RunLog(), np.zeros(3), np.zeros(6), 0.0
    for k in range(1400):
        t = k / 200
        velocity = np.array([speed(t), 0.0, 0.0])
        pose = np.array([x, 0.0, 0.0])
        x += velocity[0] / 200
        log(
            TRUTH,
            Truth(
                t=t, pose=pose, velocity=velocity, acceleration=zero, q=six, qd=six, tip=zero,
                force=0.0, clearance=clearance,
            ),
        )  # fmt: skip
        log(
            ESTIMATE,
            Estimate(
                t=t, pose=pose + [0.0, drift, 0.0], velocity=velocity, acceleration=zero,
                covariance=np.eye(6), gyro_bias=0.0, accel_bias=np.zeros(2),
                odometry_innovation=zero, odometry_nis=0.0, imu_innovation=zero, imu_nis=0.0,
                odometry_age=0.0, imu_age=0.0, command_age=0.0,
            ),
        )  # fmt: skip
        if k % 10 == 0:
            state = "blocked" if 2.0 <= t < 3.0 else "arrived" if t >= 6.0 else "drive_to"
            log(BASE_COMMAND, BaseCommand(t=t, velocity=velocity))
            log(BASE_STATUS, BaseStatus(t=t, state=state, chosen=velocity))
    return log


def labels(figure: Figure | None) -> str:
    """All that the legend says."""
    assert figure is not None
    return " ".join(text.get_text() for text in figure.legends[0].get_texts())


def test_a_known_drive_has_its_figures() -> None:
    """Way, time from the start of the task, clearance, goal, commands, one stop, its time."""
    figures = platform_figures(drive(), TASK)
    known = {
        "platform_way_m": 1.9,
        "platform_time_s": 5.0,
        "platform_clearance_mm": 90.0,
        "platform_goal_mm": 100.0,
        "platform_goal_deg": 0.0,
        "platform_speed": 0.5,
        "platform_acceleration": 10.0,
        "platform_jerk": 200.0,
        "platform_stops": 1.0,
        "platform_blocked_s": 1.0,
    }
    assert figures == pytest.approx(known, abs=1e-6)
    assert tuple(figures) == PLATFORM_FIGURES


def test_what_has_no_meaning_has_no_figure() -> None:
    """Nothing at all without a task; no clearance on an empty floor, no time before the end."""
    standing = platform_figures(drive(lambda t: 0.0), BaseTask())
    assert set(standing.values()) == {None}
    log = drive(clearance=1e3)
    log.messages[BASE_STATUS.name] = [s for s in log.series(BASE_STATUS) if s.t < 5.0]
    figures = platform_figures(log, TASK.model_copy(update={"goal": None}))
    for key in ("time_s", "clearance_mm", "goal_mm", "goal_deg"):
        assert figures[f"platform_{key}"] is None
    assert figures["platform_way_m"] is not None


def test_without_an_arm_nobody_is_shown_its_pen(tmp_path: Path) -> None:
    """Neither rows nor the force; an arm that only idles is none. The keys stay in the result."""
    log, scenario = drive(), Scenario()
    log(ARM_STATUS, ArmStatus(t=1.0))
    result = all_figures(log, scenario)
    assert result["arm_worked"] is False and "line_rms_mm" in result
    names = {path.name for path in write_pictures(log, tmp_path, "alone", scenario)}
    assert "floor.png" in names and "force.png" not in names
    about = {"scenario": "alone", "observer": "ekf", "seed": 1, "outcome": "finished"}
    with console.capture() as shown:
        show(about | result)
    assert "way driven" in shown.get() and "ripple" not in shown.get()
    assert "pen" not in shown.get()
    log(ARM_STATUS, ArmStatus(t=1.1, state="running", program="Whiteboard"))
    assert force(log, "drawing") is not None
    with console.capture() as shown:
        show(about | all_figures(log, scenario))
    assert "ripple" in shown.get()


def test_a_platform_that_stands_on_an_empty_floor_has_no_picture() -> None:
    """It has one if it moved, or if something stands there."""
    still = drive(lambda t: 0.0)
    assert floor(still, "", Scenario()) is None
    assert floor(still, "", Scenario(world=World(obstacle=(PILLAR,)))) is not None
    assert floor(drive(), "", Scenario()) is not None


def test_the_picture_says_how_near_it_came_and_when() -> None:
    """To what stands and to who walks, from edge to edge, by the true poses and obstacles."""
    walker = Mover(points=((1.5, 3.0), (1.5, 1.0)), speed=1.0, start_at=2.0, radius=0.2)
    text = labels(floor(drive(), "", Scenario(world=World(obstacle=(PILLAR, walker)))))
    assert "an obstacle\n(platform dashed): 90 mm, 4.0 s" in text
    # the walker stands at its last point from 4 s on; the platform is below it at 5 s
    assert f"the walker\n(platform dashed): {1e3 * (1.0 - RADIUS - 0.2):.0f} mm, 5.0 s" in text


def test_the_estimate_is_drawn_where_it_differs() -> None:
    """An estimate within 20 mm lies on the true way, and is left out."""
    assert "estimated" in labels(floor(drive(drift=0.05), "", Scenario()))
    assert "estimated" not in labels(floor(drive(drift=0.01), "", Scenario()))


def test_the_legend_covers_no_data() -> None:
    """It lies beside the plan, whatever the plan's shape; the plan is to scale."""
    for obstacle in (PILLAR, Pillar(x=0.0, y=3.5, radius=0.1), Pillar(x=5.0, y=0.0, radius=0.1)):
        figure = floor(drive(), "", Scenario(world=World(obstacle=(obstacle,))))
        assert figure is not None
        figure.canvas.draw()
        plan = figure.axes[0].get_window_extent()
        legend = figure.legends[0].get_window_extent()
        assert legend.x0 > plan.x1 and figure.bbox.x1 >= legend.x1 and legend.y0 >= 0
        x, y = figure.axes[0].get_xlim(), figure.axes[0].get_ylim()
        assert plan.width / (x[1] - x[0]) == pytest.approx(plan.height / (y[1] - y[0]), rel=1e-3)
