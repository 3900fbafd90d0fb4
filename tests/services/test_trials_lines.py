"""Intervals of a summary hold what they promise."""

from __future__ import annotations

import numpy as np
import pytest

from services.trials.lines import middle, share, worst


def test_share_is_the_textbook_interval() -> None:
    """Wilson for 8 of 10, Clopper and Pearson for 0 of 10 (the rule of three, nearly)."""
    line = share("s", [True] * 8 + [False] * 2)
    assert (line.low, line.high) == pytest.approx((0.4902, 0.9433), abs=1e-4)
    line = share("s", [False] * 10, method="exact")
    assert (line.low, line.high) == pytest.approx((0.0, 0.3085), abs=1e-4)


def test_bootstrap_covers_the_median() -> None:
    """Over 100 samples the 95 % interval of the median holds the true one about as often."""
    rng = np.random.default_rng(3)
    held = 0
    for _ in range(100):
        line = middle("m", rng.exponential(size=60))
        assert line.low is not None
        assert line.high is not None
        held += line.low <= np.log(2.0) <= line.high
    assert held >= 89  # 95 less two standard deviations, and a percentile bootstrap is narrow


def test_the_same_rows_give_the_same_interval() -> None:
    """A summary can be compared bit for bit."""
    values = list(np.random.default_rng(0).normal(size=30))
    assert middle("m", values) == middle("m", values)


@pytest.mark.parametrize("values", [[], [2.0], [2.0, 2.0], [None, 2.0]])
def test_few_or_equal_values_are_no_error(values: list[float | None]) -> None:
    """No value, one, or all alike: a line, with an interval where there can be one."""
    line = middle("m", values, goal=3.0)
    assert line.n == len([x for x in values if x is not None])
    assert line.met is (True if line.n else None)
    assert share("s", []).value is None
    assert worst("w", values).low is None


def test_goals_have_a_direction() -> None:
    """A share must be reached, a figure not exceeded, unless said otherwise."""
    assert share("s", [True, False], goal=0.6).met is False
    assert middle("m", [1.0], goal=0.6).met is False
    assert middle("m", [1.0], goal=0.6, least=True).met is True
    assert worst("w", [1.0, 0.5], goal=0.6, least=True).met is False
