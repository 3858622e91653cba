"""Intervals of shares: closed forms at the ends, a printed value, and how often they cover."""

from math import comb

import pytest

from sitl import SitlError
from sitl.lab.studies.proportions import counted, share_bounds


@pytest.mark.parametrize("flown", [1, 20, 400, 2000])
def test_none_and_all_have_the_closed_form(flown):
    none, every = share_bounds(0, flown), share_bounds(flown, flown)
    assert none.low == 0.0
    assert every.high == 1.0
    assert none.high == pytest.approx(1.0 - 0.025 ** (1.0 / flown))
    assert every.low == pytest.approx(0.025 ** (1.0 / flown))


def test_the_ends_are_where_the_count_becomes_unlikely():
    """By the definition: at each end so many, or so few, are seen in one of forty studies."""
    low, high = share_bounds(8, 16)

    def at_least(count, share):
        return sum(comb(16, k) * share**k * (1.0 - share) ** (16 - k) for k in range(count, 17))

    assert at_least(8, low) == pytest.approx(0.025)
    assert 1.0 - at_least(9, high) == pytest.approx(0.025)


@pytest.mark.parametrize("share", [0.02, 0.1, 0.5, 0.97])
def test_the_true_share_is_covered_in_19_of_20_studies(share):
    flown = 60
    covered = sum(
        comb(flown, k) * share**k * (1.0 - share) ** (flown - k)
        for k in range(flown + 1)
        if share_bounds(k, flown).low <= share <= share_bounds(k, flown).high
    )
    assert covered >= 0.95


def test_a_count_is_told_with_its_interval():
    assert counted(59, 60) == "59 of 60 (91.1 to 100.0 %)"
    assert counted(60, 60) == "60 of 60 (94.0 to 100 %)"
    assert counted(0, 3) == "0 of 3 (0 to 70.8 %)"


@pytest.mark.parametrize(("count", "of"), [(0, 0), (3, 2), (-1, 2)])
def test_what_is_no_share_is_refused(count, of):
    with pytest.raises(SitlError, match=f"{count} of {of} is no share"):
        share_bounds(count, of)
