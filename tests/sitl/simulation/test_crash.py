"""Crashes of the simulated vehicle: motors off, down for good, the same alone and in a batch."""

import math

import numpy as np
import pytest

from sitl import Body, Law, Simulation, Start, Vector, fly_batch, hover_at, load_airframe
from sitl.model.quaternions import Quaternion, from_euler, hover

NOMINAL = load_airframe("nominal").parameters
LIMIT = NOMINAL.max_contact_speed
NOSE_DOWN = from_euler(0.0, 0.5 * math.pi, 0.0)


def thrown(
    speed: float, attitude: Quaternion = NOSE_DOWN, up: float = 1.0, law: Law = Law.HOVER_ZERO_MOMENT
) -> Simulation:
    """Down onto the ground."""
    made = Simulation(NOMINAL, start=Start(up=up, airborne=True))
    made.begin_flight(law)
    motion = Vector(1.0, -0.5, -speed), attitude, Vector(0.5, -0.3, 0.2)
    made.place(Body(Vector(12.0, -3.0, up), *motion))
    made.reference = hover_at((0.0, 0.0, 3.0), 0.0)
    return made


@pytest.mark.parametrize("speed", [LIMIT + 1.0, 15.0, 60.0])
def test_whatever_hits_the_ground_fast_stays_there_with_its_motors_off(speed: float) -> None:
    vehicle = thrown(speed, up=0.3)
    vehicle.step(1.0)
    crash = vehicle.crash
    assert crash is not None
    assert crash.speed == pytest.approx(speed, rel=0.3)
    assert math.dist(crash.place[:2], (12.0, -3.0)) < 1.0
    assert vehicle.law is Law.CRASHED
    assert [jump.name for jump in vehicle.jumps][-1] == "crash"
    assert not vehicle.armed
    lowest, highest = math.inf, -math.inf
    for _ in range(80):
        vehicle.armed = vehicle.flying = True  # whatever is wanted of it
        vehicle.step(0.05)
        lowest, highest = min(lowest, vehicle.truth.body.position.z), max(highest, vehicle.truth.body.position.z)
    assert -0.02 < lowest <= highest < 0.3
    assert vehicle.law is Law.CRASHED
    assert vehicle.truth.actuators[:2] == (0.0, 0.0)
    assert math.hypot(*vehicle.truth.body.velocity) < 0.05
    assert vehicle.crash == crash


def test_a_touch_below_the_limit_breaks_nothing() -> None:
    vehicle = thrown(0.7 * LIMIT, hover(0.0), up=0.15)
    vehicle.step(0.1)
    assert vehicle.crash is None
    assert vehicle.law is not Law.CRASHED


def test_what_falls_with_its_motors_stopped_crashes_too() -> None:
    vehicle = thrown(0.0, up=6.0)
    vehicle.armed = False
    vehicle.step(2.0)
    assert [jump.name for jump in vehicle.jumps] == ["disarm", "crash"]


def test_a_new_start_stands_it_up_again() -> None:
    vehicle = thrown(20.0)
    vehicle.step(0.5)
    vehicle.begin(Start())
    assert vehicle.crash is None
    assert vehicle.law is Law.LANDED
    vehicle.armed = vehicle.flying = True
    vehicle.reference = hover_at((0.0, 0.0, 3.0), 0.0)
    vehicle.step(4.0)
    assert vehicle.truth.body.position.z > 2.0


def test_a_vehicle_that_lies_on_its_side_lets_go_of_its_motors() -> None:
    vehicle = thrown(0.5, from_euler(0.0, 0.0, 0.0), up=0.05)
    vehicle.step(4.0)
    assert vehicle.crash is None
    assert vehicle.law is Law.LANDED
    assert not vehicle.flying


def test_a_crash_in_a_batch_is_that_of_the_flight_alone() -> None:
    together, alone = ([thrown(speed) for speed in np.linspace(1.0, 30.0, 21)] for _ in range(2))
    fly_batch(together, 1.5)
    for one in alone:
        one.step(1.5)
    assert [a._arrays.flights.tobytes() for a in together] == [b._arrays.flights.tobytes() for b in alone]
    assert [a.jumps for a in together] == [b.jumps for b in alone]
    assert {a.law for a in together} >= {Law.CRASHED}
