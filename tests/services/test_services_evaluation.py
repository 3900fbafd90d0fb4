"""Figures of a run, on messages whose figures are known."""

from __future__ import annotations

import numpy as np
import pytest

from services.evaluation import axis_ratio, distance_to_path, figures_of, strokes_of
from services.messages import ArmStatus, Truth
from services.runlog import RunLog
from services.topics import ARM_STATUS, TRUTH

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
