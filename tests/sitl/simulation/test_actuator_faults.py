"""Motors and elevons that fail: what they do, and that the vehicle is told nothing."""

import pytest

from protocol.dialect.vocabulary import Law
from sitl.model.airframe_files import load
from sitl.model.state import Actuators
from sitl.sensors.draws import PERIOD
from sitl.sensors.instruments import GARBAGE, OFF, STUCK, TOO_SLOW
from sitl.simulation.actuator_faults import GARBAGE_PERIODS, NO_FAULTS, SLOWNESS, failing, is_whole, share_drawn
from sitl.simulation.batch import fly_batch
from sitl.simulation.simulation import Simulation
from sitl.simulation.start import Start
from tests.support.flights.started_simulation import state, vehicle

A = load("collage").parameters
NOW, WANTED = Actuators(600.0, 610.0, 0.1, -0.1), Actuators(900.0, 300.0, -0.3, 0.3)


def failed(fault, *, is_armed=True, period=100):
    return failing(WANTED, NOW, NO_FAULTS._replace(left_motor=fault, left_elevon=fault, seed=3), is_armed, period, A)


def test_what_does_not_fail_goes_where_it_is_sent():
    assert failing(WANTED, NOW, NO_FAULTS, True, 100, A) == WANTED
    assert is_whole(NO_FAULTS)
    for name in ("left_motor", "right_motor", "left_elevon", "right_elevon"):
        assert not is_whole(NO_FAULTS._replace(**{name: STUCK}))


def test_one_that_is_off_goes_to_zero_and_one_that_is_stuck_stays():
    assert failed(OFF) == Actuators(0.0, WANTED.right_motor, 0.0, WANTED.right_elevon)
    assert failed(STUCK) == Actuators(NOW.left_motor, WANTED.right_motor, NOW.left_elevon, WANTED.right_elevon)


def test_a_slow_one_comes_a_tenth_as_far_in_a_period():
    slow = failed(TOO_SLOW)
    assert slow.left_motor - NOW.left_motor == pytest.approx(A.omega_rate * PERIOD / SLOWNESS)
    assert slow.left_elevon - NOW.left_elevon == pytest.approx(-A.delta_rate * PERIOD / SLOWNESS)


def test_a_random_command_is_within_the_limits_lasts_a_while_and_is_the_same_in_every_run():
    drawn = [failed(GARBAGE, period=period) for period in range(0, 200 * GARBAGE_PERIODS, GARBAGE_PERIODS)]
    motors, elevons = [u.left_motor for u in drawn], [u.left_elevon for u in drawn]
    assert A.omega_min <= min(motors) < max(motors) <= A.omega_max
    assert -A.delta_max <= min(elevons) < 0.0 < max(elevons) <= A.delta_max
    assert failed(GARBAGE, period=0) == failed(GARBAGE, period=GARBAGE_PERIODS - 1) != failed(GARBAGE, period=25)
    assert share_drawn(1, 0, 0) != share_drawn(2, 0, 0) != share_drawn(2, 1, 0)
    assert sum(share_drawn(5, 1, turn) for turn in range(1000)) / 1000 == pytest.approx(0.5, abs=0.05)


@pytest.mark.parametrize("fault", [OFF, STUCK, GARBAGE, TOO_SLOW])
def test_without_current_a_motor_stops_failed_or_not(fault):
    stopped = failing(NOW._replace(left_motor=0.0), NOW, NO_FAULTS._replace(left_motor=fault), False, 0, A)
    assert stopped.left_motor == 0.0


@pytest.mark.long
def test_in_flight_the_plant_fails_and_the_command_does_not_know():
    flown = Simulation(A, start=Start(up=30.0, airborne=True))
    flown.begin_flight(Law.HOVER_LINEAR)
    flown.advance(100)
    flown.faults = NO_FAULTS._replace(left_motor=OFF)
    flown.advance(250)
    assert flown.truth.actuators.left_motor == 0.0
    assert flown.command.left_motor > A.omega_min


def test_healed_in_time_it_is_whole_again():
    flown = vehicle()
    flown.faults = NO_FAULTS._replace(left_elevon=STUCK)
    flown.advance(100)
    held = flown.truth.actuators.left_elevon
    flown.advance(100)
    assert flown.truth.actuators.left_elevon == held
    flown.faults = NO_FAULTS
    flown.advance(100)
    assert flown.truth.actuators.left_elevon != held


def test_one_seed_is_one_failure_however_it_is_stepped():
    whole, pieces = vehicle(), vehicle()
    for flown in (whole, pieces):
        flown.faults = NO_FAULTS._replace(right_elevon=GARBAGE, seed=9)
    whole.advance(400)
    for _ in range(40):
        pieces.advance(10)
    assert state(whole) == state(pieces)


def test_a_batch_flies_what_fails_as_it_flies_alone():
    together, alone = vehicle(), vehicle()
    for flown in (together, alone):
        flown.faults = NO_FAULTS._replace(left_motor=STUCK)
    fly_batch([together], 0.1)
    alone.step(0.1)
    assert state(together) == state(alone)
