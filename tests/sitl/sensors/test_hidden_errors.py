"""The hidden errors: drawn by the specification, drifting as Gauss-Markov processes with their deviation and time."""

import numpy as np
import pytest

from sitl.sensors.draws import PERIOD, SLOW_PERIODS
from sitl.sensors.hidden_errors import ERROR_DRAWS, MOUNTING_DRAWS, drawn_errors, drift, turn_propellers
from sitl.sensors.instruments import GNSS_DRIFT_NOISE, GNSS_POSITION_NOISE, GNSS_VELOCITY_NOISE, SLOW_COLUMNS
from tests.support.flights.ideal_sensors import NOMINAL, SHIPPED, WANDERING, ZERO, aboard, ideal, numbers
from tests.support.flights.plant_flight import plant

STEP = SLOW_PERIODS * PERIOD
NEVER_TOLD = ("gyro_drift", "accel_drift", "gnss_drift", "gnss_noise", "gnss_velocity_noise")


def test_what_is_wrong_at_switch_on_has_the_deviations_that_are_specified():
    random = np.random.default_rng(1)
    drawn = [
        drawn_errors(WANDERING, *(random.standard_normal(n) for n in (ERROR_DRAWS, MOUNTING_DRAWS))) for _ in range(800)
    ]

    def deviation(name):
        return np.std([getattr(errors, name) for errors in drawn], axis=0)

    # The deviation of 800 draws is known to 2.5 %.
    assert deviation("gyro_bias") == pytest.approx(3 * [SHIPPED.gyroscope.bias], rel=0.1)
    assert deviation("accel_bias") == pytest.approx(3 * [SHIPPED.accelerometer.bias], rel=0.1)
    assert deviation("magnetic_bias") == pytest.approx(3 * [SHIPPED.magnetometer.bias], rel=0.1)
    assert deviation("misalignment") == pytest.approx(3 * [SHIPPED.motion_capture.misalignment], rel=0.1)
    assert deviation("imu_misalignment") == pytest.approx(3 * [WANDERING.mounting.misalignment], rel=0.1)
    assert deviation("imu_arm") == pytest.approx(3 * [WANDERING.mounting.arm_error], rel=0.1)
    assert deviation("antenna_arm") == pytest.approx(3 * [WANDERING.mounting.arm_error], rel=0.1)
    assert deviation("pitot_bias") == pytest.approx(SHIPPED.pitot.bias, rel=0.1)
    assert deviation("left_phase") > 0.5
    assert {getattr(errors, name) for errors in drawn for name in NEVER_TOLD} == {ZERO}
    assert {errors.barometer_drift for errors in drawn} == {0.0}


def drifting():
    """Instruments that only drift, each by a deviation and in a time of its own [s]."""
    none = ideal()
    return none._replace(
        gyroscope=none.gyroscope._replace(drift=0.01, drift_time=0.1),
        accelerometer=none.accelerometer._replace(drift=0.2, drift_time=0.2),
        gnss=none.gnss._replace(
            drift_level=0.5,
            drift_up=1.5,
            drift_time=0.1,
            noise_level=0.2,
            noise_up=0.4,
            velocity_noise_level=0.05,
            velocity_noise_up=0.1,
            noise_time=0.05,
        ),
        barometer=none.barometer._replace(drift=0.4, drift_time=0.15),
    )


@pytest.fixture(scope="module")
def drifts():
    """The drifts after every slow step, (n, 16)."""
    i, _, _ = aboard(drifting())
    random, rows = np.random.default_rng(2), []
    for draws in random.standard_normal((6000, SLOW_COLUMNS)):
        drift(i, draws, PERIOD)
        e = i["errors"]
        rows.append([*(x for name in NEVER_TOLD for x in numbers(e[name])), float(e["barometer_drift"])])
    return np.array(rows[200:])  # settled


def test_drifts_have_the_deviation_in_the_long_run_that_is_specified(drifts):
    # 58 s of a process that forgets in 0.2 s are some 150 independent draws: 6 %.
    wanted = [*3 * [0.01], *3 * [0.2], 0.5, 0.5, 1.5, 0.2, 0.2, 0.4, 0.05, 0.05, 0.1, 0.4]
    assert np.std(drifts, axis=0) == pytest.approx(wanted, rel=0.2)


def test_drifts_forget_in_the_time_that_is_specified(drifts):
    """The correlation over a time t is exp(-t / drift time)."""
    times = np.array([*3 * [0.1], *3 * [0.2], *3 * [0.1], *6 * [0.05], 0.15])
    centred = drifts - drifts.mean(axis=0)
    for steps in (5, 10):
        together = (centred[:-steps] * centred[steps:]).mean(axis=0) / centred.var(axis=0)
        assert together == pytest.approx(np.exp(-steps * STEP / times), abs=0.12)


def test_drifts_have_nothing_to_do_with_each_other(drifts):
    assert np.abs(np.corrcoef(drifts.T) - np.eye(16)).max() < 0.25


def test_each_drift_has_draws_of_its_own():
    i, _, _ = aboard(drifting())
    draws = np.zeros(SLOW_COLUMNS)
    draws[GNSS_DRIFT_NOISE] = 1.0
    drift(i, draws, PERIOD)
    e = i["errors"]
    assert numbers(e["gnss_drift"])[0] > 0.0
    assert numbers(e["gnss_drift"])[1:] == [0.0, 0.0]
    assert numbers(e["gyro_drift"]) == numbers(e["accel_drift"]) == [0.0, 0.0, 0.0]
    assert float(e["barometer_drift"]) == 0.0


def wandering(dt, steps, drawn):
    """Response of a wandering receiver's errors north and up to a unit draw of one slow step of ``5 dt`` seconds."""
    i, _, _ = aboard(WANDERING)
    draws, found = np.zeros(SLOW_COLUMNS), []
    draws[drawn : drawn + 3] = 1.0
    for _ in range(steps):
        drift(i, draws, dt)
        draws[:] = 0.0
        errors = i["errors"]
        found.append([numbers(errors[name])[k] for name in NEVER_TOLD[2:] for k in (0, 2)])
    return np.array(found)


def structure(response, lag):
    """Deviation of the change over a lag of steps of a process whose response to a unit draw is this."""
    later = np.vstack([response[lag:], np.zeros((lag, response.shape[1]))])
    return np.sqrt(np.sum((later - response) ** 2, axis=0) + np.sum(response[:lag] ** 2, axis=0))


def test_places_of_satellites_wander_over_one_ten_and_a_hundred_seconds():
    """Of x = a x + b w the change over t has the variance 2 s^2 (1 - exp(-t / T)), exactly, without any chance."""
    spec = WANDERING.gnss
    response = wandering(0.2, 2500, GNSS_DRIFT_NOISE)[:, :2]
    for seconds, level, up in ((1, 0.21, 0.40), (10, 0.66, 1.24), (100, 1.87, 3.52)):
        share = np.sqrt(2.0 * (1.0 - np.exp(-seconds / spec.drift_time)))
        wanted = np.array([spec.drift_level, spec.drift_up]) * share
        assert structure(response, seconds) == pytest.approx(wanted, rel=1e-3)
        assert wanted == pytest.approx([level, up], abs=0.01)


def test_a_receiver_s_noise_is_of_one_second():
    spec = WANDERING.gnss
    response = wandering(0.02, 200, GNSS_POSITION_NOISE)[:, 2:4] + wandering(0.02, 200, GNSS_VELOCITY_NOISE)[:, 4:]
    level, up = spec.noise_level + spec.velocity_noise_level, spec.noise_up + spec.velocity_noise_up
    for steps in (1, 10, 100):
        share = np.sqrt(2.0 * (1.0 - np.exp(-0.1 * steps / spec.noise_time)))
        assert structure(response, steps) == pytest.approx([level * share, up * share], rel=1e-3)


def test_the_receiver_is_as_its_data_sheet_says():
    """Half of its places are within 2.5 m, and a place wanders by 0.21 m in a second."""
    spec = WANDERING.gnss
    assert spec.drift_level * np.sqrt(2.0 * np.log(2.0)) == pytest.approx(2.5, abs=0.01)
    assert spec.drift_level * np.sqrt(2.0 / spec.drift_time) == pytest.approx(0.21, abs=0.001)


def test_the_propellers_turn_on_by_their_speeds():
    i, _, _ = aboard()
    spinning = plant(u=(500.0, 700.0, 0.0, 0.0))
    for _ in range(3):
        turn_propellers(i, spinning, ZERO, NOMINAL, PERIOD)
    assert float(i["errors"]["left_phase"]) == pytest.approx(3.0)
    assert float(i["errors"]["right_phase"]) == pytest.approx(4.2 - 2.0 * np.pi)
