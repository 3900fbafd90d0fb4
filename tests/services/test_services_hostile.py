"""A live arm in a flood of junk, lies and requests accepts nothing and goes on."""

from __future__ import annotations

import pytest

from services.bench.hostile import READABLE, Profile, flood_arm


@pytest.mark.processes
@pytest.mark.parametrize("profile", ["open", "secure"])
def test_nothing_hostile_is_accepted(profile: Profile) -> None:
    """In the open profile Python refuses it; in the secure one it does not get that far.

    How late the loop is depends on the machine: ``steadyhand bench hostile`` says.
    """
    done = flood_arm(4000, 2000.0, profile, seed=1)
    assert done.accepted == 0
    assert done.alive
    if profile == "open":
        assert all(done.refused_on(topic.name) > 0 for topic in READABLE)
    else:
        assert sum(done.refused.values()) == sum(done.late.values())
