"""A live arm in a flood of junk, lies and requests accepts nothing and goes on."""

from __future__ import annotations

import pytest

from services.bench.hostile import READABLE, Profile, Result, flood_arm


@pytest.mark.processes
@pytest.mark.parametrize("profile", ["open", "secure"])
def test_nothing_hostile_is_accepted(profile: Profile) -> None:
    """In the open profile Python refuses it; in the secure one it does not get that far.

    How late the loop is depends on the machine: ``steadyhand bench hostile`` says. Here it is only
    heard in quiet and under the flood.
    """
    done = flood_arm(4000, 2000.0, profile, seed=1)
    assert done.accepted == 0
    assert done.alive
    assert done.quiet and done.flooded
    if profile == "open":
        assert all(done.refused_on(topic.name) > 0 for topic in READABLE)
    else:
        assert sum(done.refused.values()) == sum(done.late.values())


def test_lateness_is_compared_within_a_run() -> None:
    """The middle heartbeat under the flood over that in quiet: a single bad one is no matter."""
    done = Result(quiet=[1e-4, 2e-4, 9e-3], flooded=[9e-1, 3e-4, 1e-4])
    assert done.ratio == pytest.approx(1.5)
