"""Actuator models as describing functions."""

import math

import pytest

from sitl.lab.reproduction.equations.actuator_response import response
from sitl.model.airframe_files import load

NOMINAL, FIRST_ORDER = load("nominal").parameters, load("nominal-first-order").parameters


@pytest.mark.long
def test_a_first_order_actuator_responds_by_its_closed_form():
    for which, tau in ((0, FIRST_ORDER.motor_tau), (2, FIRST_ORDER.elevon_tau)):
        gain, phase = response(FIRST_ORDER, which, 0.1, 4.0)
        turn = 2.0 * math.pi * 4.0 * tau
        assert gain == pytest.approx(1.0 / math.hypot(1.0, turn), rel=0.01)
        assert phase == pytest.approx(-math.atan(turn), abs=0.02)


def test_a_rate_limited_actuator_follows_small_sines_and_makes_triangles_of_large_ones():
    amplitude, frequency = math.radians(29.0), 15.0
    small, _ = response(NOMINAL, 2, math.radians(1.0), frequency)
    large, phase = response(NOMINAL, 2, amplitude, frequency)
    assert small == pytest.approx(1.0, abs=0.01)
    triangle = 8.0 / math.pi**2 * NOMINAL.delta_rate / (4.0 * frequency * amplitude)
    assert large == pytest.approx(triangle, rel=0.02)
    assert -math.pi / 2 < phase < -1.2
