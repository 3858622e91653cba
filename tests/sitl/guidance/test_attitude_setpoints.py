"""The attitude that gives an acceleration."""

import numpy as np
import pytest

from sitl.control.hover_attitude import full_force
from sitl.guidance.setpoints import attitude_for
from sitl.model.airframe_files import load
from sitl.model.quaternions import x_axis

NOMINAL = load("nominal").parameters


@pytest.mark.parametrize("heading", [0.0, 2.0])
@pytest.mark.parametrize("acceleration", [(0.0, 0.0, 0.0), (2.0, 0.0, 0.0), (0.0, -3.0, 1.0), (1.0, 1.0, -2.0)])
def test_an_acceleration_is_the_force_of_its_attitude(acceleration, heading):
    attitude = attitude_for(acceleration, heading, 0.0, NOMINAL)
    force = attitude.thrust * full_force(NOMINAL) * np.array(x_axis(attitude.attitude))
    assert force / NOMINAL.m - np.array((0.0, 0.0, NOMINAL.g)) == pytest.approx(np.array(acceleration))
