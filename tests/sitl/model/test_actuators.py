"""Motors and elevons between command and effect."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl.model.actuators import AT_REST, limited, limits, moved, nodes
from sitl.model.airframe_files import load
from tests.support.flights.plant_flight import OFF, actuators

NOMINAL, FIRST_ORDER = load("nominal").parameters, load("nominal-first-order").parameters
DT = 1e-3


def advanced(now, command, a=NOMINAL, *, armed=True, dt=DT):
    return moved(now, limited(actuators(command), armed, a), dt, a)


@given(st.lists(st.tuples(st.floats(0, 1500), st.floats(0, 1500), st.floats(-2, 2), st.floats(-2, 2)), max_size=20))
@settings(max_examples=40)
def test_actuators_never_leave_their_limits(commands):
    now = actuators((600, 600, 0, 0))
    for command in commands:
        before, now = now, advanced(now, command)
        assert (np.abs(np.subtract(now, before)) <= np.array([3.0, 3.0, 5.24e-3, 5.24e-3]) + 1e-8).all()
        assert min(now[:2]) >= 200.0 - 1e-9
        assert max(now[:2]) <= 1000.0 + 1e-9
        assert max(map(abs, now[2:])) <= NOMINAL.delta_max + 1e-12


@given(
    now=st.builds(lambda *u: actuators(u), *[st.floats(200, 1000)] * 2, *[st.floats(-0.5, 0.5)] * 2),
    command=st.tuples(*[st.floats(200, 1000)] * 2, *[st.floats(-0.5, 0.5)] * 2),
    share=st.floats(0.0, 1.0),
)
@pytest.mark.parametrize("a", [NOMINAL, FIRST_ORDER], ids=["saturated", "first order"])
def test_where_they_are_does_not_depend_on_how_a_step_is_cut(a, now, command, share):
    half_way = advanced(now, command, a, dt=share * DT)
    assert advanced(half_way, command, a, dt=(1.0 - share) * DT) == pytest.approx(advanced(now, command, a), abs=1e-9)


@given(
    now=st.builds(lambda *u: actuators(u), *[st.floats(200, 1000)] * 2, *[st.floats(-0.5, 0.5)] * 2),
    shares=st.tuples(*[st.floats(-1.5, 1.5)] * 4),
)
def test_a_step_is_given_the_line_of_the_same_mean_and_first_moment(now, shares):
    reach = np.array((3.0, 3.0, 5.24e-3, 5.24e-3))
    wanted = actuators(now + reach * shares)
    beginning, middle, end = np.array(nodes(now, wanted, DT, NOMINAL))
    assert beginning + end == pytest.approx(2.0 * middle, rel=1e-12)
    begun = np.array(now)
    # Of the ramp and the rest after it, from the instant at which it rests, in closed form.
    rests = np.minimum(np.abs(shares), 1.0)
    way = np.clip(wanted - begun, -reach, reach)
    mean = begun + way * (1.0 - 0.5 * rests)
    moment = 0.5 * begun + way * (0.5 - rests * rests / 6.0)
    assert middle == pytest.approx(mean, abs=1e-9)
    assert (beginning + 2.0 * end) / 6.0 == pytest.approx(moment, abs=1e-9)


def test_of_a_first_order_actuator_it_is_given_three_looks():
    now, wanted = actuators((400, 500, 0.1, -0.2)), actuators((500, 300, -0.1, 0.3))
    middle, end = advanced(now, wanted, FIRST_ORDER, dt=0.5 * DT), advanced(now, wanted, FIRST_ORDER)
    assert nodes(now, wanted, DT, FIRST_ORDER) == (now, middle, end)


def test_limits_are_flagged_by_actuator():
    now = actuators((1000, 600, 0.0, -NOMINAL.delta_max))
    assert limits(now, actuators((1000.0, 600.0, 0.0, -1.0)), True, DT, NOMINAL) == 1 | 8
    assert limits(now, actuators((999.0, 900.0, 0.5, 0.0)), True, DT, NOMINAL) == 32 | 64 | 128


def test_a_stopped_motor_is_at_no_limit():
    assert limits(actuators(OFF), actuators(OFF), False, DT, NOMINAL) == 0


def test_a_first_order_motor_has_its_time_constant():
    now = actuators((400, 400, 0, 0))
    for _ in range(43):
        now = advanced(now, (500.0, 500.0, 0.0, 0.0), FIRST_ORDER)
    assert (now.left_motor - 400.0) / 100.0 == pytest.approx(1.0 - math.exp(-1.0), abs=1e-6)


def test_disarmed_motors_run_down_to_a_stop():
    now = actuators((700, 700, 0, 0))
    for _ in range(400):
        now = advanced(now, (700.0, 700.0, 0.0, 0.0), armed=False)
    assert now == actuators(OFF)


def test_running_motors_idle_whatever_is_commanded():
    assert limited(actuators(OFF), True, NOMINAL) == actuators((NOMINAL.omega_min, NOMINAL.omega_min, 0.0, 0.0))


def test_what_is_reached_exactly_in_a_step_is_within_the_rate():
    step = 0.1  # long enough for a motor from its stop to within its range
    reach = NOMINAL.omega_rate * step + AT_REST
    for command, flags in ((reach, 0), (math.nextafter(reach, math.inf), 16 | 32)):
        assert limits(actuators(OFF), actuators((command, command, 0.0, 0.0)), True, step, NOMINAL) == flags
    reach = NOMINAL.delta_rate * DT + AT_REST
    now = actuators((600.0, 600.0, 0.0, 0.0))
    for command, flags in ((reach, 0), (-reach, 0), (math.nextafter(reach, 1.0), 64 | 128)):
        assert limits(now, actuators((600.0, 600.0, command, command)), True, DT, NOMINAL) == flags
