"""Information about the wind from the pitot and the wing."""

import math

import numpy as np
import pytest

from sitl.estimation import air_readings
from sitl.estimation.filter import LACKED_SHARE, SLOW_STEP, put_nominal
from sitl.estimation.gust_meter import FIRST_LEVEL, FIRST_SHARE, FIXED_LEVEL
from sitl.estimation.nominal_state import (
    AIR_ERRORS,
    ERRORS,
    WIND_ERROR,
    WING_ERROR,
)
from sitl.model.aerodynamics import wrench
from sitl.model.quaternions import rotate, rotate_inverse
from sitl.model.vectors import Vector, add_scaled, norm, subtract
from sitl.sensors.instruments import (
    FIRST_DELAYED,
    PITOT,
)
from sitl.storage import value_of
from tests.support.flat import numbers_of
from tests.support.flights.ideal_sensors import NOMINAL, SHIPPED, WANDERING, aboard
from tests.support.flights.observed_cruise import (
    ACTUATORS,
    AIRSPEED,
    CRUISE,
    OBSERVED,
    PERIODS,
    RATES,
    filter_with,
    fused,
    observe_tube,
    wing_step,
)


@pytest.mark.parametrize("name", ["airspeed", "wing"])
def test_the_air_s_readings_tell_of_the_wind_alone(name):
    after, before, P, _ = fused(name, CRUISE)
    assert after.wind != CRUISE.wind
    air = ("wind", "steady_wind", "tube_bias", "tube_speed")
    assert numbers_of(after._replace(**{k: getattr(CRUISE, k) for k in air})) == pytest.approx(numbers_of(CRUISE))
    others = np.delete(np.arange(ERRORS), np.arange(WIND_ERROR, WIND_ERROR + AIR_ERRORS))
    assert (P[np.ix_(others, others)] == before[np.ix_(others, others)]).all()
    assert np.trace(P[WIND_ERROR : WIND_ERROR + 3, WIND_ERROR : WIND_ERROR + 3]) < 3e-2


def test_the_wing_s_model_is_doubted_by_a_share_of_its_force(looked):
    ((H, *_),) = looked(OBSERVED["wing"])
    F, _ = wrench(AIRSPEED, RATES, ACTUATORS, NOMINAL)
    across = abs(AIRSPEED.z) / norm(AIRSPEED)
    share = air_readings.ATTACHED * (1.0 - across) + across
    assert LACKED_SHARE * H[WING_ERROR] == pytest.approx(FIRST_SHARE * share * F.z / NOMINAL.m, rel=0.05)


def test_in_the_arena_a_fixed_share_of_the_force_as_it_is_read_is_doubted(looked_in_arena):
    ((H, innovation, _, variance),) = looked_in_arena(OBSERVED["wing"])
    F, _ = wrench(AIRSPEED, RATES, ACTUATORS, NOMINAL)
    assert H[WING_ERROR] == pytest.approx(air_readings._lacking(AIRSPEED) * F.z / NOMINAL.m, rel=1e-3)
    assert innovation == pytest.approx(0.1, abs=0.005)  # so much more than the model makes is in the step
    noise = air_readings.WING_NOISE**2 + air_readings.WING_DOUBT**2
    assert noise < variance < 2.0 * noise  # and what an unknown wind does


@pytest.mark.parametrize("arena", [True, False])
def test_the_level_of_the_gusts_is_metered_outdoors_and_fixed_in_the_arena(arena):
    i, f, _ = aboard(WANDERING, assumed=WANDERING, arena=arena)
    f["covariance"][:] = 1e-2 * np.eye(ERRORS)
    put_nominal(f, CRUISE)
    f["on_ground"] = False
    before = (value_of(f.gusts), value_of(f.wing))
    assert before[0].level == (FIXED_LEVEL if arena else FIRST_LEVEL)
    OBSERVED["wing"](f, i)
    assert ((value_of(f.gusts), value_of(f.wing)) == before) == arena


def test_on_the_ground_the_wing_tells_nothing_of_the_wind():
    i, f, _ = aboard(SHIPPED)
    f["covariance"][:] = np.eye(ERRORS)
    put_nominal(f, CRUISE)
    f["on_ground"] = True
    OBSERVED["wing"](f, i)
    assert value_of(f.nominal) == CRUISE
    assert f["air_doubt"] > 0.1


def test_in_the_arena_a_wind_that_is_known_is_doubted_by_what_the_model_lacks_whatever_the_force():
    i, f, _ = aboard(WANDERING, assumed=WANDERING, arena=True)
    f["covariance"][:] = 1e-8 * np.eye(ERRORS)
    put_nominal(f, CRUISE)
    OBSERVED["wing"](f, i)
    assert f["air_doubt"] == pytest.approx(air_readings.WING_LACKS, rel=0.1)


def test_a_wind_that_is_known_is_doubted_by_what_the_wing_s_model_may_lack():
    i, f = filter_with(P=1e-8)
    f["on_ground"] = True
    OBSERVED["wing"](f, i)
    F, _ = wrench(AIRSPEED, RATES, ACTUATORS, NOMINAL)
    lacks = LACKED_SHARE * air_readings._lacking(AIRSPEED) * F.z / NOMINAL.m
    assert f["air_doubt"] == pytest.approx(math.hypot(air_readings.WING_LACKS, lacks), rel=0.02)


@pytest.mark.parametrize(
    ("since", "now", "forgiven"), [(0.0, 2500, True), (0.0, 2499, False), (100.0, 2600, True), (-1.0, 9000, False)]
)
def test_a_tube_that_is_refused_for_five_seconds_is_right_about_the_wind_if_it_is_vouched_for(since, now, forgiven):
    _, f = filter_with()
    f["tube_compared"] = 2.0
    line = PITOT - FIRST_DELAYED
    f["refused_since"][line] = since
    air_readings._forgive(f, now)
    unknown = f["settings"]["wind"]["max_deviation"] if forgiven else 0.1
    assert f["covariance"][WIND_ERROR, WIND_ERROR] == pytest.approx(unknown**2)
    assert f["refused_since"][line] == (-1.0 if forgiven else since)


@pytest.mark.parametrize(("compared", "error", "failed"), [(0.5, 0.0, 0.0), (2.0, 2.5, 0.0), (2.0, 0.0, 1.0)])
def test_a_tube_that_nothing_vouches_for_stays_refused(compared, error, failed):
    _, f = filter_with()
    line = PITOT - FIRST_DELAYED
    f["refused_since"][line] = 0.0
    f["tube_compared"], f["tube_error"], f["failed"][PITOT] = compared, error, failed
    air_readings._forgive(f, 10_000)
    assert f["covariance"][WIND_ERROR, WIND_ERROR] == pytest.approx(0.01)
    assert f["refused_since"][line] == 0.0


def test_near_its_threshold_a_tube_is_heard_where_it_is_expected_to_read(looked):
    slow = CRUISE._replace(
        wind=add_scaled(CRUISE.wind, rotate(CRUISE.attitude, Vector(1.0, 0.0, 0.0)), AIRSPEED.x - 3.5),
        tube_speed=3.5,
    )
    assert looked(lambda f, i: observe_tube(f, i, 4.5), slow) == []
    assert looked(lambda f, i: observe_tube(f, i, 4.5)) != []


def test_a_tube_below_its_threshold_tells_nothing(looked):
    assert looked(lambda f, i: observe_tube(f, i, 0.0)) == []


def test_without_a_tube_the_wing_tells_nothing_of_the_speed(looked):
    def along_nose(rows):
        ((H, *_),) = rows
        return rotate_inverse(CRUISE.attitude, Vector(*H[WIND_ERROR : WIND_ERROR + 3])).x

    alone = looked(lambda f, _: air_readings.observe_wing(f, wing_step(), False, 0.0))
    assert along_nose(alone) == pytest.approx(0.0, abs=1e-12)
    assert abs(along_nose(looked(OBSERVED["wing"]))) > 1e-3


def test_without_a_tube_the_wind_along_the_nose_fades_to_calm_and_only_that():
    before = CRUISE
    after = air_readings.nose_wind_fading(before, 5.0)
    gone = rotate_inverse(before.attitude, subtract(after.wind, before.wind))
    along = rotate_inverse(before.attitude, before.wind).x
    assert gone == pytest.approx((-along * 0.01 / 5.0, 0.0, 0.0), abs=1e-9)
    assert after._replace(wind=before.wind) == before


def test_the_air_s_force_is_compared_with_what_is_felt_less_the_bias(looked):
    ((_, innovation, *_),) = looked(OBSERVED["wing"])
    # The mean force of a step is that in its middle; its mean over the uncertain wind is nearly that at the belief.
    step = wing_step()
    middle = air_readings._a_while_before(CRUISE, step, AIRSPEED, NOMINAL.g, 0.5 * SLOW_STEP)
    F, _ = wrench(middle, RATES, ACTUATORS, NOMINAL)
    assert innovation == pytest.approx(step.force.z - CRUISE.accel_bias.z - F.z / NOMINAL.m, abs=0.005)


def test_a_while_before_the_air_was_as_fast_as_forces_since_have_changed_it():
    step = wing_step()
    pushed = subtract(step.force, CRUISE.accel_bias)
    turn = subtract(step.rates, CRUISE.gyro_bias)
    falling = rotate_inverse(CRUISE.attitude, Vector(0.0, 0.0, -NOMINAL.g))
    rate = np.add(pushed, falling) - np.cross(turn, AIRSPEED)
    wanted = np.array(AIRSPEED) - 0.5 * SLOW_STEP * rate
    found = air_readings._a_while_before(CRUISE, step, AIRSPEED, NOMINAL.g, 0.5 * SLOW_STEP)
    assert found == pytest.approx(wanted)


def test_a_tube_that_is_refused_is_noted_as_the_tube_s():
    i, f = filter_with()
    before = f["refused_at"].copy()
    observe_tube(f, i, AIRSPEED.x + 30.0)
    assert np.flatnonzero(f["refused_at"] != before).tolist() == [PITOT - FIRST_DELAYED]
    assert f["refused_at"][PITOT - FIRST_DELAYED] == PERIODS


@pytest.mark.parametrize(
    ("innovation", "age", "believed"),
    [(3.0, 0.0, True), (3.0 + 1e-9, 0.0, False), (-3.1, 0.0, False), (9.0, 3.0, False), (9.0, 3.002, True)],
)
def test_after_a_refusal_the_tube_has_to_be_near_for_three_seconds(innovation, age, believed):
    _, f = filter_with()
    now = 5000
    f["refused_at"][PITOT - FIRST_DELAYED] = now - round(age / 0.002)
    assert air_readings._follows(f, 12.0, innovation, now) == believed


@pytest.mark.parametrize(("speed", "believed"), [(9.0, True), (15.0, True), (15.1, False), (8.9, False)])
def test_a_tube_that_leaps_is_not_believed(speed, believed):
    _, f = filter_with()
    f["before"][PITOT - FIRST_DELAYED, 0] = 12.0
    assert air_readings._follows(f, speed, 0.0, 5000) == believed
