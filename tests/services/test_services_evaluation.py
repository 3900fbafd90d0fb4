"""Figures of a run, on messages whose figures are known."""

from __future__ import annotations

import numpy as np
import pytest

from deploy.task import BoardPose
from services.logs.runlog import RunLog
from services.messages import ArmStatus, Estimate, Truth
from services.reports.evaluation import (
    axis_ratio,
    distance_to_path,
    figures_of,
    pen_figures,
    strokes_of,
)
from services.topics import ARM_STATUS, ESTIMATE, TRUTH

SPEED = 0.04  # [m/s]


def straight(offset: float, pause: float = 0.0, force: float = 1.5) -> RunLog:
    """A 40 mm line to the right, drawn ``offset`` [m] too high, interrupted once for ``pause``."""
    log = RunLog()
    for k in range(51):
        t = 1.0 + 0.02 * k + (pause if k >= 25 else 0.0)
        reference = np.array([SPEED * 0.02 * k, 0.0, 0.0])
        velocity = np.array([SPEED, 0.0, 0.0])
        log(
            ARM_STATUS,
            ArmStatus(
                t=t, state="running", stroke=1, reference=reference, reference_velocity=velocity,
                force_reference=1.5,
            ),
        )  # fmt: skip
        if pause and k == 24:
            log(ARM_STATUS, ArmStatus(t=t + 0.02, state="paused"))
    for k in range(int((1.4 + pause) * 200)):
        t = 0.9 + 0.005 * (k + 1)
        samples = np.zeros((5, 4))
        for i in range(5):
            at = t + 0.001 * (i - 4)
            drawing = at - 1.0 if not pause or at < 1.49 else at - 1.0 - pause
            away = bool(pause) and 1.49 < at < 1.49 + pause
            samples[i] = (SPEED * drawing, offset, 0.0, 0.0 if away else force)
        zero, six = np.zeros(3), np.zeros(6)
        log(
            TRUTH,
            Truth(
                t=t, pose=zero, velocity=zero, acceleration=zero, q=six, qd=six, tip=zero,
                force=force, contact=True, recent=samples,
            ),
        )  # fmt: skip
    return log


def believing(log: RunLog, error: tuple[float, float, float]) -> RunLog:
    """The same with an estimate that is off by ``error`` [m, m, rad]."""
    zero = np.zeros(3)
    for truth in log.series(TRUTH):
        log(
            ESTIMATE,
            Estimate(
                t=truth.t, pose=np.array(error), velocity=zero, acceleration=zero,
                covariance=np.eye(6), gyro_bias=0.0, accel_bias=np.zeros(2),
                odometry_innovation=zero, odometry_nis=0.0, imu_innovation=zero, imu_nis=0.0,
                odometry_age=0.0, imu_age=0.0, command_age=0.0,
            ),
        )  # fmt: skip
    return log


def upright(log: RunLog) -> RunLog:
    """The same line, turned from right to up."""
    for s in log.series(ARM_STATUS):
        for vector in (s.reference, s.reference_velocity):
            vector[:2] = vector[1], vector[0]
    for truth in log.series(TRUTH):
        truth.recent[:, :2] = truth.recent[:, 1::-1]
    return log


@pytest.mark.parametrize(
    ("error", "moved"),
    [((0.0, 3e-4, 0.0), 0.3), ((0.0, 0.0, 5e-4), 0.34), ((3e-4, 0.0, 0.0), 0.0)],
)
def test_what_the_estimate_does_to_a_line(error: tuple[float, float, float], moved: float) -> None:
    """Its error sideways, and its heading error times the distance, move an upright line."""
    figures = pen_figures(believing(upright(straight(3e-4)), error), BoardPose(x=0.68))
    assert figures["estimate_at_pen_rms_mm"] == pytest.approx(moved, abs=2e-3)
    if moved:
        assert figures["line_over_estimate"] == pytest.approx(0.3 / moved, rel=0.01)


def test_a_level_line_does_not_show_the_estimate() -> None:
    """Along the path and into the board, the estimate's error is no error of the line."""
    figures = pen_figures(believing(straight(2e-4), (0.0, 3e-4, 0.0)), BoardPose())
    assert figures["estimate_at_pen_rms_mm"] == pytest.approx(0.0, abs=1e-6)


def test_a_line_drawn_too_high_has_that_error() -> None:
    """An offset across the line is its contour error, rms and largest."""
    figures = figures_of(straight(2e-4, force=1.6))
    assert figures["line_rms_mm"] == pytest.approx(0.2, abs=1e-6)
    assert figures["line_max_mm"] == pytest.approx(0.2, abs=1e-6)
    assert figures["tracked_rms_mm"] == pytest.approx(0.2, abs=1e-3)
    assert figures["contact_fraction"] == 1.0
    assert figures["force_rms_error_n"] == pytest.approx(0.1, abs=1e-6)
    assert figures["circle_axis_ratio"] is None


def test_an_interruption_is_not_judged() -> None:
    """The time between the pieces of an interrupted stroke counts for nothing."""
    log = straight(0.0, pause=0.5)
    pieces = strokes_of(log)
    assert len(pieces) == 2
    assert pieces[0].t[-1] < 1.5
    assert pieces[1].t[0] > 1.9


def test_distance_and_ratio_of_known_curves() -> None:
    """A point off a polyline, and an ellipse of 0.98."""
    path = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]])
    found = distance_to_path(np.array([[0.5, 0.1], [1.2, 0.5], [2.0, 1.0]]), path)
    np.testing.assert_allclose(found, [0.1, 0.2, 1.0])
    angle = np.linspace(0, 2 * np.pi, 500)
    ellipse = np.column_stack([np.cos(angle), 0.98 * np.sin(angle)]) + [0.3, -0.2]
    assert axis_ratio(ellipse) == pytest.approx(0.98, abs=1e-3)
