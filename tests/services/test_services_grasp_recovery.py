"""The table of recoveries from pushes."""

from __future__ import annotations

from typing import Any

import pytest
from pydantic import ValidationError

from services.trials.experiments.grasp_box import Options, summary
from services.trials.grasp_recovery import cells, picture


def one(variant: str, size: float) -> dict[str, Any]:
    """A funnel is defeated from 60 N s on; at 80 N s the box falls."""
    falls = size >= 80.0
    return {
        "success": not falls and (variant == "sequential" or size < 60.0),
        "end": "Hold",
        "off_table": falls,
        "pushed_s": 2.0 if variant != "sum" else None,
        "peak_force_n": size,
        "fell_back": 1,
        "tilt_end_deg": 0.0,
    }


def test_boxes_that_fell_are_counted_apart_and_trials_without_a_push_not_at_all() -> None:
    """A share is of the boxes left on the table; the sum never came so far as to be pushed."""
    row = {"cells": cells(("sequential", "funnel", "sum"), (40.0, 60.0, 80.0), one)}
    found = {line.label: line for line in summary([row, row])}
    lifted = "lifted, of those left on the table"
    assert found[f"sequential, 60 N s: {lifted}"].value == 1.0
    assert found[f"funnel, 40 N s: {lifted}"].value == 1.0
    assert found[f"funnel, 60 N s: {lifted}"].value == 0.0
    assert found[f"sequential, 80 N s: {lifted}"].n == 0
    assert found["sequential, 80 N s: off the table"].value == 1.0
    assert not any(label.startswith("sum") for label in found)
    assert picture([row]) is not None


def test_a_table_is_of_pushes_from_in_front_of_the_box() -> None:
    """Variants without a push have no recovery; the refusal says what is needed."""
    assert Options(variant="all", push="arm", impulse=(40.0, 60.0)).table
    with pytest.raises(ValidationError, match="are of a push"):
        Options(variant="all")
    with pytest.raises(ValidationError, match="are of a push"):
        Options(variant="all", start="far", push="arm", impulse=40.0)
