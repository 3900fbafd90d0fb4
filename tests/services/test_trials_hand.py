"""Grasps by touch in one process: they converge, hold, and say what went wrong."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from arm.hand.plan import PAIR, THREE, Plan
from services.trials.experiments import grasp_controllers
from services.trials.hand_experiment import Options, run_thing
from services.trials.hand_figures import angle, rise
from services.trials.hand_pictures import density

NEAR = (0.0, 0.4)


@pytest.mark.parametrize(("plan", "square"), [(THREE, 0.0), (PAIR, np.pi / 2)])
def test_fingers_slide_to_a_grasp_of_a_roll(plan: Plan, square: float) -> None:
    """Residuals fall, the line or plane becomes square to the axis, and contact is kept."""
    row = run_thing(0, Options(), "roll", plan, NEAR)
    assert row["outcome"] == "converged"
    assert row["updates"] < 150
    assert row["rho"][1] < 0.08 and row["moment"][1] < 0.12
    assert row["angle_after"] == pytest.approx(square, abs=0.08)
    assert row["eps_03"] > 0.0
    assert row["off"] < 0.01
    assert row["normal_rms"] < 0.05
    assert row["force_rms"] < 0.2


def test_a_mesh_of_the_roll_is_grasped_like_the_roll(tmp_path: Path) -> None:
    """The same start ends at as good a grasp."""
    file = str(tmp_path / "roll.stl")
    trimesh.creation.cylinder(radius=0.05, height=0.2, sections=48).export(file)
    meshed, exact = (run_thing(0, Options(), thing, PAIR, NEAR) for thing in (file, "roll"))
    assert meshed["outcome"] == exact["outcome"] == "converged"
    assert meshed["eps_03"] == pytest.approx(exact["eps_03"], rel=0.2)
    assert meshed["angle_after"] == pytest.approx(exact["angle_after"], abs=0.05)
    assert meshed["off"] < 0.01


def test_a_trial_is_a_function_of_its_seed() -> None:
    """All figures of two runs are equal to the last bit."""
    first, second = (run_thing(5, Options(), "roll", THREE, NEAR) for _ in range(2))
    assert first == second


def test_a_roll_is_lifted_and_survives_shake_and_push() -> None:
    """0.5 kg, six directions of gravity, 20 N along three axes: less than 2 cm."""
    row = run_thing(1, Options(lift=True), "roll", THREE, NEAR)
    assert row["outcome"] == "held" and row["lifted_m"] > 0.1
    assert len(row["shake_m"]) == 6 and max(row["shake_m"]) < 0.02
    assert max(row["push_m"]) < 0.02


def test_a_dead_load_cell_stops_the_grasp_before_anything_moves() -> None:
    """The outcome names the finger."""
    row = run_thing(0, Options(fault="dead"), "roll", THREE, NEAR)
    assert row["outcome"] == "load cell of finger 1 is dead"
    assert row["peak_n"] == 0.0 and not row["success"]


def test_fingers_that_close_on_nothing_say_so() -> None:
    """Without an object nothing is touched and nothing is pressed."""
    row = run_thing(0, Options(fault="missing", tries=1), "roll", THREE, NEAR)
    assert row["outcome"] == "nothing there"
    assert row["peak_n"] == 0.0


def test_controllers_are_compared_from_the_same_start() -> None:
    """A row has each controller's trial; they differ, and where they start from does not."""
    options = grasp_controllers.Options(controllers=("sum", "curvature"), tilt=NEAR)
    row = grasp_controllers.run(1, options)
    assert row["sum"]["angle_before"] == row["curvature"]["angle_before"]
    assert row["sum"]["rho"] != row["curvature"]["rho"]
    labels = [line.label for line in grasp_controllers.summary([row])]
    assert "curvature: grasp found" in labels


def test_orientation_is_folded_and_its_density_is_one_in_all() -> None:
    """The measure of Figs 4.4 and 4.8, and its kernel density."""
    axis = np.array([0.0, 0.0, 1.0])
    points = np.array([[0.0, 0.05, 0.0], [0.0, -0.05, 0.01], [0.0, -0.05, -0.01]])
    assert angle(points, axis, True) == pytest.approx(np.pi / 2)
    assert angle(points, axis, False) == pytest.approx(np.pi / 2)
    at = np.linspace(0.0, np.pi / 2, 400)
    assert np.trapezoid(density([0.0, 0.4, 1.57], at), at) == pytest.approx(1.0, abs=0.02)


def test_a_residual_that_rises_is_noticed_and_one_that_jitters_is_not() -> None:
    """Smoothed over 0.2 s."""
    falling = np.linspace(1.0, 0.0, 60) + 0.01 * np.cos(np.arange(60) * 3.0)
    assert rise(falling.tolist()) < 0.01
    assert rise([*falling.tolist(), *[0.4] * 20]) > 0.3
