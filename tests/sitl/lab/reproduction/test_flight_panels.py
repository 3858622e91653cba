"""The three angles of the attitude figures."""

import math

import numpy as np
import pytest

from sitl.lab.reproduction.flight_panels import angles
from sitl.model.quaternions import Quaternion, from_euler, hover, multiply


def about(axis, angle):
    half = 0.5 * angle
    return Quaternion(math.cos(half), *(math.sin(half) * x for x in axis))


@pytest.mark.parametrize(("roll", "pitch", "yaw"), [(0.3, -1.2, 0.4), (-2.0, -1.6, -0.7), (0.1, 0.5, 1.2)])
def test_the_angles_are_those_of_pitch_then_yaw_then_roll(roll, pitch, yaw):
    q = multiply(multiply(about((0, 1, 0), pitch), about((0, 0, 1), yaw)), about((1, 0, 0), roll))
    found = angles(np.array([q]))
    assert (found.roll[0], found.pitch[0], found.yaw[0]) == pytest.approx((roll, pitch, yaw))


def test_nothing_folds_where_the_nose_passes_the_vertical():
    """From nose-up short of the vertical to beyond it, at any heading."""
    pitches = np.radians(np.linspace(-60.0, -120.0, 41))
    q = np.array([from_euler(0.0, pitch, 0.0) for pitch in pitches])
    found = angles(q)
    assert found.pitch == pytest.approx(pitches)
    assert found.roll == pytest.approx(np.zeros(41), abs=1e-9)
    assert found.yaw == pytest.approx(np.zeros(41), abs=1e-9)


def test_in_the_hover_roll_is_the_heading():
    for heading in (0.0, 0.5, -1.0):
        found = angles(np.array([hover(heading)]))
        assert found.pitch[0] == pytest.approx(-0.5 * math.pi)
        assert abs(found.roll[0]) == pytest.approx(abs(heading))


def test_angles_go_on_beyond_a_half_turn():
    q = np.array([from_euler(0.0, pitch, 0.0) for pitch in np.linspace(0.0, -6.0, 61)])
    assert angles(q).pitch[-1] == pytest.approx(-6.0)
