"""The supervisor in flight: every law gets its turn, falls are caught, and nothing makes it chatter."""

import math

import numpy as np
import pytest

from protocol.dialect.vocabulary import Law
from sitl.model.quaternions import multiply
from sitl.model.vectors import Vector, norm
from sitl.simulation.batch import fly_batch
from sitl.simulation.simulation import Simulation
from sitl.simulation.start import Start
from sitl.supervisor.guards import MAX_SINK
from sitl.vehicle.aircraft import is_forward
from tests.support.flights.estimates import rotation, vector
from tests.support.flights.recorded_flight import NOMINAL, Flight, on_a_leg
from tests.support.flights.tunings import BY_REPORT, EVERY_LAW
from tests.support.vehicle.mission_items import waypoint

MAX_JUMPS = 12  # in a minute of gusts
RANDOM = 64  # flights


def test_every_law_is_flown_by_somebody():
    """From the ground into forward flight and back, the linear forward law allowed."""
    flight = Flight(airborne=False, tuning=EVERY_LAW)
    flight.fly_mission([waypoint(0.0, 0.0, 20.0), waypoint(120.0, 0.0, 20.0)])
    flight.fly(10.0)
    seen = {Law(int(law)) for law in flight.law} | {jump.source for jump in flight.vehicle.jumps}
    assert seen == set(Law) - {
        Law.FAILSAFE,
        Law.CRASHED,
        Law.HOVER_ATTITUDE,
        Law.INDI,
        Law.ROBUST_PI,
    }  # what it falls into, what is streamed, and the other schools


@pytest.mark.parametrize("beyond", [1.0, 4.0])
def test_a_fall_out_of_the_hover_is_caught_and_flown_on_from(beyond):
    """Tail first the elevons are reversed: it may turn over before it stands again."""
    vehicle = on_a_leg(tuning=BY_REPORT)
    body = vehicle.truth.body
    vehicle.place(body._replace(position=Vector(0.0, 0.0, 500.0), velocity=Vector(0.0, 0.0, -MAX_SINK - beyond)))
    lowest = math.inf
    while "recover" not in [jump.name for jump in vehicle.jumps]:
        vehicle.advance(50)
        lowest = min(lowest, vehicle.truth.body.position.z)
        assert vehicle.time < 30.0
    assert vehicle.jumps[0].name == "catch_fall"
    assert 500.0 - lowest < 60.0


@pytest.mark.long
def test_random_states_under_random_laws_in_gusts_settle_down():
    """No attitude, velocity or law to begin with makes the supervisor chatter or keeps it from flying its leg."""
    rng, flights = np.random.default_rng(16), []
    for _ in range(RANDOM):
        vehicle = on_a_leg(gusts=1.0, seed=int(rng.integers(1000)))
        axis = rng.normal(size=3)
        turn = rng.uniform(0.0, np.pi) * axis / np.linalg.norm(axis)
        body = vehicle.truth.body
        vehicle.place(
            body._replace(
                position=Vector(0.0, 0.0, 1000.0),
                velocity=vector(rng.uniform(-8.0, 8.0, 3)),
                attitude=multiply(body.attitude, rotation(turn)),
                rates=vector(rng.uniform(-3.0, 3.0, 3)),
            )
        )
        vehicle.begin_flight(Law(int(rng.integers(1, Law.CRASHED))))
        flights.append(vehicle)
    fly_batch(flights, 60.0)
    for vehicle in flights:
        assert len(vehicle.jumps) <= MAX_JUMPS, [jump.name for jump in vehicle.jumps]
        assert norm(vehicle.truth.body.rates) < 2.0
        assert is_forward(vehicle)


def test_a_landing_ends_at_rest_with_the_motors_let_go_and_the_next_take_off_begins_afresh():
    vehicle = Simulation(NOMINAL)
    vehicle.armed = vehicle.flying = True
    vehicle.reference = vehicle.reference._replace(position=Vector(0.0, 0.0, 3.0))
    vehicle.step(10.0)
    assert vehicle.truth.body.position.z == pytest.approx(3.0, abs=0.05)
    vehicle.landing = True
    for up in np.arange(3.0, -1.0, -0.01):
        vehicle.reference = vehicle.reference._replace(position=Vector(0.0, 0.0, float(up)))
        vehicle.step(0.02)
    vehicle.step(1.0)
    names = [jump.name for jump in vehicle.jumps]
    assert names[0] == "take_off_indi"
    assert names[-1] == "touch_down"
    assert vehicle.law is Law.LANDED
    assert not vehicle.flying
    assert vehicle.flight.controller.states.integral == Vector(0.0, 0.0, 0.0)
    assert norm(vehicle.truth.body.velocity) < 0.01
    vehicle.landing, vehicle.flying = False, True
    vehicle.reference = vehicle.reference._replace(position=Vector(0.0, 0.0, 2.0))
    vehicle.step(8.0)
    assert vehicle.truth.body.position.z == pytest.approx(2.0, abs=0.05)


def test_disarming_in_the_air_stops_the_motors_at_once_and_for_good():
    vehicle = on_a_leg()
    vehicle.step(6.0)
    vehicle.armed = False
    vehicle.step(1.0)
    assert vehicle.law is Law.LANDED
    assert vehicle.truth.actuators[:2] == (0.0, 0.0)
    vehicle.armed = True
    vehicle.step(0.2)
    assert vehicle.law is Law.LANDED  # the wish to fly was fulfilled: nobody asked to take off again


def test_a_vehicle_on_the_ground_stays_there_until_it_is_asked():
    vehicle = Simulation(NOMINAL, start=Start())
    stood = vehicle.truth.body.position
    vehicle.step(1.0)
    assert vehicle.energy == 0.0
    vehicle.armed = True
    vehicle.step(1.0)
    assert vehicle.law is Law.LANDED
    assert vehicle.jumps == []
    assert vehicle.truth.actuators[:2] == pytest.approx([NOMINAL.omega_min] * 2)
    assert vehicle.truth.body.position == pytest.approx(stood, abs=1e-3)
