"""Whether the pitot is believed: its airspeed against that which the force along the nose tells."""

import pytest

from sitl.estimation import tube_check
from sitl.estimation.filter import put_nominal
from sitl.estimation.nominal_state import WIND_ERROR
from sitl.model.aerodynamics import wrench
from sitl.model.airframe_files import load
from sitl.model.quaternions import hover, rotate_inverse
from sitl.model.vectors import Vector, subtract
from sitl.sensors.instruments import FIRST_DELAYED, PITOT
from sitl.storage import value_of
from tests.support.flat import numbers_of
from tests.support.flights.observed_cruise import ACTUATORS, AIRSPEED, CRUISE, RATES, filter_with, wing_step

COLLAGE = load("collage").parameters
RATE = 50  # of the tube's readings [Hz]


def felt_at(airspeed, model=COLLAGE):
    """A slow step in which the vehicle feels what it does at an airspeed along the nose."""
    F, _ = wrench(Vector(airspeed, AIRSPEED.y, AIRSPEED.z), RATES, ACTUATORS, model)
    step = wing_step()
    return step._replace(force=step.force._replace(x=F.x / model.m + CRUISE.accel_bias.x))


def cruising(**kept):
    i, f = filter_with()
    for name in f["model"]:
        f["model"][name] = getattr(COLLAGE, name)
    f["on_ground"] = False
    f.update(kept)
    return i, f


def compared(f, i, speed, seconds, *, felt=AIRSPEED.x, innovation=0.0):
    for _ in range(round(seconds * RATE)):
        tube_check.compare_tube(f, i, speed, innovation, felt_at(felt))
    return f


@pytest.mark.parametrize("faster", [-5.0, -1.0, 0.0, 2.0, 6.0])
def test_the_force_along_the_nose_tells_the_airspeed(faster):
    told = tube_check.told_by_force(CRUISE, felt_at(AIRSPEED.x + faster), COLLAGE)
    assert told.speed == pytest.approx(AIRSPEED.x + faster, abs=0.3 + 0.25 * abs(faster))
    assert 0.2 < told.deviation < 1.0


@pytest.mark.parametrize(("too_much", "failed"), [(6.0, True), (-6.0, True), (4.0, True), (2.5, False), (-2.5, False)])
def test_a_tube_that_differs_for_long_has_failed(too_much, failed):
    i, f = cruising()
    compared(f, i, AIRSPEED.x + too_much, 5.0)
    assert bool(f["failed"][PITOT]) == failed
    assert f["tube_error"] == pytest.approx(too_much, abs=0.2)


@pytest.mark.parametrize(("more", "failed"), [(2.0, True), (-2.3, True), (1.2, False), (-1.2, False)])
def test_one_that_begins_to_differ_by_more_than_it_did_has_failed(more, failed):
    i, f = cruising()
    compared(f, i, AIRSPEED.x + 0.8, 10.0)
    assert f["tube_usual"] == pytest.approx(0.8, abs=0.2)
    compared(f, i, AIRSPEED.x + 0.8 + more, 5.0)
    assert bool(f["failed"][PITOT]) == failed


def test_one_reading_tells_nothing():
    i, f = cruising()
    compared(f, i, AIRSPEED.x + 10.0, 0.1)
    assert not f["failed"][PITOT]


def test_upright_slow_or_without_an_accelerometer_nothing_is_compared():
    i, f = cruising(tube_compared=2.0, tube_error=3.0)
    put_nominal(f, CRUISE._replace(attitude=hover(0.0)))
    compared(f, i, 20.0, 2.0)
    assert (f["tube_compared"], f["tube_error"], f["failed"][PITOT]) == (0.0, 0.0, 0.0)
    put_nominal(f, CRUISE._replace(velocity=CRUISE.wind))
    compared(f, i, 8.0, 2.0, felt=0.0)
    assert f["tube_compared"] == 0.0
    put_nominal(f, CRUISE)
    f["numb"] = True
    compared(f, i, 20.0, 2.0)
    assert f["tube_compared"] == 0.0


def test_a_wind_that_the_tube_has_led_astray_is_forgotten_and_one_that_it_has_not_is_kept():
    i, f = cruising()
    compared(f, i, AIRSPEED.x + 6.0, 3.0)
    assert f["covariance"][WIND_ERROR, WIND_ERROR] == pytest.approx(1e-2)
    i, f = cruising()
    compared(f, i, AIRSPEED.x, 3.0, felt=AIRSPEED.x - 6.0)
    assert f["covariance"][WIND_ERROR, WIND_ERROR] == pytest.approx(tube_check.LOST_WIND**2)


def test_a_tube_is_believed_again_after_it_has_agreed_for_ten_seconds():
    i, f = cruising()
    f["failed"][PITOT] = 1.0
    compared(f, i, AIRSPEED.x + 1.0, 9.9)
    assert f["failed"][PITOT]
    compared(f, i, AIRSPEED.x + 1.0, 0.2)
    assert not f["failed"][PITOT]


@pytest.mark.parametrize("wrong", [{"innovation": 2.5}, {"felt": AIRSPEED.x + 3.0}])
def test_it_has_to_agree_with_the_force_and_with_the_wind_that_is_believed(wrong):
    i, f = cruising()
    f["failed"][PITOT] = 1.0
    compared(f, i, AIRSPEED.x, 15.0, **wrong)
    assert f["failed"][PITOT]


def watched(f, seconds, *, has_tube=True, felt=AIRSPEED.x, first=1000):
    for n in range(round(seconds / 0.01)):
        tube_check.watch_tube(f, felt_at(felt), has_tube, first + 5 * n)


def test_a_tube_of_which_nothing_can_be_fused_is_missed_and_has_failed():
    _, f = cruising()
    watched(f, 4.9)
    assert not f["failed"][PITOT]
    watched(f, 0.2)
    assert f["failed"][PITOT]


def test_one_that_helps_is_not_missed_nor_is_one_that_is_not_there():
    _, f = cruising()
    watched(f, 6.0, has_tube=False)
    for second in range(8):
        f["fused_at"][PITOT - FIRST_DELAYED] = 1000.0 + 500.0 * second
        watched(f, 1.0, first=1000 + 500 * second)
    assert not f["failed"][PITOT]


def test_one_that_was_vouched_for_until_it_fell_silent_has_failed():
    _, f = cruising(tube_compared=2.0, tube_error=0.5, tube_silent=0.0)
    watched(f, 5.1)
    assert f["failed"][PITOT]


def test_one_that_is_vouched_for_is_right_and_the_wind_was_wrong():
    _, f = cruising(tube_compared=2.0, tube_error=0.5)
    for second in range(6):
        f["tube_silent"] = 0.0
        watched(f, 0.9, first=1000 + 450 * second)
    assert not f["failed"][PITOT]
    assert f["covariance"][WIND_ERROR, WIND_ERROR] > 4.0


@pytest.mark.long
def test_the_force_stands_in_for_a_tube_that_has_failed():
    _, f = cruising()
    f["failed"][PITOT] = 1.0
    tube_check.forget_wind(f, tube_check.LOST_WIND)
    watched(f, 10.0, felt=AIRSPEED.x - 3.0)
    b = value_of(f.nominal)
    assert rotate_inverse(b.attitude, subtract(b.velocity, b.wind)).x == pytest.approx(AIRSPEED.x - 3.0, abs=1.0)
    told_alone = {"wind": CRUISE.wind, "steady_wind": CRUISE.steady_wind, "tube_bias": 0.1, "tube_speed": 0.0}
    kept = CRUISE._replace(tube_bias=0.1, tube_speed=0.0)
    assert numbers_of(b._replace(**told_alone)) == pytest.approx(numbers_of(kept))
