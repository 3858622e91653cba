"""Frames of the actuators' commands: held between them, late by the pipeline, and each at its own rate."""

import pytest

from sitl.model.state import Actuators
from sitl.sensors.draws import PERIOD
from sitl.simulation.sensed import delayed
from tests.support.flights.ideal_sensors import aboard, ideal


def sent(periods, servo_rate, motor_rate, latency=0.0):
    """Commands in force, period by period, where every command is the number of its period."""
    parts = ideal()
    pipeline = parts.pipeline._replace(servo_rate=servo_rate, motor_rate=motor_rate, latency=latency)
    i, _, _ = aboard(parts._replace(pipeline=pipeline))
    return [delayed(i, Actuators(*4 * (float(period),)), period) for period in range(1, periods + 1)]


def test_a_servo_holds_its_command_for_a_frame_and_a_motor_for_a_period():
    in_force = sent(100, 50.0, 500.0)
    assert [c.left_motor for c in in_force] == [c.right_motor for c in in_force] == [float(k) for k in range(1, 101)]
    assert [c.left_elevon for c in in_force] == [c.right_elevon for c in in_force]
    assert [c.left_elevon for c in in_force] == [float(10 * (k // 10)) for k in range(1, 101)]


@pytest.mark.parametrize("rate", [40.0, 333.0, 700.0])
def test_a_command_waits_half_a_frame_in_the_mean_and_never_longer_than_one(rate):
    ages = [period - c.left_elevon for period, c in enumerate(sent(2000, rate, 500.0), start=1)][20:]
    frame = max(1.0 / rate, PERIOD)
    assert max(ages) * PERIOD < frame + 1e-9
    assert sum(ages) / len(ages) * PERIOD == pytest.approx(0.5 * (frame - PERIOD), abs=2e-4)


def test_the_pipeline_s_latency_comes_before_the_frame():
    late = sent(60, 50.0, 500.0, latency=0.02)[20:]
    assert [c.left_motor for c in late] == [float(k - 10) for k in range(21, 61)]
    assert [c.left_elevon for c in late] == [float(10 * (k // 10) - 10) for k in range(21, 61)]
