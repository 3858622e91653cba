"""Alignment of the filter: on the ground, shaken, and anew in the air."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sitl.control.reference import along, hover_at, leg
from sitl.estimation.alignment import STANDSTILL_PATIENCE, STILL_TIME, _doubt_flying, _forget_old, align, attitude_from
from sitl.estimation.filter import ALIGNING, REALIGNING, RUNNING
from sitl.estimation.nominal_state import ATTITUDE_ERROR, ERRORS, GYRO_BIAS_ERROR, POSITION_ERROR, VELOCITY_ERROR
from sitl.model.quaternions import from_euler, hover, rotate_inverse
from sitl.model.vectors import Vector
from sitl.sensors.draws import PERIOD
from sitl.sensors.instruments import FIRST_DELAYED, GNSS, MAGNETOMETER, OFF, QUEUE_LENGTH, Inertial, send
from sitl.simulation.start import Start
from sitl.storage import value_of
from tests.support.flights.ideal_sensors import NOMINAL, SHIPPED, aboard
from tests.support.flights.sensed_flights import (
    MOCAP,
    SENSORS,
    UP,
    changed,
    hovering,
    on_ground,
    place_error,
    turn_error,
    watched,
)

EARTH = Vector(SHIPPED.magnetometer.field_north, SHIPPED.magnetometer.field_west, SHIPPED.magnetometer.field_up)


def phase(simulation):
    return int(simulation.avionics.filter["phase"])


def distance(simulation):
    """From the place to be held [m]."""
    return math.dist(simulation.truth.body.position, (0.0, 0.0, UP))


@given(st.floats(-3.1, 3.1), st.floats(-1.57, 1.57), st.floats(-3.1, 3.1), st.floats(0.1, 30.0))
def test_the_attitude_is_found_again_from_gravity_and_the_field(roll, pitch, yaw, strength):
    q = from_euler(roll, pitch, yaw)
    up = rotate_inverse(q, Vector(0.0, 0.0, strength))
    found = attitude_from(up, rotate_inverse(q, EARTH), EARTH)
    assert abs(np.dot(found, q)) == pytest.approx(1.0, abs=1e-12)


def test_a_field_that_is_too_steep_or_weak_turns_the_heading_alone():
    """Gravity is trusted for the tilt; of the field only the direction on the level counts."""
    q = from_euler(0.3, -1.2, 0.8)
    up = rotate_inverse(q, Vector(0.0, 0.0, 9.81))
    odd = rotate_inverse(q, Vector(0.5 * EARTH.x, 0.5 * EARTH.y, 2.0 * EARTH.z))
    assert abs(np.dot(attitude_from(up, odd, EARTH), q)) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize(("navigation", "seed", "heading"), [(SENSORS, 1, 0.0), (SENSORS, 2, 2.5), (MOCAP, 3, -1.2)])
def test_on_the_ground_it_is_aligned_within_three_seconds_as_well_as_it_says(navigation, seed, heading):
    made = on_ground(navigation, seed, heading=heading, aligned=False)
    made.step(0.8 * STILL_TIME)
    assert phase(made) == ALIGNING
    made.step(3.0 - 0.8 * STILL_TIME)
    assert phase(made) == RUNNING
    avionics = made.avionics
    assert (np.abs(turn_error(made)) < 3.5 * np.array(avionics.deviation(ATTITUDE_ERROR))).all()
    place = np.subtract(made.estimate.position, made.truth.body.position)
    assert (np.abs(place) < 3.5 * np.array(avionics.deviation(POSITION_ERROR)) + 0.01).all()
    bias = np.subtract(
        avionics.filter["nominal"]["gyro_bias"].item(), avionics.instruments["errors"]["gyro_bias"].item()
    )
    assert (np.abs(bias) < 4.0 * np.array(avionics.deviation(GYRO_BIAS_ERROR))).all()
    assert made.estimate.on_ground
    assert not np.array(avionics.filter["late"]).any()


def test_it_takes_nothing_that_has_not_arrived_yet():
    made = on_ground(sensors=changed(gnss={"rate": 1.0, "delay": 0.45, "jitter": 0.0}), aligned=False)
    made.step(1.4)  # it stands still for long enough, and the first fix was taken a second after boot
    assert phase(made) == ALIGNING
    made.step(0.2)
    assert phase(made) == RUNNING


def test_while_there_is_nothing_to_begin_on_it_waits():
    made = on_ground(aligned=False)
    made.avionics.instruments["failures"][GNSS] = OFF
    made.step(5.0)
    assert phase(made) == ALIGNING
    assert made.estimate.position == (0.0, 0.0, 0.0)
    made.avionics.instruments["failures"][GNSS] = 0.0
    made.step(0.5)
    assert phase(made) == RUNNING


def test_while_it_is_shaken_it_waits():
    made = on_ground(aligned=False)
    for _ in range(10):  # knocked at, more often than it takes to stand still
        made._arrays.flights["plant"]["body"]["rates"] = (0.0, 0.0, 0.5)
        made.step(0.2)
        assert phase(made) == ALIGNING
    made.step(STILL_TIME + 0.4)
    assert phase(made) == RUNNING
    assert np.abs(turn_error(made)).max() < 0.2


def test_what_was_found_in_flight_is_doubted():
    """A satellite's velocity is known to half a metre per second; gravity felt in flight misleads the tilt."""
    for roughly, tilt in ((True, 0.3), (False, 0.01)):
        P = 1e-4 * np.eye(ERRORS)
        _doubt_flying(P, roughly)
        doubt = np.sqrt(np.diag(P))
        assert doubt[VELOCITY_ERROR : VELOCITY_ERROR + 3] == pytest.approx(0.5)
        assert doubt[POSITION_ERROR : POSITION_ERROR + 3] == pytest.approx(0.5)
        assert doubt[ATTITUDE_ERROR : ATTITUDE_ERROR + 3] == pytest.approx(tilt)


def test_a_new_start_on_the_ground_is_aligned_anew():
    made = on_ground(aligned=False)
    made.step(3.0)
    assert phase(made) == RUNNING
    made.begin(Start(north=40.0, heading=1.0))
    assert phase(made) == ALIGNING
    made.step(3.0)
    assert phase(made) == RUNNING
    assert made.estimate.position.x == pytest.approx(40.0, abs=2.0)
    assert made.avionics.filter["resets"] == 0


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
@pytest.mark.parametrize("navigation", [SENSORS, MOCAP])
@pytest.mark.parametrize("wind", [0.0, 4.0])
def test_a_filter_that_is_restarted_in_a_hover_carries_on_and_converges(navigation, seed, wind):
    made = hovering(navigation, seed, wind=(wind, 1.0, 0.0), gusts=0.1 + 0.1 * wind)
    made.step(8.0)
    made.avionics.restart()
    assert phase(made) == REALIGNING
    before = place_error(made)
    carried = watched(made, 0.8, phase, place_error)
    assert (carried[:, 0] == REALIGNING).all()
    assert carried[:, 1].max() < before + 1.0
    flown = watched(made, STANDSTILL_PATIENCE + 5.0, phase, place_error, distance)
    assert (flown[round(10 * STANDSTILL_PATIENCE) :, 0] == RUNNING).all()
    assert flown[:, 2].max() < 10.0  # it never leaves for good
    assert flown[-20:, 1].max() < (0.02 if navigation is MOCAP else 1.0)
    assert np.abs(turn_error(made)).max() < 0.15
    assert made.avionics.filter["resets"] == 0


def test_steady_as_a_cruise_is_it_is_not_taken_for_standing_still():
    made = hovering()
    path = leg((0.0, 0.0, UP), (900.0, 0.0, UP), 15.0)
    made.reference = along(hover_at((0.0, 0.0, UP), 0.0), path, 0.0)
    made.step(15.0)
    made.avionics.restart()
    flown = watched(made, 10.0, place_error, lambda s: s.truth.body.position.z, lambda s: s.estimate.velocity.x)
    assert phase(made) == RUNNING
    assert flown[:, 0].max() < 3.0
    assert flown[-20:, 0].max() < 1.0
    assert np.abs(flown[:, 1] - UP).max() < 5.0
    assert flown[:, 2].min() > 10.0
    assert made.avionics.filter["resets"] == 0


def test_the_estimate_of_before_is_the_estimate_right_after_a_restart():
    made, other = hovering(seed=3), hovering(seed=3)
    for flown in (made, other):
        flown.step(4.0)
    made.avionics.restart()
    for flown in (made, other):
        flown.advance(1)
    assert made.estimate.position == pytest.approx(other.estimate.position, abs=1e-3)
    assert made.estimate.velocity == pytest.approx(other.estimate.velocity, abs=1e-3)
    assert made.estimate.attitude == pytest.approx(other.estimate.attitude, abs=1e-4)


SECOND = round(STILL_TIME / PERIOD)  # control periods


def aligned(speed=0.0, periods=SECOND + 20):
    """A filter after so many control periods upright and at rest by the inertial readings, with a fix of some speed."""
    i, f, _ = aboard(SHIPPED)
    q = hover(0.7)
    force, field = rotate_inverse(q, Vector(0.0, 0.0, NOMINAL.g)), rotate_inverse(q, EARTH)
    fix = (10.0, -20.0, 30.0, 0.6 * speed, 0.8 * speed, 0.0)
    for instrument, values in ((GNSS, fix), (MAGNETOMETER, field)):
        i["last"][instrument - FIRST_DELAYED, : len(values)] = values
        send(instrument - FIRST_DELAYED, i, 400, 450)
    for period in range(1, periods + 1):
        if f["phase"] == ALIGNING:
            align(f, i, Inertial(Vector(0.01, -0.02, 0.03), force), period)
    return f


@pytest.mark.parametrize(("speed", "stands"), [(0.0, True), (0.99, True), (1.01, False)])
def test_what_stands_still_and_moves_less_than_a_metre_per_second_is_at_rest(speed, stands):
    f = aligned(speed)
    belief = value_of(f.nominal)
    assert f["phase"] == RUNNING
    assert belief.velocity == ((0.0, 0.0, 0.0) if stands else pytest.approx((0.6 * speed, 0.8 * speed, 0.0)))
    assert belief.gyro_bias == (pytest.approx((0.01, -0.02, 0.03)) if stands else (0.0, 0.0, 0.0))
    assert abs(np.dot(belief.attitude, hover(0.7))) == pytest.approx(1.0, abs=1e-9)
    age = 0.0 if stands else (500 - 400) * PERIOD
    assert belief.position == pytest.approx((10.0 + age * 0.6 * speed, -20.0 + age * 0.8 * speed, 30.0), abs=1e-9)
    assert (*belief.misalignment, *belief.magnetic_bias, *belief.gnss_drift, belief.barometer_drift) == (0.0,) * 10


def test_it_begins_after_a_second_and_not_before():
    assert aligned(periods=SECOND - 1)["phase"] == ALIGNING
    assert aligned(periods=SECOND)["phase"] == RUNNING


def test_means_are_of_the_last_second():
    i, f, _ = aboard(SHIPPED)
    for period in range(1, 1501):
        rates = Vector(1.0, 0.0, 0.0) if period <= 1000 else Vector(0.0, 0.0, 0.0)
        align(f, i, Inertial(rates, Vector(NOMINAL.g, 0.0, 0.0)), period)
    assert value_of(f.mean_rates).x == pytest.approx(math.exp(-500 * PERIOD / STILL_TIME), rel=2e-3)


@pytest.mark.parametrize(("rate", "moved"), [(0.104, 0), (0.106, 21)])
def test_a_tenth_of_a_radian_a_second_about_the_mean_is_no_standstill(rate, moved):
    i, f, _ = aboard(SHIPPED)
    f["phase"], f["aligned_periods"], f["moved"] = ALIGNING, 0, 0
    for turn in (*20 * [0.0], rate):  # of which the mean takes a twenty-first
        align(f, i, Inertial(Vector(turn, 0.0, 0.0), Vector(NOMINAL.g, 0.0, 0.0)), 100)
    assert f["moved"] == moved


@pytest.mark.parametrize(
    ("first", "waiting", "period", "left"),
    [(0, 2.0, 15, 2.0), (0, 2.0, 20, 1.0), (0, 3.0, 25, 2.0), (0, 3.0, 30, 1.0), (QUEUE_LENGTH - 1, 2.0, 20, 1.0)],
)
def test_of_what_has_arrived_the_newest_is_kept(first, waiting, period, left):
    i, _, _ = aboard(SHIPPED)
    line = GNSS - FIRST_DELAYED
    i["waiting"][line], i["first"][line] = waiting, first
    for k in range(3):
        i["arrives"][line, (first + k) % QUEUE_LENGTH] = 10.0 * (k + 1)
    i["arrives"][line, (first + 3) % QUEUE_LENGTH] = 0.0  # from long ago
    _forget_old(i, period)
    assert i["waiting"][line] == left
    assert i["first"][line] == (first + waiting - left) % QUEUE_LENGTH
