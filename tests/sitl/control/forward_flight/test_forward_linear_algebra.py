"""The linear forward law's sums, written out entry by entry, against matrices without a zero."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sitl.control.forward_flight import forward_linear as law
from sitl.control.forward_flight.forward_linear import ForwardError, ForwardGains

RNG = np.random.default_rng(11)
SPEEDS, CLIMBS = np.array((0.0, 5.0, 10.0, 15.0)), np.array((-0.4, 0.0, 0.4))
HALVES = RNG.normal(size=(4, 11, 11))
GAINS = ForwardGains(
    speeds=SPEEDS,
    climbs=CLIMBS,
    K=RNG.normal(size=(4, 4, 11)),
    S=HALVES + HALVES.transpose(0, 2, 1),
    theta=RNG.normal(size=(4, 3)),
    thrust=RNG.normal(size=(4, 3)),
    delta=RNG.normal(size=(4, 3)),
    reach=4.0,
)
errors = st.builds(ForwardError, *[st.floats(-2.0, 2.0)] * 11)
speeds = st.floats(-1.0, 17.0)


def between(table, speed):
    """Linear interpolation over the airspeeds, held at the ends."""
    place = min(max(speed / 5.0, 0.0), 3.0)
    i = min(int(place), 2)
    return table[i] + (place - i) * (table[i + 1] - table[i])


def trim(table, speed, climb):
    return float(np.interp(climb, CLIMBS, between(table, speed)))


@given(x=errors, speed=speeds)
def test_v_is_the_form_of_every_entry_of_s(x, speed):
    vector = np.array(x)
    assert law.quadratic(x, speed, GAINS) == pytest.approx(vector @ between(GAINS.S, speed) @ vector, abs=1e-9)


@given(x=errors, speed=speeds, climb=st.floats(-0.6, 0.6))
def test_the_command_is_the_trim_less_every_entry_of_k(x, speed, climb):
    vector = np.array(x)
    thrust, delta = trim(GAINS.thrust, speed, climb), trim(GAINS.delta, speed, climb)
    expected = np.array((thrust, thrust, delta, delta)) - between(GAINS.K, speed) @ vector
    assert law.control(x, speed, climb, GAINS) == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize(("left", "above"), [(30.0, 40.0), (-6.0, 0.0), (0.0, 4.001)])
def test_from_far_away_the_offset_counts_as_its_reach_in_its_own_direction(left, above):
    far = ForwardError(left, above, *[0.1] * 9)
    near = 4.0 / math.hypot(left, above)
    shortened = far._replace(left=near * left, above=near * above)
    assert law.control(far, 7.0, 0.1, GAINS) == pytest.approx(law.control(shortened, 7.0, 0.1, GAINS))
    assert law.quadratic(far, 7.0, GAINS) != pytest.approx(law.quadratic(shortened, 7.0, GAINS))


def test_the_schedule_in_force_is_what_both_use():
    K, S = law.scheduled(GAINS, 6.5)
    assert pytest.approx(between(GAINS.K, 6.5)) == K
    assert pytest.approx(between(GAINS.S, 6.5)) == S


@given(speed=st.floats(-3.0, 20.0), climb=st.floats(-1.0, 1.0))
def test_a_trim_is_bilinear_and_held_beyond_the_ends_of_its_table(speed, climb):
    found = law.bilinear(GAINS.theta, law.cell(speed, SPEEDS), law.cell(climb, CLIMBS))
    assert found == pytest.approx(trim(GAINS.theta, speed, climb), abs=1e-12)
