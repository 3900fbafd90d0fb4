"""Retract, the example of docs/node_types.md."""

from __future__ import annotations

import pytest

from tests.arm.test_arm_nodes import node, run


def test_retract_takes_the_tip_off_by_its_distance() -> None:
    """From the board, where a guarded move has found it, to 25 mm in front of that point."""
    rig = run(
        node(
            "A",
            "Guarded_move",
            "DZ = -1; Force = 80; Speed = 40; Distance = 30; TRANSITION[Contact] = R; "
            "TRANSITION[No_Contact] = End; TRANSITION[Out_of_Reach] = End;",
        ),
        node("R", "Retract", "Distance = 25 mm; TRANSITION[Finished] = End;"),
    )
    touched = next(s for s in rig.statuses if s.node == "R")
    assert rig.status.event == "Finished"
    assert rig.desired[-1][2] - touched.reference[2] == pytest.approx(0.025, abs=1e-3)
    assert rig.force[-1] == 0.0
