"""Observations: each derivative by an error is the change of the innovation; only permitted errors are corrected."""

import numpy as np
import pytest

from sitl.estimation import observations
from sitl.estimation.nominal_state import (
    ATTITUDE_ERROR,
    ERRORS,
    MAGNETIC_BIAS_ERROR,
    STATIC_PORT_ERROR,
    WIND_ERROR,
    WING_ERROR,
    corrected,
)
from sitl.model.quaternions import Quaternion, multiply, rotate, rotate_inverse, small_rotation
from sitl.model.vectors import Vector, add, cross, scaled, subtract
from sitl.sensors.instruments import (
    EXTERNAL_POSE,
    FIRST_DELAYED,
    GNSS,
    HAS_ATTITUDE,
    MAGNETOMETER,
    MOTION_CAPTURE,
)
from tests.support.flights.ideal_sensors import NOMINAL, SHIPPED, WANDERING
from tests.support.flights.observed_cruise import (
    AIR,
    BY,
    CRUISE,
    EARTH,
    FIRSTS,
    OBSERVED,
    PERIODS,
    RATES,
    TOLERANCE,
    filter_with,
    fused,
    pose_reading,
    reading_of,
)


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


@pytest.mark.parametrize(
    ("name", "wrong", "part", "left"),
    [
        ("satellites", CRUISE._replace(position=Vector(10.2, -20.1, 30.1)), "position", 0.99),
        ("satellites", CRUISE._replace(velocity=Vector(13.1, 3.1, -0.4)), "velocity", 0.99),
        ("pose", CRUISE._replace(position=Vector(10.2, -20.1, 30.1)), "position", 0.95),
        ("height", CRUISE._replace(position=Vector(10.0, -20.0, 30.5)), "position", 0.95),
    ],
)
def test_a_reading_brings_the_belief_nearer(name, wrong, part, left):
    """At least so much; of a receiver that wanders one reading in twenty is new."""
    after, _, _, _ = fused(name, wrong)

    def off(belief):
        return float(np.linalg.norm(np.subtract(getattr(belief, part), getattr(CRUISE, part))))

    assert off(after) < left * off(wrong)


@pytest.mark.parametrize("name", ["field", "pose"])
def test_a_turned_belief_is_turned_back(name):
    turned = CRUISE._replace(attitude=multiply(CRUISE.attitude, small_rotation(Vector(0.05, 0.03, -0.04))))
    after, _, _, _ = fused(name, turned)
    assert abs(np.dot(after.attitude, CRUISE.attitude)) > abs(np.dot(turned.attitude, CRUISE.attitude))


def test_a_reading_of_the_past_is_compared_with_where_the_vehicle_was(looked):
    """Over an age of 8 ms, for all that readings wait between two slow steps."""
    age = 0.008
    there = subtract(add(CRUISE.position, CRUISE.gnss_drift), scaled(CRUISE.velocity, age))
    antenna = WANDERING.mounting.antenna
    there = add(there, rotate(CRUISE.attitude, antenna))
    fix = reading_of((0, there), (3, add(CRUISE.velocity, rotate(CRUISE.attitude, cross(RATES, antenna)))))
    past = multiply(CRUISE.attitude, small_rotation(scaled(RATES, -age)))
    field = reading_of((0, add(rotate_inverse(past, EARTH), CRUISE.magnetic_bias)))
    height = reading_of((0, 30.0 + 0.2 + 0.5 * age))
    rows = looked(lambda f, i: observations.observe_satellites(f, i, fix, age, RATES, PERIODS))
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


def test_a_pose_without_attitude_tells_of_the_place_alone(looked):
    reading, line = pose_reading(), EXTERNAL_POSE - FIRST_DELAYED
    reading[HAS_ATTITUDE] = 0.0
    rows = looked(lambda f, _: observations.observe_pose(f, line, reading, 0.0, RATES, PERIODS))
    assert [np.flatnonzero(row[0]).tolist() for row in rows] == [[0], [1], [2]]
    assert [row[3] for row in rows] == [1e-4] * 3


def test_rounding_counts_as_noise_of_a_twelfth_of_its_square(looked):
    for name, spec in (("field", SHIPPED.magnetometer), ("height", SHIPPED.barometer)):
        for row in looked(OBSERVED[name]):
            assert row[3] == pytest.approx(spec.noise**2 + spec.step**2 / 12.0, rel=1e-12, abs=0.0)


@pytest.mark.parametrize(
    ("moved", "turned", "fits"), [(0.0, 0.0, True), (50.0, 0.0, False), (0.0, 1.0, False), (50.0, 1.0, False)]
)
def test_a_pose_fits_with_both_its_parts_or_not_at_all(moved, turned, fits):
    _, f = filter_with()
    reading = pose_reading()
    reading[0] += moved
    reading[3:7] = multiply(Quaternion(*reading[3:7]), small_rotation(Vector(turned, 0.0, 0.0)))
    line = MOTION_CAPTURE - FIRST_DELAYED
    assert observations.observe_pose(f, line, reading, 0.0, RATES, PERIODS) == fits
    assert (f["refused_since"][line] < 0.0) == fits


def test_the_port_s_suction_is_that_of_the_expected_square_of_the_speed(looked):
    calm = CRUISE._replace(velocity=CRUISE.wind)

    def observe(f, i):
        for k, variance in enumerate((4.0, 9.0, 25.0)):
            f["covariance"][WIND_ERROR + k, WIND_ERROR + k] = variance
        observations.observe_height(f, i, reading_of((0, 30.0)), 0.0, PERIODS)

    ((H, *_),) = looked(observe, calm)
    assert H[STATIC_PORT_ERROR] == pytest.approx(-(4.0 + 9.0) / (2.0 * NOMINAL.g))


@pytest.mark.parametrize(
    ("refused", "since", "stands", "after"),
    [(True, 0.0, -1.0, 0.0), (True, -1.0, -1.0, 50.0), (False, 20.0, 50.0, 20.0), (False, 20.0, -1.0, -1.0)],
)
def test_a_fix_is_refused_as_a_whole_since_its_first_part_was(refused, since, stands, after):
    _, f = filter_with()
    line = GNSS - FIRST_DELAYED
    f["refused_since"][line] = stands
    observations._refuse_as_one(f, line, refused, since, 50)
    assert f["refused_since"][line] == after


def test_a_field_counts_as_three_numbers():
    _, _, _, f = fused("field", CRUISE)
    assert f["scalars"][MAGNETOMETER - FIRST_DELAYED] == 3.0


@pytest.mark.parametrize(("strength", "fused_at"), [(1.0, PERIODS), (1.4, -1.0), (0.6, -1.0)])
def test_a_field_of_another_strength_is_refused_however_uncertain_the_attitude(strength, fused_at):
    i, f = filter_with()
    f["covariance"][:] = 1e-12 * np.eye(ERRORS)
    f["covariance"][ATTITUDE_ERROR : ATTITUDE_ERROR + 3, ATTITUDE_ERROR : ATTITUDE_ERROR + 3] = 1.0 * np.eye(3)
    turned = multiply(CRUISE.attitude, small_rotation(Vector(0.03, -0.02, 0.04)))
    read = add(scaled(rotate_inverse(turned, EARTH), strength), CRUISE.magnetic_bias)
    observations.observe_field(f, i, reading_of((0, read)), 0.0, RATES, PERIODS)
    assert f["fused_at"][MAGNETOMETER - FIRST_DELAYED] == fused_at
