"""The replayed plant is that of the simulation: the same equations, actuators and steps."""

import numpy as np
import pytest

from sitl.lab.identification.replay import ActuatorHistory, accelerations, actuator_positions, shots
from sitl.model.actuators import moved
from sitl.model.airframe_files import load
from sitl.model.plant import derivative
from sitl.model.quaternions import Quaternion
from sitl.model.state import Actuators, Body
from sitl.model.vectors import Vector
from tests.support.lab.identified_flight import flown

STILL = Vector(0.0, 0.0, 0.0)


@pytest.mark.parametrize("name", ["collage", "nominal", "passive"])
def test_accelerations_are_those_of_the_plant(name):
    a = load(name).parameters
    random = np.random.default_rng(1)
    v, w = 8.0 * random.standard_normal((20, 3)), random.standard_normal((20, 3))
    actuators = random.uniform([200.0, 200.0, -0.5, -0.5], [800.0, 800.0, 0.5, 0.5], (20, 4))
    force, turning = accelerations(v, w, actuators, a)
    for i in range(20):
        body = Body(STILL, Vector(*v[i]), Quaternion(1.0, 0.0, 0.0, 0.0), Vector(*w[i]))
        rate = derivative(body, Actuators(*actuators[i]), STILL, STILL, STILL, a)
        assert force[i] - [0.0, 0.0, a.g] == pytest.approx(rate.velocity)
        assert turning[i] == pytest.approx(rate.rates)


def test_positions_end_where_the_actuators_do_and_their_mean_is_exact():
    a = load("collage").parameters
    commands = np.array([[400.0, 500.0, 0.0, 0.0], [420.0, 500.5, 0.1, -0.002], [420.0, 480.0, 0.1, 0.2]])
    before, mean = actuator_positions(commands, 0.001, a)
    now, fine = Actuators(*commands[0]), []
    for wanted in commands:
        for _ in range(1000):
            fine.append(now)
            now = moved(now, Actuators(*wanted), 1e-6, a)
    assert before[2] == pytest.approx(fine[2000])
    assert mean[1] == pytest.approx(np.mean(fine[1000:2000], axis=0), rel=1e-4, abs=1e-5)


def test_a_shot_from_a_flown_state_lands_where_the_flight_did():
    true, flight = flown("collage", 3)
    begin, steps = 4000, 500  # in forward flight, for a second
    commands = np.repeat(flight.command[: begin + steps], 2, axis=0)
    before, _ = actuator_positions(commands, 0.001, true)
    first = np.array([2 * begin])
    wind = np.array([1.2, -1.6, 0.0])
    (end,) = shots(flight.body[[begin]], first, 2 * steps, ActuatorHistory(commands, before, 0.001), wind, true)
    assert end == pytest.approx(flight.body[begin + steps], abs=1e-6)
