"""Figures and picture of a grasp run."""

from __future__ import annotations

import numpy as np
import pytest

from services.logs.runlog import RunLog
from services.messages import ArmStatus, Truth
from services.reports.grasp import grasp, grasp_figures
from services.topics import ARM_STATUS, TRUTH


def test_figures_of_a_grasp_are_of_runs_with_palms_only() -> None:
    """A run without them has neither, and its pictures stay those of the pen."""
    empty = RunLog()
    assert grasp_figures(empty) == {}
    assert grasp(empty, "nothing") is None


def test_a_lifted_box_is_told_from_the_truth() -> None:
    """Up and held counts; up and in no node that holds it does not."""
    pose = [1.0, 0.0, 0.0, 0.0]
    for node, lifted in (("Lifted", True), ("Lost", False)):
        log = RunLog()
        for t, z in ((0.0, 0.84), (1.0, 1.04)):
            bodies = {
                "box": [0.0, 0.0, z, *pose],
                "left_palm": [0.0, 0.15, z, *pose],
                "right_palm": [0.0, -0.15, z, *pose],
            }
            forces = {"left_palm": [0.0, 25.0, 0.0], "right_palm": [0.0, -30.0, 0.0]}
            zero = np.zeros(3)
            truth = Truth(
                t=t,
                pose=np.array([-0.6, 0.0, 0.0]),
                velocity=zero,
                acceleration=zero,
                q=np.zeros(14),
                qd=np.zeros(14),
                tip=zero,
                force=0.0,
                bodies=bodies,
                forces=forces,
            )
            log.messages.setdefault(TRUTH.name, []).append(truth)
        log.messages.setdefault(ARM_STATUS.name, []).append(ArmStatus(t=1.0, node=node))
        figures = grasp_figures(log)
        assert figures["lifted"] is lifted
        assert figures["box_height_mm"] == pytest.approx(200.0)
        assert figures["palm_force_peak_n"] == pytest.approx(30.0)
        assert grasp(log, "two samples") is not None
