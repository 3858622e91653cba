"""The exported code and ours over the same flights: the same bits in doubles, nearly the same commands in floats."""

import numpy as np
import pytest

from protocol.dialect.vocabulary import Law
from sitl.control.reference import along, hover_at, leg
from sitl.export.flat import flattened
from sitl.export.flown_again import compared, record
from sitl.export.random_flights import random_flight
from sitl.export.single_precision import command_differences
from sitl.simulation.simulation import Simulation
from sitl.simulation.start import Start
from tests.support.exported import AIRFRAME, DESIGN, code

RANDOM = 6
SECONDS = 1.0
# Of the fastest speed and of the elevons' travel, between the same laws in one and the other precision.
SINGLE_MOTORS, SINGLE_ELEVONS = 0.005, 0.02


@pytest.mark.long
def test_the_design_is_exported_to_the_bit():
    numbers = flattened(DESIGN)
    assert code().design().tolist() == numbers.tolist()


@pytest.mark.long
def test_flights_of_chance_are_the_same_by_the_shared_library():
    found = [compared(random_flight(number, SECONDS, (AIRFRAME,)), code()) for number in range(RANDOM)]
    assert all(one.is_none for one in found), found
    assert sum(one.jumps for one in found) > 0


def test_a_changed_bit_is_found():
    flight = random_flight(0, 0.02, (AIRFRAME,))
    controllers = flight.controllers.copy()
    command = controllers[5, 8]
    controllers[5, 8] = np.nextafter(command, np.inf)
    found = compared(flight._replace(controllers=controllers), code())
    assert found.first == 5
    assert 0.0 < found.largest < 1e-9


def test_a_vehicle_stands_and_a_law_is_entered_as_here():
    made = Simulation(AIRFRAME, start=Start(heading=0.4))
    standing = made.flight
    size = len(flattened(standing.controller))
    assert (code().initial(0.4, size) == flattened(standing.controller)).all()
    made.enter(Law.FORWARD_LINE_OF_SIGHT)
    entered = code().entered(flattened(standing.controller), Law.FORWARD_LINE_OF_SIGHT, flattened(standing.estimate))
    assert (entered == flattened(made.flight.controller)).all()


def ordinary(number):
    """A recorded second of a hover that moves on, or of a transition, in wind and gusts."""
    made = Simulation(AIRFRAME, seed=number, start=Start(up=60.0, airborne=True))
    made.begin_flight(Law.HOVER_ZERO_MOMENT)
    made.set_wind((1.5, -1.0, 0.0), 0.3)
    hover = hover_at((5.0, -8.0, 61.0), 0.4)
    made.reference = along(hover, leg((0.0, 0.0, 60.0), (60.0, 20.0, 62.0), 12.0), 0.4) if number % 2 else hover
    return record(f"ordinary flight {number}", made, 500)


@pytest.mark.long
def test_single_precision_commands_nearly_the_same_in_ordinary_flights():
    made = code(single=True)
    assert made.is_single
    rows = np.array([command_differences(ordinary(number), made) for number in range(4)])
    assert 0.0 < rows[:, 0].max() < SINGLE_MOTORS
    assert 0.0 < rows[:, 1].max() < SINGLE_ELEVONS
