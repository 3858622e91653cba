"""What each reading tells: its derivative by every error is the change of its innovation, and what it may correct."""

import numpy as np
import pytest

from sitl.estimation import observations
from sitl.estimation.belief import (
    ACCEL_BIAS_ERROR,
    AIR_ERRORS,
    ATTITUDE_ERROR,
    BAROMETER_DRIFT_ERROR,
    ERRORS,
    GNSS_DRIFT_ERROR,
    MAGNETIC_BIAS_ERROR,
    MISALIGNMENT_ERROR,
    POSITION_ERROR,
    STATIC_PORT_ERROR,
    TUBE_ERROR,
    VELOCITY_ERROR,
    WIND_ERROR,
    WING_ERROR,
    Belief,
    corrected,
)
from sitl.estimation.filter import Step, get_belief, put_belief
from sitl.estimation.strapdown import no_increment
from sitl.model.aerodynamics import wrench
from sitl.model.quaternions import Quaternion, from_euler, multiply, rotate, rotate_inverse, small_rotation
from sitl.model.state import Actuators
from sitl.model.vectors import Vector, add, add_scaled, scaled, subtract
from sitl.sensors.instruments import (
    ATTITUDE_VARIANCE,
    EXTERNAL_POSE,
    FIRST_LINE,
    HAS_ATTITUDE,
    MOTION_CAPTURE,
    PITOT,
    POSITION_VARIANCE,
    READING,
)
from sitl.storage import column
from tests.support.flights.ideal_sensors import NOMINAL, SHIPPED, aboard

CRUISE = Belief(
    position=Vector(10.0, -20.0, 30.0),
    velocity=Vector(13.0, 3.0, -0.5),
    attitude=from_euler(0.2, -0.2, 0.3),
    gyro_bias=Vector(0.01, -0.02, 0.03),
    accel_bias=Vector(0.1, 0.2, -0.15),
    wind=Vector(-1.0, 2.0, 0.3),
    misalignment=Vector(0.01, -0.005, 0.02),
    magnetic_bias=Vector(1e-6, -2e-6, 1.5e-6),
    gnss_drift=Vector(0.4, -0.3, 0.6),
    barometer_drift=0.2,
    steady_wind=Vector(-1.5, 1.0, 0.1),
    tube_bias=0.1,
    static_port=0.0,
)
RATES = Vector(0.2, -0.3, 0.1)
EARTH = Vector(SHIPPED.magnetometer.field_north, SHIPPED.magnetometer.field_west, SHIPPED.magnetometer.field_up)
AIRSPEED = rotate_inverse(CRUISE.attitude, subtract(CRUISE.velocity, CRUISE.wind))
ACTUATORS = Actuators(520.0, 540.0, 0.05, -0.02)
PERIODS = 100


def reading_of(*parts):
    reading = np.zeros(READING)
    for first, part in parts:
        reading[first : first + np.size(part)] = part
    return reading


def pose_reading():
    q = multiply(CRUISE.attitude, small_rotation(CRUISE.misalignment))
    return reading_of(
        (0, CRUISE.position), (3, multiply(q, small_rotation(Vector(0.002, 0.001, -0.001)))),
        (POSITION_VARIANCE, 1e-4), (ATTITUDE_VARIANCE, 1e-4), (HAS_ATTITUDE, 1.0),
    )  # fmt: skip


def wing_step():
    v_b = AIRSPEED
    F, _ = wrench(v_b, RATES, ACTUATORS, NOMINAL)
    zero = Vector(0.0, 0.0, 0.0)
    force = Vector(0.0, 0.0, F.z / NOMINAL.m + CRUISE.accel_bias.z + 0.1)
    return Step(no_increment(), zero, zero, force, add(RATES, CRUISE.gyro_bias), ACTUATORS)


FIX = reading_of((0, add(CRUISE.position, CRUISE.gnss_drift)), (3, CRUISE.velocity))
FIELD = reading_of((0, add(rotate_inverse(CRUISE.attitude, EARTH), CRUISE.magnetic_bias)))
OBSERVED = {
    "satellites": lambda f, i: observations.observe_satellites(f, i, FIX, 0.0, PERIODS),
    "field": lambda f, i: observations.observe_field(f, i, FIELD, 0.0, RATES, PERIODS),
    "height": lambda f, i: observations.observe_height(f, i, reading_of((0, 30.3)), 0.0, PERIODS),
    "pose": lambda f, _: observations.observe_pose(f, MOTION_CAPTURE - FIRST_LINE, pose_reading(), 0.0, RATES, PERIODS),
    "airspeed": lambda f, i: observations.observe_airspeed(f, i, reading_of((0, AIRSPEED.x + 0.2)), PERIODS),
    "wing": lambda f, _: observations.observe_wing(f, wing_step(), True, 0.0),
}
BY = {  # what each reading tells of
    "satellites": (POSITION_ERROR, GNSS_DRIFT_ERROR, VELOCITY_ERROR),
    "field": (ATTITUDE_ERROR, MAGNETIC_BIAS_ERROR),
    "height": (POSITION_ERROR, BAROMETER_DRIFT_ERROR, STATIC_PORT_ERROR),
    "pose": (POSITION_ERROR, ATTITUDE_ERROR, MISALIGNMENT_ERROR),
    "airspeed": (VELOCITY_ERROR, WIND_ERROR, ATTITUDE_ERROR, TUBE_ERROR),
    "wing": (VELOCITY_ERROR, WIND_ERROR, ATTITUDE_ERROR, ACCEL_BIAS_ERROR),
}
FIRSTS = (*range(0, 21, 3), TUBE_ERROR, WING_ERROR, MISALIGNMENT_ERROR, MAGNETIC_BIAS_ERROR, GNSS_DRIFT_ERROR,
          BAROMETER_DRIFT_ERROR, STATIC_PORT_ERROR)  # fmt: skip
AIR = slice(WIND_ERROR, WIND_ERROR + 3)
# A turn of milliradians is taken for small; what the airspeed does to the height is told by its share alone, and what
# the wind along the span does to the wing is not told at all.
TOLERANCE = {"pose": 0.02, "wing": 0.12, "height": 0.01}


@pytest.fixture
def looked(monkeypatch):
    """A function that observes under a belief, and gives derivative and innovation of every scalar it would fuse."""
    i, f, _ = aboard(SHIPPED)
    f["covariance"][:] = 1e3 * np.eye(ERRORS)  # nothing is refused
    f["covariance"][AIR, AIR] = 1e-4 * np.eye(3)  # and the wind's spread bends nothing
    f["on_ground"] = False
    seen = []

    def note(P, H, PH, errors, n, first, count, innovation, variance, gate):
        seen.append((H.copy(), innovation, first, variance))
        H[:] = 0.0
        return 0.0

    monkeypatch.setattr(observations, "correct", note)

    def look(observe, belief=CRUISE):
        seen.clear()
        put_belief(f, 0, belief)
        f["tube"] = rotate_inverse(belief.attitude, subtract(belief.velocity, belief.wind)).x
        observe(f, i)
        return list(seen)

    return look


def step_of(k):
    return 1e-9 if MAGNETIC_BIAS_ERROR <= k < MAGNETIC_BIAS_ERROR + 3 else 1e-4


@pytest.mark.parametrize("name", OBSERVED)
def test_the_derivative_by_every_error_is_the_innovation_s_change(name, looked):
    rows = looked(OBSERVED[name])
    assert len(rows) == {"satellites": 6, "field": 3, "height": 1, "pose": 6, "airspeed": 1, "wing": 1}[name]
    H = np.array([row[0] for row in rows])
    H[:, WING_ERROR] = 0.0  # considered, and no part of the belief
    found = np.zeros_like(H)
    for k in range(ERRORS):
        errors, size = np.zeros(ERRORS), step_of(k)
        errors[k] = size
        more = looked(OBSERVED[name], corrected(CRUISE, errors))
        errors[k] = -size
        less = looked(OBSERVED[name], corrected(CRUISE, errors))
        found[:, k] = [-(high[1] - low[1]) / (2.0 * size) for high, low in zip(more, less, strict=True)]
    scale = np.abs(H).max(axis=1, keepdims=True)
    assert ((np.abs(found - H) / scale) < TOLERANCE.get(name, 1e-5)).all()
    told = {max(k for k in FIRSTS if k <= at) for at in np.flatnonzero(np.abs(H).max(axis=0))}
    assert told == set(BY[name])


def fused(name, belief, variances=None):
    """The errors' change of a belief by a reading, with the covariance before and after."""
    i, f, _ = aboard(SHIPPED)
    P = f["covariance"]
    P[:] = np.diag(np.full(ERRORS, 1e-2) if variances is None else variances)
    P[MAGNETIC_BIAS_ERROR:GNSS_DRIFT_ERROR, MAGNETIC_BIAS_ERROR:GNSS_DRIFT_ERROR] *= 1e-10
    P[STATIC_PORT_ERROR, STATIC_PORT_ERROR] *= 1e-2
    before = P.copy()
    put_belief(f, 0, belief)
    f["on_ground"] = False
    f["tube"] = rotate_inverse(belief.attitude, subtract(belief.velocity, belief.wind)).x
    OBSERVED[name](f, i)
    return get_belief(f, 0), before, P, f


@pytest.mark.parametrize("name", ["airspeed", "wing"])
def test_the_air_s_readings_tell_of_the_wind_alone(name):
    after, before, P, _ = fused(name, CRUISE)
    assert after.wind != CRUISE.wind
    air = ("wind", "steady_wind", "tube_bias")
    assert column(after._replace(**{k: getattr(CRUISE, k) for k in air})) == pytest.approx(column(CRUISE))
    others = np.delete(np.arange(ERRORS), np.arange(WIND_ERROR, WIND_ERROR + AIR_ERRORS))
    assert (P[np.ix_(others, others)] == before[np.ix_(others, others)]).all()
    assert np.trace(P[WIND_ERROR : WIND_ERROR + 3, WIND_ERROR : WIND_ERROR + 3]) < 3e-2


@pytest.mark.parametrize(
    ("name", "wrong", "part"),
    [
        ("satellites", CRUISE._replace(position=Vector(10.2, -20.1, 30.1)), "position"),
        ("satellites", CRUISE._replace(velocity=Vector(13.1, 3.1, -0.4)), "velocity"),
        ("pose", CRUISE._replace(position=Vector(10.2, -20.1, 30.1)), "position"),
        ("height", CRUISE._replace(position=Vector(10.0, -20.0, 30.5)), "position"),
    ],
)
def test_a_reading_brings_the_belief_nearer(name, wrong, part):
    after, _, _, _ = fused(name, wrong)

    def off(belief):
        return float(np.linalg.norm(np.subtract(getattr(belief, part), getattr(CRUISE, part))))

    assert off(after) < 0.95 * off(wrong)


@pytest.mark.parametrize("name", ["field", "pose"])
def test_a_turned_belief_is_turned_back(name):
    turned = CRUISE._replace(attitude=multiply(CRUISE.attitude, small_rotation(Vector(0.05, 0.03, -0.04))))
    after, _, _, _ = fused(name, turned)
    assert abs(np.dot(after.attitude, CRUISE.attitude)) > abs(np.dot(turned.attitude, CRUISE.attitude))


def test_a_reading_of_the_past_is_compared_with_where_the_vehicle_was(looked):
    """Over an age of 8 ms, for all that readings wait between two slow steps."""
    age = 0.008
    there = subtract(add(CRUISE.position, CRUISE.gnss_drift), scaled(CRUISE.velocity, age))
    fix = reading_of((0, there), (3, CRUISE.velocity))
    past = multiply(CRUISE.attitude, small_rotation(scaled(RATES, -age)))
    field = reading_of((0, add(rotate_inverse(past, EARTH), CRUISE.magnetic_bias)))
    height = reading_of((0, 30.0 + 0.2 + 0.5 * age))
    rows = looked(lambda f, i: observations.observe_satellites(f, i, fix, age, PERIODS))
    rows += looked(lambda f, i: observations.observe_field(f, i, field, age, RATES, PERIODS))
    rows += looked(lambda f, i: observations.observe_height(f, i, height, age, PERIODS))
    assert [row[1] for row in rows] == pytest.approx(10 * [0.0], abs=1e-9)


def test_the_static_port_is_learnt_where_air_flows_and_only_there():
    still = np.full(ERRORS, 1e-2)
    still[AIR] = 0.0
    calm = CRUISE._replace(velocity=CRUISE.wind)
    flying, standing = fused("height", CRUISE, still)[0], fused("height", calm, still)[0]
    assert flying.static_port < -1e-4  # the barometer reads too high, so the port sucks
    assert standing.static_port == 0.0


def test_a_barometer_whose_port_is_known_tells_the_height(looked):
    share = 0.03
    through = subtract(CRUISE.velocity, CRUISE.wind)
    head = sum(part * part for part in through) / (2.0 * NOMINAL.g)
    reading = reading_of((0, 30.0 + 0.2 - share * head))
    known = CRUISE._replace(static_port=share)
    ((_, innovation, *_),) = looked(lambda f, i: observations.observe_height(f, i, reading, 0.0, PERIODS), known)
    assert innovation == pytest.approx(0.0, abs=1e-4)


def test_the_wing_s_model_is_doubted_by_a_share_of_its_force(looked):
    ((H, *_),) = looked(OBSERVED["wing"])
    F, _ = wrench(AIRSPEED, RATES, ACTUATORS, NOMINAL)
    assert H[WING_ERROR] == pytest.approx(F.z / NOMINAL.m, rel=1e-3)


def test_on_the_ground_the_wing_tells_nothing_of_the_wind():
    i, f, _ = aboard(SHIPPED)
    f["covariance"][:] = np.eye(ERRORS)
    put_belief(f, 0, CRUISE)
    f["on_ground"] = True
    OBSERVED["wing"](f, i)
    assert get_belief(f, 0) == CRUISE
    assert f["air_doubt"] > 0.1


def test_near_its_threshold_a_tube_is_heard_where_it_is_expected_to_read(looked):
    slow = CRUISE._replace(
        wind=add_scaled(CRUISE.wind, rotate(CRUISE.attitude, Vector(1.0, 0.0, 0.0)), AIRSPEED.x - 3.5)
    )
    reading = reading_of((0, 4.5))
    assert looked(lambda f, i: observations.observe_airspeed(f, i, reading, PERIODS), slow) == []
    assert looked(lambda f, i: observations.observe_airspeed(f, i, reading, PERIODS)) != []


def test_a_tube_below_its_threshold_tells_nothing(looked):
    assert looked(lambda f, i: observations.observe_airspeed(f, i, reading_of((0, 0.0)), PERIODS)) == []


def test_without_a_tube_the_wing_tells_nothing_of_the_speed(looked):
    def along_nose(rows):
        ((H, *_),) = rows
        return rotate_inverse(CRUISE.attitude, Vector(*H[WIND_ERROR : WIND_ERROR + 3])).x

    alone = looked(lambda f, _: observations.observe_wing(f, wing_step(), False, 0.0))
    assert along_nose(alone) == pytest.approx(0.0, abs=1e-12)
    assert abs(along_nose(looked(OBSERVED["wing"]))) > 1e-3


def test_without_a_tube_the_wind_along_the_nose_fades_to_calm_and_only_that():
    before = CRUISE
    after = observations.nose_wind_fading(before, 5.0)
    gone = rotate_inverse(before.attitude, subtract(after.wind, before.wind))
    along = rotate_inverse(before.attitude, before.wind).x
    assert gone == pytest.approx((-along * 0.01 / 5.0, 0.0, 0.0), abs=1e-9)
    assert after._replace(wind=before.wind) == before


def test_a_pose_without_attitude_tells_of_the_place_alone(looked):
    reading, line = pose_reading(), EXTERNAL_POSE - FIRST_LINE
    reading[HAS_ATTITUDE] = 0.0
    rows = looked(lambda f, _: observations.observe_pose(f, line, reading, 0.0, RATES, PERIODS))
    assert [np.flatnonzero(row[0]).tolist() for row in rows] == [[0], [1], [2]]
    assert [row[3] for row in rows] == [1e-4] * 3


def test_how_well_a_reading_agreed_is_noted():
    wrong = CRUISE._replace(position=Vector(10.0, -20.0, 130.0))
    _, _, _, f = fused("pose", wrong)
    line = MOTION_CAPTURE - FIRST_LINE
    assert f["ratio"][line] > 0.0
    assert f["refused_since"][line] == PERIODS or f["fused_at"][line] == PERIODS
    _, _, _, f = fused("pose", CRUISE)
    assert f["fused_at"][line] == PERIODS
    assert f["refused_since"][line] == -1.0
    assert f["scalars"][line] == 6.0


def test_the_air_s_force_is_compared_with_what_is_felt_less_the_bias(looked):
    ((_, innovation, *_),) = looked(OBSERVED["wing"])
    # So much more than the model makes is in the step; its mean over the uncertain wind is nearly that at the belief.
    assert innovation == pytest.approx(0.1, abs=0.005)


def test_rounding_counts_as_noise_of_a_twelfth_of_its_square(looked):
    for name, spec in (("field", SHIPPED.magnetometer), ("height", SHIPPED.barometer)):
        for row in looked(OBSERVED[name]):
            assert row[3] == pytest.approx(spec.noise**2 + spec.step**2 / 12.0, rel=1e-12, abs=0.0)


def filter_with(P=1e-2):
    i, f, _ = aboard(SHIPPED)
    f["covariance"][:] = P * np.eye(ERRORS)
    put_belief(f, 0, CRUISE)
    return i, f


@pytest.mark.parametrize(
    ("moved", "turned", "fits"), [(0.0, 0.0, True), (50.0, 0.0, False), (0.0, 1.0, False), (50.0, 1.0, False)]
)
def test_a_pose_fits_with_both_its_parts_or_not_at_all(moved, turned, fits):
    _, f = filter_with()
    reading = pose_reading()
    reading[0] += moved
    reading[3:7] = multiply(Quaternion(*reading[3:7]), small_rotation(Vector(turned, 0.0, 0.0)))
    line = MOTION_CAPTURE - FIRST_LINE
    assert observations.observe_pose(f, line, reading, 0.0, RATES, PERIODS) == fits
    assert (f["refused_since"][line] < 0.0) == fits


def test_a_tube_that_is_refused_is_noted_as_the_tube_s():
    i, f = filter_with()
    before = f["refused_at"].copy()
    observations.observe_airspeed(f, i, reading_of((0, AIRSPEED.x + 30.0)), PERIODS)
    assert np.flatnonzero(f["refused_at"] != before).tolist() == [PITOT - FIRST_LINE]
    assert f["refused_at"][PITOT - FIRST_LINE] == PERIODS


@pytest.mark.parametrize(
    ("innovation", "age", "believed"),
    [(3.0, 0.0, True), (3.0 + 1e-9, 0.0, False), (-3.1, 0.0, False), (9.0, 3.0, False), (9.0, 3.002, True)],
)
def test_after_a_refusal_the_tube_has_to_be_near_for_three_seconds(innovation, age, believed):
    _, f = filter_with()
    now = 5000
    f["refused_at"][PITOT - FIRST_LINE] = now - round(age / 0.002)
    assert observations._follows(f, 12.0, innovation, now) == believed


@pytest.mark.parametrize(("speed", "believed"), [(9.0, True), (15.0, True), (15.1, False), (8.9, False)])
def test_a_tube_that_leaps_is_not_believed(speed, believed):
    _, f = filter_with()
    f["before"][PITOT - FIRST_LINE, 0] = 12.0
    assert observations._follows(f, speed, 0.0, 5000) == believed


def test_an_instrument_that_fits_again_is_mistrusted_for_half_a_second_and_its_leap_forgotten_after_a_third():
    _, f = filter_with()
    slot, now = MOTION_CAPTURE - FIRST_LINE, 5000
    for age, leapt, fits in (
        (0.1, 1.0, False),
        (0.3, 1.0, False),
        (0.302, 0.0, False),
        (0.5, 0.0, False),
        (0.502, 0.0, True),
    ):
        f["leapt"][slot], f["refused_at"][slot] = 1.0, now - round(age / 0.002)
        assert observations._fits(f, slot, now, 0.0) == fits
        assert f["leapt"][slot] == leapt


@pytest.mark.parametrize(
    ("gates", "helped", "leapt"), [(3.9, 0.1, 0.0), (4.1, 0.1, 1.0), (4.1, 0.998, 1.0), (4.1, 1.0, 0.0)]
)
def test_the_first_refusal_is_a_leap_if_it_is_four_gates_off_and_was_right_just_before(gates, helped, leapt):
    _, f = filter_with()
    slot, now = MOTION_CAPTURE - FIRST_LINE, 5000
    f["fused_at"][slot] = now - round(helped / 0.002)
    assert not observations._fits(f, slot, now, (gates * f["settings"]["gate"]) ** 2)
    assert f["leapt"][slot] == leapt
    assert f["refused_at"][slot] == now
