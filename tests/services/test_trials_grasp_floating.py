"""Floating contacts show what the controllers can do, and what they cannot."""

from __future__ import annotations

from pathlib import Path

import pytest
from pydantic import ValidationError

from services.trials.experiments import grasp_floating as experiment
from services.trials.floating_run import Controller, Setting, grasp

SEEDS = range(4)
BOTH: tuple[Controller, ...] = ("sum", "curvature")


def test_null_space_is_the_sum() -> None:
    """Eq 4.19 and the plain sum take the same steps: same updates, same end."""
    for seed in SEEDS:
        a, b = (grasp("cylinder", "two", c, seed, Setting()) for c in ("null", "sum"))
        assert a["updates"] == b["updates"]
        assert a["rho"] == pytest.approx(b["rho"], abs=1e-9)


def test_a_box_has_no_grasp_of_three() -> None:
    """Three face normals of a box cannot cancel: |rho| is at least 1 wherever points end."""
    for seed in SEEDS:
        trial = grasp("box", "three", "sum", seed, Setting(updates=150))
        assert not trial["success"]
        assert trial["rho"] > 0.99


def test_a_real_null_space_grasps_a_box_with_three() -> None:
    """Round tips that measure curvature find grasps at the box's edges that the sum never does."""
    tips = Setting(tip=0.012)
    found = {
        c: sum(grasp("box", "three", c, seed, tips)["success"] for seed in SEEDS) for c in BOTH
    }
    assert found["sum"] == 0
    assert found["curvature"] >= 2


def test_the_moment_alone_undoes_the_force_on_an_ellipsoid() -> None:
    """C* mostly ends with a force residual that the sum does not have."""
    lost = 0
    for seed in SEEDS:
        assert grasp("ellipsoid", "three", "sum", seed, Setting())["success"]
        lost += grasp("ellipsoid", "three", "C*", seed, Setting())["rho"] > 0.3
    assert lost >= 2


def test_probing_takes_fewer_readings_and_more_time() -> None:
    """A second a reading: slower than 50 slides a second, whatever it learns from each."""
    for seed in SEEDS:
        slid = grasp("cylinder", "two", "sum", seed, Setting())
        probed = grasp("cylinder", "two", "probing", seed, Setting())
        assert probed["success"]
        assert probed["updates"] < slid["updates"]
        assert probed["seconds"] > slid["updates"] / 50.0


def test_a_trial_is_a_function_of_its_seed() -> None:
    """Noise and start come from the seed alone."""
    noisy = Setting(noise=0.05, updates=60)
    assert grasp("squirt", "virtual", "sum", 5, noisy) == grasp(
        "squirt", "virtual", "sum", 5, noisy
    )


def test_table_and_pictures_come_of_the_rows(tmp_path: Path) -> None:
    """Every case has its lines; controllers of physical contacts leave out virtual ones."""
    options = experiment.Options(
        cases=("cylinder two", "box virtual"), controllers=("sum", "curvature"), updates=60
    )
    rows = [experiment.run(seed, options) for seed in range(3)]
    labels = [line.label for line in experiment.summary(rows)]
    assert "cylinder two, curvature: converged" in labels
    assert not any("box virtual, curvature" in label for label in labels)
    assert len(experiment.pictures(rows, tmp_path)) == 3


def test_an_unknown_case_is_refused() -> None:
    """With what there is."""
    with pytest.raises(ValidationError, match="ellipsoid"):
        experiment.Options(cases=("teapot two",))
