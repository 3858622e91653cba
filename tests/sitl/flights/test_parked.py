"""A vehicle that stands on its tail in a wind."""

import math

import pytest

from sitl import Law, Simulation, Start, load_airframe


@pytest.mark.parametrize("azimuth", [0.0, 0.8, math.pi])
def test_the_default_airframe_keeps_its_place_in_six_metres_per_second(azimuth):
    parked = Simulation(load_airframe("collage").parameters, start=Start())
    parked.set_wind((6.0 * math.cos(azimuth), 6.0 * math.sin(azimuth), 0.0))
    before = parked.truth.body.position
    parked.step(20.0)
    body = parked.truth.body
    assert math.dist(before, body.position) < 0.02
    assert abs(2.0 * (body.attitude.x * body.attitude.z - body.attitude.w * body.attitude.y)) > 0.999
    assert parked.law is Law.LANDED


def test_a_wing_that_is_linear_at_any_incidence_is_blown_away():
    """Of the report's model, and of the passive one: across the stream they push three times as hard as a plate."""
    parked = Simulation(load_airframe("passive").parameters, start=Start())
    parked.set_wind((6.0, 0.0, 0.0))
    parked.step(10.0)
    assert parked.truth.body.position.x > 1.0
