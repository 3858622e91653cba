"""Seeded flights: in order, counted as they are done, refused where there is nothing to fly."""

import pytest

from sitl import SitlError
from sitl.lab.studies.seeded_flights import fly_draws, seeds


def test_results_are_in_the_order_of_the_seeds_and_each_is_counted():
    done = []
    assert fly_draws(str, seeds(3, 7), jobs=1, on_progress=done.append) == ["7", "8", "9"]
    assert done == [1, 2, 3]


@pytest.mark.parametrize(
    ("flights", "first", "words"), [(0, 1, "0 flights"), (-2, 1, "-2 flights"), (3, -1, "seed -1")]
)
def test_no_flights_and_negative_seeds_are_refused(flights, first, words):
    with pytest.raises(SitlError, match=words):
        seeds(flights, first)


@pytest.mark.parametrize(("draws", "jobs"), [([], 1), ([1], 0)])
def test_nothing_to_fly_and_no_process_are_refused(draws, jobs):
    with pytest.raises(SitlError, match="both must be at least 1"):
        fly_draws(str, draws, jobs)
