"""The schedule of the linear forward law: stable at every speed and climb, without steps, and held at its ends."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sitl.control.forward_flight import forward_linear as law
from sitl.control.forward_flight.forward_linear import ForwardError
from sitl.design.forward_schedule import forward_gains, model
from sitl.design.trim import level_trim
from sitl.errors import SitlError
from sitl.model.airframe_files import load

NOMINAL = load("nominal").parameters
GAINS = forward_gains(NOMINAL)
STATES = len(ForwardError._fields)
NONE = ForwardError(*[0.0] * STATES)
angles = st.floats(-math.pi, math.pi)


def random_error(seed):
    return ForwardError(*np.random.default_rng(seed).normal(size=STATES).tolist())


def control(x, airspeed, climb=0.0):
    return np.array(law.control(x, airspeed, climb, GAINS))


def test_every_speed_of_the_grid_and_between_is_stable():
    slowest = {}
    for speed in np.arange(0.0, 25.01, 0.25):
        A, B = model(NOMINAL, level_trim(NOMINAL, float(speed)))
        K, S = law.scheduled(GAINS, float(speed))
        slowest[speed] = np.linalg.eigvals(A - B @ K).real.max()
        assert np.linalg.eigvals(A - B @ K).real.min() > -130.0
        assert np.linalg.eigvalsh(S).min() > 0.0
    assert max(slowest.values()) == pytest.approx(-1.23, abs=0.01)


@pytest.mark.parametrize("climb", [-10.0, 20.0, 45.0])
def test_the_level_gains_hold_climbs_and_descents_too(climb):
    for speed in range(26):
        A, B = model(NOMINAL, level_trim(NOMINAL, float(speed), math.radians(climb)))
        assert np.linalg.eigvals(A - B @ law.scheduled(GAINS, float(speed))[0]).real.max() < -0.5


@given(speed=st.floats(0.0, 25.0), climb=st.floats(-0.3, 0.75))
def test_between_the_grid_the_trims_are_nearly_the_trims(speed, climb):
    trim = level_trim(NOMINAL, speed, climb)
    assert control(NONE, speed, climb) == pytest.approx([trim.thrust, trim.thrust, trim.delta, trim.delta], abs=0.008)


@given(speed=st.floats(0.0, 24.9), seed=st.integers(0, 99))
def test_the_schedule_has_no_steps(speed, seed):
    x = random_error(seed)
    assert control(x, speed + 1e-6) == pytest.approx(control(x, speed), abs=1e-3)
    assert law.quadratic(x, speed + 1e-6, GAINS) == pytest.approx(law.quadratic(x, speed, GAINS), rel=1e-4)


def test_beyond_the_grid_the_schedule_is_its_end():
    x = ForwardError(*[0.1] * STATES)
    assert (control(x, 40.0, 2.0) == control(x, 25.0, math.radians(45.0))).all()
    assert (control(x, -1.0, -2.0) == control(x, 0.0, math.radians(-30.0))).all()
    assert law.cell(math.nan, GAINS.speeds) == (0, 0.0)


@given(speed=st.floats(0.0, 25.0), bearing=angles, distance=st.floats(0.0, 100.0))
def test_the_law_is_linear_within_reach_and_constant_beyond(speed, bearing, distance):
    x = NONE._replace(left=distance * math.cos(bearing), above=distance * math.sin(bearing), p=0.3)
    seen, near = np.array(x), min(1.0, GAINS.reach / max(distance, 1e-9))
    seen[:2] *= near
    K, _ = law.scheduled(GAINS, speed)
    assert control(x, speed) == pytest.approx(control(NONE, speed) - K @ seen, rel=1e-9, abs=1e-9)


def test_a_set_that_nothing_balances_in_level_flight_has_no_forward_law():
    with pytest.raises(SitlError, match=r"no forward law: nothing balances level flight at \d"):
        forward_gains(load("report-table").parameters)
