"""The reference that moves with a velocity."""

import math

import numpy as np
import pytest

from protocol.dialect.vocabulary import Law
from sitl.control.hover_attitude import full_force
from sitl.control.reference import hover_at
from sitl.guidance.setpoints import (
    HEADING_LAG,
    KEEP_HEADING,
    HeadingSetpoint,
    MovingReference,
    attitude_for,
    from_heading_axes,
)
from sitl.guidance.view import MIN_HOLD_HEIGHT, VehicleView
from sitl.model.airframe_files import load
from sitl.model.quaternions import x_axis, z_axis
from sitl.simulation.simulation import Simulation
from sitl.simulation.start import Start

LAST = hover_at((0.0, 0.0, 20.0), 0.2)


def view(time, p=(0.0, 0.0, 20.0), heading=0.2):
    return VehicleView(time, p, (0.0, 0.0, 0.0), heading, 0.0, False, 1.0)


def test_it_moves_by_the_time_since_the_last_move():
    moving = MovingReference()
    moving.restart(1.0)
    assert moving.elapsed(1.1) == pytest.approx(0.1)
    moved = moving.move((2.0, -1.0, 0.5), KEEP_HEADING, LAST, view(1.1), 0.5)
    assert moved.position == pytest.approx((0.2, -0.1, 20.05))
    assert moved.heading == 0.2


def test_a_long_pause_moves_it_no_further_than_a_step():
    moved = MovingReference().move((2.0, 0.0, 0.0), KEEP_HEADING, LAST, view(100.0), 0.5)
    assert moved.position.x == pytest.approx(1.0)


def test_it_stays_near_the_vehicle_and_off_the_ground():
    behind = view(0.1, (-20.0, 0.0, 20.0))
    moved = MovingReference().move((3.0, 0.0, 0.0), KEEP_HEADING, LAST, behind, 0.5)
    assert math.dist(moved.position, behind.p) == pytest.approx(5.0)
    low = MovingReference().move(
        (0.0, 0.0, -2.0), KEEP_HEADING, hover_at((0.0, 0.0, 1.6), 0.0), view(0.5, (0.0, 0.0, 1.6)), 0.5
    )
    assert low.position.z == MIN_HOLD_HEIGHT


def test_a_turning_heading_leads_the_vehicle_and_a_turn_that_ends_stays_where_the_vehicle_is():
    moving, rate = MovingReference(), 0.3
    turning = moving.move((0.0, 0.0, 0.0), HeadingSetpoint(turn_rate=rate), LAST, view(0.1), 0.5)
    assert turning.heading == pytest.approx(0.2 + 0.1 * rate + HEADING_LAG * rate)
    stopped = moving.move((0.0, 0.0, 0.0), KEEP_HEADING, turning, view(0.2), 0.5)
    assert stopped.heading == pytest.approx(0.2)


@pytest.mark.parametrize(("airframe", "rate"), [("collage", 5.0), ("collage", -20.0), ("nominal", 20.0)])
def test_the_vehicle_turns_as_fast_as_it_is_asked_to_and_stops_where_it_is(airframe, rate):
    flown = Simulation(load(airframe).parameters, start=Start(up=20.0, airborne=True))
    flown.begin_flight(Law.HOVER_LINEAR)
    moving, turned, last = MovingReference(), 0.0, 0.0
    for look in range(600):
        heading = belly(flown.truth.body.attitude)
        turned, last = turned + math.degrees(math.remainder(heading - last, math.tau)), heading
        asked = HeadingSetpoint(turn_rate=math.radians(rate)) if look < 400 else KEEP_HEADING
        if look == 400:
            assert turned == pytest.approx(8.0 * rate, abs=3.0)
        seen = view(flown.time, tuple(flown.truth.body.position), heading)
        flown.reference = moving.move((0.0, 0.0, 0.0), asked, flown.reference, seen, 0.5)
        flown.advance(10)
    assert turned == pytest.approx(8.0 * rate, abs=3.0)


def belly(attitude):
    back = z_axis(attitude)
    return math.atan2(-back.y, -back.x)


def test_axes_of_a_heading_are_turned_into_the_world():
    assert from_heading_axes((1.0, 0.0, 2.0), 0.5 * math.pi) == pytest.approx((0.0, 1.0, 2.0))


# The attitude that gives an acceleration.


NOMINAL = load("nominal").parameters


@pytest.mark.parametrize("heading", [0.0, 2.0])
@pytest.mark.parametrize("acceleration", [(0.0, 0.0, 0.0), (2.0, 0.0, 0.0), (0.0, -3.0, 1.0), (1.0, 1.0, -2.0)])
def test_an_acceleration_is_the_force_of_its_attitude(acceleration, heading):
    attitude = attitude_for(acceleration, heading, 0.0, NOMINAL)
    force = attitude.thrust * full_force(NOMINAL) * np.array(x_axis(attitude.attitude))
    assert force / NOMINAL.m - np.array((0.0, 0.0, NOMINAL.g)) == pytest.approx(np.array(acceleration))
