"""Whole flights in the product's steps, against flights whose plant is integrated to ten digits."""

import pytest

from tests.support.flights.exact_plant import exactly, farthest, flown, in_steps

MAX_ERROR = 0.2  # [mm]


@pytest.mark.parametrize(("name", "jumps"), [("forward-to-hover", 6), ("hover", 0)])
def test_no_flight_is_farther_from_the_exact_one_than_a_fifth_of_a_millimetre(name, jumps):
    exact, exact_jumps = flown(name, exactly)
    positions, found = flown(name)
    assert farthest(positions, exact) < MAX_ERROR
    assert found == exact_jumps
    assert len(found) == jumps


def test_a_plant_that_is_moved_from_outside_flies_the_simulation_s_own_flight():
    """So what replaces the plant, replaces nothing else."""
    (own, own_jumps), (replaced, jumps) = flown("hover"), flown("hover", in_steps(1.0))
    assert (own == replaced).all()
    assert own_jumps == jumps
