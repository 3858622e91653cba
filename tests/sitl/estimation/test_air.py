"""The air as the filter believes it to move: gusts about a steady wind, and what wing and tube feel."""

import math

import numpy as np
import pytest

from sitl.estimation import air
from sitl.estimation.filter import SLOW_STEP, Step, put_nominal
from sitl.estimation.nominal_state import (
    ATTITUDE_ERROR,
    ERRORS,
    TUBE_SPEED_ERROR,
    VELOCITY_ERROR,
    WIND_ERROR,
)
from sitl.estimation.strapdown import no_increment
from sitl.model.aerodynamics import wrench
from sitl.model.quaternions import from_euler, rotate
from sitl.model.state import Actuators
from sitl.model.vectors import Vector
from sitl.sensors.instruments import speed_before_tube
from sitl.storage import value_of
from tests.support.flights.ideal_sensors import NOMINAL, SHIPPED, aboard

ZERO = Vector(0.0, 0.0, 0.0)
ACTUATORS = Actuators(500.0, 520.0, 0.05, -0.02)
STEP = Step(no_increment(), ZERO, ZERO, ZERO, Vector(0.1, -0.2, 0.3), ACTUATORS)
AIRSPEED = Vector(14.0, 1.0, 2.0)


@pytest.mark.parametrize("level", [0.2, 1.5])
def test_a_wind_left_alone_keeps_the_variance_of_steady_wind_and_gusts(level):
    _, f, _ = aboard(SHIPPED)
    f["gusts"]["level"] = level
    keep, gust = air.predict_wind(f, value_of(f.nominal)), level**2
    assert f["decay"][WIND_ERROR] == keep
    assert f["process_noise"][WIND_ERROR] == pytest.approx(gust * (1.0 - keep**2))
    assert keep == pytest.approx(math.exp(-SLOW_STEP * air.MIN_TURNOVER / air.EXPECTED_LENGTH))


def test_a_gust_that_nothing_tells_is_as_uncertain_as_the_gusts_are_strong():
    _, f, _ = aboard(SHIPPED)
    f["gusts"]["level"], f["gusts"]["growth"] = 1.5, 1.5 / 0.5
    keep = air.predict_wind(f, value_of(f.nominal))
    after = f["decay"][WIND_ERROR] ** 2 * 0.5**2 + f["process_noise"][WIND_ERROR]
    assert after == pytest.approx(1.5**2)
    assert keep < 1.0 < f["decay"][WIND_ERROR]


def test_of_a_sure_wind_the_wing_tells_the_derivative_of_its_force():
    told = air.told_by_wing(AIRSPEED, Vector(1e-4, 1e-4, 1e-4), ZERO, STEP, NOMINAL)

    def force(v):
        return wrench(v, STEP.rates, ACTUATORS, NOMINAL)[0].z / NOMINAL.m

    assert told.mean == pytest.approx(force(AIRSPEED), abs=1e-6)
    assert told.bend == pytest.approx(0.0, abs=1e-9)
    for k, name in enumerate("xyz"):
        more, less = (AIRSPEED._replace(**{name: AIRSPEED[k] + size}) for size in (1e-4, -1e-4))
        assert told.slope[k] == pytest.approx((force(more) - force(less)) / 2e-4, rel=1e-4, abs=1e-6)


def test_of_an_unsure_wind_the_wing_s_force_bends():
    sure = air.told_by_wing(AIRSPEED, Vector(0.1, 0.1, 0.1), ZERO, STEP, NOMINAL)
    unsure = air.told_by_wing(AIRSPEED, Vector(0.1, 3.0, 0.1), ZERO, STEP, NOMINAL)
    assert unsure.bend > 100.0 * sure.bend


def test_the_wind_s_deviations_are_those_along_the_body_s_axes():
    P = np.zeros((ERRORS, ERRORS))
    P[WIND_ERROR, WIND_ERROR], P[WIND_ERROR + 1, WIND_ERROR + 1], P[WIND_ERROR + 2, WIND_ERROR + 2] = 4.0, 9.0, 1e-6
    assert air.body_deviations(P, from_euler(0.0, 0.0, 0.5 * math.pi)) == pytest.approx(
        (3.0, 2.0, air.MIN_WIND_DEVIATION)
    )


def test_the_wind_s_deviations_know_how_its_errors_go_together():
    P, q = np.zeros((ERRORS, ERRORS)), from_euler(0.3, -0.7, 1.1)
    root = np.array([[1.0, 0.5, -0.3], [0.2, 0.8, 0.4], [-0.6, 0.1, 1.2]])
    wind = slice(WIND_ERROR, WIND_ERROR + 3)
    P[wind, wind] = root @ root.T
    axes = [np.array(rotate(q, Vector(*axis))) for axis in np.eye(3)]
    assert air.body_deviations(P, q) == pytest.approx([math.sqrt(axis @ P[wind, wind] @ axis) for axis in axes])


def test_vibration_that_a_slow_step_averages_out_shakes_no_force():
    whole = 2.0 * math.pi / SLOW_STEP  # a turn in a slow step
    assert air.shaken(Actuators(whole, whole, 0.0, 0.0), 2.0, 600.0) == pytest.approx(0.0, abs=1e-12)
    assert air.shaken(Actuators(450.0, 450.0, 0.0, 0.0), 2.0, 600.0) > 0.1


def flying(f, speed=14.0):
    """Level through calm air, the tube believed to have felt 12 m/s."""
    level = value_of(f.nominal)._replace(attitude=from_euler(0.0, 0.0, 0.0), velocity=Vector(speed, 0.0, 0.0))
    put_nominal(f, level._replace(tube_speed=12.0))
    P = f["covariance"]
    P[:] = np.diag(np.linspace(0.5, 1.5, ERRORS))
    return P


def test_the_tube_is_believed_to_come_nearer_to_the_airspeed_as_it_lags():
    i, f, _ = aboard(SHIPPED)
    pitot = value_of(i.specification).pitot
    flying(f)
    air.predict_tube(f, STEP, pitot)
    felt = speed_before_tube(14.0, ACTUATORS, NOMINAL, pitot)
    left = math.exp(-SLOW_STEP / pitot.lag)
    assert value_of(f.nominal).tube_speed == pytest.approx(left * 12.0 + (1.0 - left) * felt, abs=1e-5)


def test_what_the_tube_feels_is_as_wrong_as_the_airspeed_that_it_has_felt():
    i, f, _ = aboard(SHIPPED)
    P = flying(f)
    before, taken = P.copy(), 1.0 - math.exp(-SLOW_STEP / value_of(i.specification).pitot.lag)
    air.predict_tube(f, STEP, value_of(i.specification).pitot)
    along = before[VELOCITY_ERROR, VELOCITY_ERROR] + before[WIND_ERROR, WIND_ERROR]
    tube = TUBE_SPEED_ERROR
    assert P[tube, tube] == pytest.approx((1.0 - taken) ** 2 * before[tube, tube] + taken**2 * along, rel=1e-5)
    assert P[tube, WIND_ERROR] == pytest.approx(-taken * before[WIND_ERROR, WIND_ERROR], rel=1e-5)
    air.feel_for_long(f)
    assert P[tube, tube] == pytest.approx(along)
    assert P[tube, WIND_ERROR] == P[WIND_ERROR, tube] == pytest.approx(-before[WIND_ERROR, WIND_ERROR])


def test_what_the_tube_feels_is_wrong_with_the_attitude_where_the_air_comes_from_the_side():
    _, f, _ = aboard(SHIPPED)
    P = flying(f)
    q = from_euler(0.3, -0.4, 0.5)
    put_nominal(f, value_of(f.nominal)._replace(attitude=q, velocity=rotate(q, AIRSPEED)))
    variances, nose = np.diag(P).copy(), np.array(rotate(q, Vector(1.0, 0.0, 0.0)))
    air.feel_for_long(f)
    turn, velocity = slice(ATTITUDE_ERROR, ATTITUDE_ERROR + 3), slice(VELOCITY_ERROR, VELOCITY_ERROR + 3)
    assert P[TUBE_SPEED_ERROR, turn] == pytest.approx(np.array([0.0, -AIRSPEED.z, AIRSPEED.y]) * variances[turn])
    assert P[TUBE_SPEED_ERROR, velocity] == pytest.approx(nose * variances[velocity])


def test_a_gust_lasts_for_its_length_at_the_airspeed():
    _, f, _ = aboard(SHIPPED)
    fast = value_of(f.nominal)._replace(velocity=Vector(12.0, 0.0, 0.0), wind=Vector(-3.0, 0.0, 0.0))
    assert air.turnover_time(fast) == pytest.approx(2.0)


@pytest.mark.parametrize(("arena", "airspeed"), [(True, 3.0), (False, 5.0)])
def test_where_gusts_are_metered_an_unknown_wind_makes_them_pass_faster(arena, airspeed):
    _, f, _ = aboard(SHIPPED, arena=arena)
    for k in range(WIND_ERROR, WIND_ERROR + 3):
        f["covariance"][k, k] = 16.0 / 3.0
    b = value_of(f.nominal)._replace(velocity=Vector(3.0, 0.0, 0.0), wind=ZERO)
    assert air.expected_turnover(f, b) == pytest.approx(air.EXPECTED_LENGTH / airspeed)
