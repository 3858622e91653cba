"""The notch at the propellers' speed: their tone is taken away, what is slow passes a little later."""

import math

import numpy as np
import pytest

from sitl.estimation.notch import MIN_SPEED, notched, quiet
from sitl.model.vectors import Vector
from sitl.sensors.draws import PERIOD

SPEED = 600.0  # of the propellers, as in a hover [rad/s]


def passed(frequency, speed=SPEED, seconds=3.0):
    """Size of a tone after the notch, and by how much it comes later [s]; from its last half."""
    times = np.arange(0.0, seconds, PERIOD)
    notch, made = quiet(Vector(0.0, 0.0, 0.0)), []
    for tone in np.sin(frequency * times):
        notch = notched(Vector(float(tone), 0.0, 0.0), notch, speed, PERIOD)
        made.append(notch.made.x)
    half = len(times) // 2
    waves = np.column_stack([np.sin(frequency * times), np.cos(frequency * times)])[half:]
    (along, across), *_ = np.linalg.lstsq(waves, np.array(made[half:]), rcond=None)
    return math.hypot(along, across), -math.atan2(across, along) / frequency


@pytest.mark.parametrize("speed", [450.0, 600.0, 750.0])
def test_a_tone_at_the_propellers_speed_is_taken_away(speed):
    size, _ = passed(speed, speed)
    assert size < 1e-3


def test_both_propellers_lie_within_its_width():
    """They differ by a few per cent while the vehicle turns."""
    assert max(passed(SPEED * share)[0] for share in (0.95, 1.05)) < 0.2


@pytest.mark.parametrize("frequency", [2.0, 20.0, 60.0, 0.33 * SPEED])
def test_what_is_slow_passes_whole_and_about_a_millisecond_late(frequency):
    size, late = passed(frequency)
    assert size == pytest.approx(1.0, abs=0.05)
    assert 0.5e-3 < late < 1.5e-3


def test_a_constant_passes_as_it_is_on_every_axis():
    notch = quiet(Vector(0.0, 0.0, 0.0))
    for _ in range(200):
        notch = notched(Vector(1.0, -2.0, 3.0), notch, SPEED, PERIOD)
    assert notch.made == pytest.approx((1.0, -2.0, 3.0), abs=1e-9)


def test_slow_propellers_do_not_shake_and_nothing_is_taken_away():
    notch = notched(Vector(1.0, 2.0, 3.0), quiet(Vector(0.0, 0.0, 0.0)), MIN_SPEED - 1.0, PERIOD)
    assert notch == quiet(Vector(1.0, 2.0, 3.0))


@pytest.mark.parametrize("speed", [1700.0, 2060.0])
def test_propellers_beyond_half_the_readings_rate_are_taken_away_at_their_alias(speed):
    size, _ = passed(2.0 * math.pi / PERIOD - speed, speed)
    assert size < 1e-3


@pytest.mark.parametrize("speed", [math.pi / PERIOD, 1571.0, 1675.0, 2.0 * math.pi / PERIOD, 5000.0])
def test_no_speed_of_the_propellers_makes_it_ring(speed):
    assert passed(20.0, speed)[0] == pytest.approx(1.0, abs=0.05)
