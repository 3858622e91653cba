"""Direction of the span between hover and cruise: the heading gives way to an air stream from ahead."""

import math

import numpy as np
import pytest

from sitl.control.flatness import View
from sitl.control.forward_flight.line_of_sight import attitude
from sitl.design.gains import line_of_sight_gains
from sitl.model.aerodynamics import slopes, trimmed_slope
from sitl.model.airframe_files import load
from sitl.model.quaternions import hover, rotate
from sitl.model.vectors import Vector

A = load("nominal").parameters
GAINS = line_of_sight_gains()
WEIGHT = Vector(0.0, 0.0, A.m * A.g)


def carried(v_a):
    """Normal force of the trimmed wing by the velocity across it, which here does not depend on the incidence."""
    return trimmed_slope(slopes(v_a, 0.0, 0.0, A), A)


def span_azimuth(airspeed, azimuth, heading):
    """Azimuth of what the belly faces, square to the left wing [rad]."""
    v_a = Vector(airspeed * math.cos(azimuth), airspeed * math.sin(azimuth), 0.0)
    view = View(heading, hover(heading), GAINS.blend_from, GAINS.blend_to)
    y = rotate(attitude(WEIGHT, v_a, view, carried(v_a), A), Vector(0.0, 1.0, 0.0))
    return math.atan2(-y.x, y.y)


@pytest.mark.parametrize("heading", [0.0, 1.1, -2.4])
@pytest.mark.parametrize("aside", [0.4, -0.7])
@pytest.mark.parametrize("meeting", [3.9, 4.0, 4.5, 5.5, 6.8, 7.0, 8.0])
def test_the_blend_is_smooth_between_four_and_seven_metres_per_second_from_ahead(heading, aside, meeting):
    airspeed = meeting / math.cos(aside)
    share = min(max((meeting - 4.0) / 3.0, 0.0), 1.0)
    share = 3.0 * share**2 - 2.0 * share**3
    ahead = (1.0 - share) * np.array((1.0, 0.0)) + share * np.array((math.cos(aside), math.sin(aside)))
    expected = heading + math.atan2(ahead[1], ahead[0])
    assert math.remainder(span_azimuth(airspeed, heading + aside, heading) - expected, math.tau) == pytest.approx(
        0.0, abs=1e-9
    )


@pytest.mark.parametrize("aside", [math.pi, 2.5, -2.0])
def test_a_stream_from_behind_turns_nothing(aside):
    assert math.remainder(span_azimuth(12.0, 0.8 + aside, 0.8) - 0.8, math.tau) == pytest.approx(0.0, abs=1e-9)


def test_the_gains_are_those_of_these_numbers():
    assert (GAINS.blend_from, GAINS.blend_to) == (4.0, 7.0)
