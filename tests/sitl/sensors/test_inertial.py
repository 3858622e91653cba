"""Gyroscope and accelerometer: what they read at rest and falling, each of their errors, and their failures."""

import math

import numpy as np
import pytest

from sitl.model.airframe_files import load
from sitl.model.quaternions import Quaternion, from_euler, hover, multiply, rotate, rotate_inverse, small_rotation
from sitl.model.vectors import Vector, add_scaled, cross, scaled
from sitl.sensors.draws import PERIOD
from sitl.sensors.inertial import GARBAGE_SHARE, read_inertial, turned_phases
from sitl.sensors.instruments import FAST_COLUMNS, GARBAGE, OFF, STUCK, Accelerometer, Gyroscope, Inertial, put_inertial
from tests.support.flights.ideal_sensors import NO_ERRORS, aboard, ideal
from tests.support.flights.plant_flight import plant

ZERO = Vector(0.0, 0.0, 0.0)
FINE = 1e-9
GYRO = Gyroscope(0.0, 0.0, 0.0, 1.0, 100.0, FINE, 0.0)
ACCEL = Accelerometer(0.0, 0.0, 0.0, 1.0, 100.0, FINE, 0.0)
TILTED = from_euler(0.4, -1.1, 2.0)
PUBLISHED = load("published").parameters
G = PUBLISHED.g


def read(
    before, after=None, *, errors=NO_ERRORS, gyro=GYRO, accel=ACCEL, draws=None, last=None, failed=(0.0, 0.0), **mounted
):
    parts = ideal()
    mounting = parts.mounting._replace(**{"imu_attitude": Quaternion(1.0, 0.0, 0.0, 0.0)} | mounted)
    i, _, _ = aboard(parts._replace(gyroscope=gyro, accelerometer=accel, mounting=mounting), errors)
    i["failures"][:2] = failed
    if last is not None:
        put_inertial(i, last)
    noise = np.zeros(FAST_COLUMNS) if draws is None else draws
    return read_inertial(i, before, after or before, noise, PUBLISHED, PERIOD)


def moving(v=(1.0, 2.0, 3.0), q=TILTED, w=(0.3, -0.2, 0.1), u=(0.0, 0.0, 0.0, 0.0)):
    return plant(v=v, q=q, w=w, u=u)


def test_at_rest_it_feels_gravity_upwards_and_falling_nothing():
    assert read(plant()).force == pytest.approx((G, 0.0, 0.0), abs=1e-8)  # nose up
    at_rest = read(plant(q=TILTED))
    assert at_rest.force == pytest.approx(rotate_inverse(TILTED, Vector(0.0, 0.0, G)), abs=1e-8)
    assert at_rest.rates == (0.0, 0.0, 0.0)
    later = moving(v=(1.0, 2.0, 3.0 - G * PERIOD))
    assert read(moving(), later).force == pytest.approx((0.0, 0.0, 0.0), abs=1e-8)


def test_the_force_is_the_period_s_mean_in_the_body_frame():
    pushed = plant(v=(2.0 * PERIOD, 0.0, 0.0), q=hover(0.0))
    # Nose up with the belly to the north: the belly is at -z_b.
    assert read(plant(), pushed).force == pytest.approx((G, 0.0, -2.0), abs=1e-6)


def test_the_rates_are_the_period_s_mean():
    assert read(moving(w=(0.0, 0.2, 0.0)), moving(w=(0.2, 0.4, -0.1))).rates == pytest.approx((0.1, 0.3, -0.05))


def test_biases_and_drifts_add_to_what_is_read():
    errors = NO_ERRORS._replace(
        gyro_bias=Vector(0.01, 0.02, 0.03), gyro_drift=Vector(0.001, 0.0, -0.001),
        accel_bias=Vector(0.1, 0.2, 0.3), accel_drift=Vector(0.0, 0.01, -0.01),
    )  # fmt: skip
    wrong, right = read(moving(), errors=errors), read(moving())
    assert np.subtract(wrong.rates, right.rates) == pytest.approx([0.011, 0.02, 0.029])
    assert np.subtract(wrong.force, right.force) == pytest.approx([0.1, 0.21, 0.29])


@pytest.mark.long
def test_the_noise_has_the_density_that_is_specified():
    """White up to half the control rate: a variance of density squared over twice the period."""
    gyro, accel = GYRO._replace(noise=1e-3), ACCEL._replace(noise=2e-2)
    random = np.random.default_rng(5)
    read_all = [read(plant(), gyro=gyro, accel=accel, draws=random.standard_normal(FAST_COLUMNS)) for _ in range(1500)]
    rates, force = (np.array([reading[k] for reading in read_all]) for k in (0, 1))
    # The deviation of 4500 draws is known to about 1 %.
    assert np.std(rates) == pytest.approx(1e-3 * math.sqrt(250.0), rel=0.05)
    assert np.std(force - force.mean(axis=0)) == pytest.approx(2e-2 * math.sqrt(250.0), rel=0.05)
    mixed = np.corrcoef(np.hstack([rates, force]).T) - np.eye(6)
    assert np.abs(mixed).max() < 0.12


def test_beyond_its_range_it_reads_the_end_of_it():
    reading = read(moving(w=(5.0, -5.0, 0.5)), gyro=GYRO._replace(range=2.0), accel=ACCEL._replace(range=4.0))
    assert reading.rates == pytest.approx((2.0, -2.0, 0.5))
    assert max(abs(x) for x in reading.force) == pytest.approx(4.0)


def test_it_reads_whole_steps_and_the_nearest_one():
    reading = read(moving(w=(0.26, -0.26, 0.24)), gyro=GYRO._replace(step=0.1), accel=ACCEL._replace(step=0.5))
    assert reading.rates == pytest.approx((0.3, -0.3, 0.2))
    exact = read(moving()).force
    steps = np.array(reading.force) / 0.5
    assert steps == pytest.approx(np.rint(steps))
    assert np.abs(np.subtract(reading.force, exact)).max() <= 0.25 + 1e-6


@pytest.mark.long
def test_the_propellers_shake_it_at_their_speed_and_by_its_square():
    """One period's phase after another, as the loop turns them."""

    def shaken(speed, periods=500):
        spinning = plant(u=(speed, 0.0, 0.0, 0.0))
        errors, felt = NO_ERRORS, []
        gyro, accel = GYRO._replace(vibration=0.02), ACCEL._replace(vibration=2.0)
        for _ in range(periods):
            reading = read(spinning, errors=errors, gyro=gyro, accel=accel)
            felt.append((*reading.rates, *reading.force))
            left, right = turned_phases(errors, spinning, PERIOD)
            errors = errors._replace(left_phase=left, right_phase=right)
        return np.array(felt) - (0.0, 0.0, 0.0, G, 0.0, 0.0)

    felt = shaken(600.0)
    assert np.abs(felt).max(axis=0) == pytest.approx([0.006, 0.02, 0.02, 0.6, 2.0, 2.0], rel=0.02)
    spectrum = np.abs(np.fft.rfft(felt[:, 4]))
    assert np.argmax(spectrum) == pytest.approx(600.0 / (2.0 * math.pi), abs=1.0)  # 500 periods are a second
    assert np.abs(shaken(300.0)).max(axis=0)[4] == pytest.approx(0.5, rel=0.02)
    assert np.abs(shaken(0.0)).max() < 1e-8


# Beside the centre of mass, askew

ARM = Vector(0.03, -0.02, 0.05)


def test_beside_the_centre_of_a_spin_it_feels_the_centripetal_force_alone():
    spinning = plant(w=(0.0, 0.0, 4.0))
    swing = np.subtract(read(spinning, imu=ARM).force, read(spinning).force)
    assert swing == pytest.approx((-16.0 * ARM.x, -16.0 * ARM.y, 0.0), abs=1e-8)


def test_beside_the_centre_of_a_turn_that_begins_it_feels_the_tangential_force():
    begins = plant(w=(0.0, 0.0, -1e-3)), plant(w=(0.0, 0.0, 1e-3))
    swing = np.subtract(read(*begins, imu=ARM).force, read(*begins).force)
    assert swing == pytest.approx((-ARM.y, ARM.x, 0.0), abs=1e-8)  # 1 rad/s2


def test_beside_the_centre_it_feels_the_motion_of_its_own_place():
    """The change of velocity of the unit's place, v + R (w x r), over a period, whatever the motion."""
    v, w, turning = Vector(4.0, 3.0, -1.0), Vector(3.0, -5.0, 2.0), Vector(40.0, 20.0, -30.0)
    mean = add_scaled(w, turning, 0.5 * PERIOD)
    after = plant(
        v=(4.01, 2.98, -1.03),
        q=multiply(TILTED, small_rotation(scaled(mean, PERIOD))),
        w=tuple(add_scaled(w, turning, PERIOD)),
    )
    before, error = plant(v=tuple(v), q=TILTED, w=tuple(w)), Vector(0.004, 0.001, -0.003)

    def velocity(p):
        q = p.body.attitude
        return np.add(p.body.velocity, rotate(q, cross(p.body.rates, add_scaled(ARM, error, 1.0))))

    felt = Vector(*((velocity(after) - velocity(before)) / PERIOD + (0.0, 0.0, G)))
    wanted = np.mean([rotate_inverse(p.body.attitude, felt) for p in (before, after)], axis=0)
    reading = read(before, after, imu=ARM, errors=NO_ERRORS._replace(imu_arm=error)).force
    assert np.abs(np.subtract(reading, read(before, after).force)).max() > 1.0
    assert reading == pytest.approx(wanted, abs=2e-3)


def test_a_unit_pitched_in_the_airframe_clips_and_counts_along_its_own_axes():
    pitched = from_euler(0.0, math.radians(17.0), 0.0)
    assert read(moving(), imu_attitude=pitched).force == pytest.approx(read(moving()).force, abs=1e-8)
    fast = moving(w=(0.0, 0.0, 5.0))
    reading = read(fast, gyro=GYRO._replace(range=2.0), imu_attitude=pitched).rates
    assert rotate_inverse(pitched, reading) == pytest.approx((-5.0 * math.sin(math.radians(17.0)), 0.0, 2.0))
    steps = rotate_inverse(pitched, read(moving(), accel=ACCEL._replace(step=0.5), imu_attitude=pitched).force)
    assert np.array(steps) / 0.5 == pytest.approx(np.rint(np.array(steps) / 0.5))


def test_axes_that_lie_askew_turn_what_is_read():
    """By a small turn e: v - e x v."""
    askew = Vector(0.004, -0.002, 0.003)
    wrong, right = read(moving(), errors=NO_ERRORS._replace(imu_misalignment=askew)), read(moving())
    for k in (0, 1):
        assert np.subtract(wrong[k], right[k]) == pytest.approx(-np.cross(askew, right[k]), abs=1e-8)


LAST = Inertial(Vector(0.1, 0.2, 0.3), Vector(1.0, 2.0, 3.0))


@pytest.mark.parametrize("failure", [OFF, STUCK])
def test_a_dead_or_stuck_one_repeats_its_last_reading(failure):
    dead = read(moving(), last=LAST, failed=(failure, 0.0))
    assert dead.rates == LAST.rates
    assert dead.force == read(moving()).force
    dead = read(moving(), last=LAST, failed=(0.0, failure))
    assert dead.force == LAST.force
    assert dead.rates == read(moving()).rates


def test_garbage_has_nothing_to_do_with_the_motion():
    draws = np.arange(1.0, FAST_COLUMNS + 1.0)
    failed = (float(GARBAGE), float(GARBAGE))
    broken = read(moving(), draws=draws, failed=failed)
    assert broken == read(plant(), draws=draws, failed=failed)
    assert broken.rates == pytest.approx(GARBAGE_SHARE * GYRO.range * draws[:3])
    assert broken.force == pytest.approx(GARBAGE_SHARE * ACCEL.range * draws[3:6])
