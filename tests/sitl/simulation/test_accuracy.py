"""Whole flights in the product's steps, against flights whose plant is integrated to ten digits."""

import pytest

from tests.support.flights.exact_plant import exactly, farthest, flown, in_steps

MAX_ERROR = 0.2  # [mm]


@pytest.mark.long
@pytest.mark.parametrize(("name", "jumps", "seconds"), [("forward-to-hover", 6, 11.0), ("hover", 0, 6.0)])
def test_no_flight_is_farther_from_the_exact_one_than_a_fifth_of_a_millimetre(name, jumps, seconds):
    exact, exact_jumps = flown(name, exactly, seconds)
    positions, found = flown(name, seconds=seconds)
    assert farthest(positions, exact) < MAX_ERROR
    assert found == exact_jumps
    assert len(found) == jumps


@pytest.mark.long
def test_a_plant_that_is_moved_from_outside_flies_the_simulation_s_own_flight():
    """So what replaces the plant, replaces nothing else."""
    (own, own_jumps), (replaced, jumps) = flown("hover", seconds=3.0), flown("hover", in_steps(1.0), seconds=3.0)
    assert (own == replaced).all()
    assert own_jumps == jumps
