"""The battery monitor: noisy in steps, one number until it reads again, one seed one series."""

import numpy as np
import pytest

from sitl.sensors.battery_monitor import monitored
from sitl.sensors.draws import PERIOD
from sitl.sensors.sensor_files import load_sensors

SPEC = load_sensors().battery
BETWEEN = round(1.0 / SPEC.timing.rate / PERIOD)  # control periods


def readings(count, seed=1):
    return np.array([monitored(11.8, 6.0, SPEC, k * BETWEEN, seed) for k in range(count)])


def test_noise_is_as_specified_about_the_true_values():
    seen = readings(400)
    assert seen.mean(axis=0) == pytest.approx((11.8, 6.0), abs=0.02)
    assert seen.std(axis=0) == pytest.approx((SPEC.voltage_noise, SPEC.current_noise), rel=0.2)


def test_numbers_come_in_steps_and_last_until_the_next_reading():
    for voltage, current in readings(20):
        assert voltage / SPEC.voltage_step == pytest.approx(round(voltage / SPEC.voltage_step), abs=1e-6)
        assert current / SPEC.current_step == pytest.approx(round(current / SPEC.current_step), abs=1e-6)
    assert monitored(11.8, 6.0, SPEC, 0, 1) == monitored(11.8, 6.0, SPEC, BETWEEN - 1, 1)
    assert monitored(11.8, 6.0, SPEC, 0, 1) != monitored(11.8, 6.0, SPEC, BETWEEN, 1)


def test_a_seed_is_one_series_and_no_current_is_negative():
    assert (readings(5) == readings(5)).all()
    assert (readings(5) != readings(5, seed=2)).any()
    assert min(monitored(11.8, 0.0, SPEC, k * BETWEEN, 1).current for k in range(50)) == 0.0
