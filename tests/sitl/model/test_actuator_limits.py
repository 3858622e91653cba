"""The flags of the actuators' limits: one bit for each limit of each actuator, set at the limit and not before it."""

import pytest

from sitl.model.actuators import limits
from sitl.model.airframe_files import load
from tests.support.flights.plant_flight import actuators

NOMINAL, FIRST_ORDER = load("nominal").parameters, load("nominal-first-order").parameters
DT = 1e-3
MIDDLE = (600.0, 600.0, 0.0, 0.0)
MOTOR, ELEVON = NOMINAL.omega_rate * DT, NOMINAL.delta_rate * DT  # what they reach in a step


def flags(now, command, a=NOMINAL, *, armed=True):
    return limits(actuators(now), actuators(command), armed, DT, a)


def changed(index, value):
    return tuple(value if i == index else x for i, x in enumerate(MIDDLE))


@pytest.mark.parametrize(
    ("index", "low", "high"),
    [
        (0, NOMINAL.omega_min, NOMINAL.omega_max),
        (1, NOMINAL.omega_min, NOMINAL.omega_max),
        (2, -NOMINAL.delta_max, NOMINAL.delta_max),
        (3, -NOMINAL.delta_max, NOMINAL.delta_max),
    ],
)
def test_a_command_at_or_beyond_a_limit_of_position_sets_the_actuators_bit(index, low, high):
    bit = 1 << index
    for end, inwards in ((low, 1e-6), (high, -1e-6)):
        assert flags(changed(index, end), changed(index, end)) == bit
        assert flags(changed(index, end), changed(index, end - 1e3 * inwards)) == bit
        assert flags(changed(index, end), changed(index, end + 1e-3 * inwards)) == bit  # a rounding short of it
        assert flags(changed(index, end), changed(index, end + inwards)) == 0


@pytest.mark.parametrize(("index", "reach"), [(0, MOTOR), (1, MOTOR), (2, ELEVON), (3, ELEVON)])
def test_a_command_out_of_reach_within_the_step_sets_the_bit_of_the_rate(index, reach):
    for way in (reach, -reach):
        assert flags(MIDDLE, changed(index, MIDDLE[index] + 1.001 * way)) == 16 << index
        assert flags(MIDDLE, changed(index, MIDDLE[index] + way)) == 0


def test_a_first_order_actuator_has_no_limit_of_rate():
    assert flags(MIDDLE, (900.0, 300.0, 0.3, -0.3), FIRST_ORDER) == 0
    assert flags(MIDDLE, (1000.0, 200.0, 1.0, -1.0), FIRST_ORDER) == 1 | 2 | 4 | 8


def test_a_motor_that_must_not_turn_is_at_no_limit_of_position_and_runs_down_at_its_rate():
    assert flags((0.0, 0.0, 0.0, 0.0), (1000.0, 0.0, 1.0, -1.0), armed=False) == 4 | 8 | 64 | 128
    assert flags(MIDDLE, MIDDLE, armed=False) == 16 | 32


def test_the_rate_counts_to_where_an_actuator_can_go():
    """Beyond its limit there is no way left to go."""
    assert flags((1000.0, 600.0, 0.0, 0.0), (5000.0, 600.0, 0.0, 0.0)) == 1
    assert flags((600.0, 600.0, NOMINAL.delta_max, 0.0), (600.0, 600.0, 9.0, 0.0)) == 4
