"""Recognition of limit cycles, and the actuator models that have one."""

import math

import numpy as np
import pytest

from sitl.lab.reproduction.experiment import Conditions, Verdict
from sitl.lab.reproduction.experiments import actuator_experiments
from sitl.lab.reproduction.experiments.actuator_experiments import Ending
from sitl.lab.scenarios import RATE, Track


def swinging(amplitude, frequency=1.0, decay=0.0, distance=1.0, diverged=""):
    time = np.arange(0.0, 20.0, 1.0 / RATE)
    n = time.size
    zeros = np.zeros((n, 3))
    actuator = np.zeros((n, 4))
    actuator[:, 2] = amplitude * np.exp(-decay * time) * np.sin(2.0 * math.pi * frequency * time)
    p = zeros + np.array((distance, 0.0, 0.0))
    return Track(
        time=time, p=p, v=zeros, q=np.zeros((n, 4)), actuator=actuator, v_hover=np.zeros(n), law=np.zeros(n, int),
        target=zeros, energy=np.zeros(n), pointing=np.zeros((n, 5)), jumps=(), wall_time=1.0, diverged=diverged,
    )  # fmt: skip


def test_a_limit_cycle_is_a_bounded_oscillation_that_does_not_decay():
    cycle = actuator_experiments.oscillation(swinging(0.5, frequency=1.3))
    assert cycle.ending is Ending.CYCLE
    assert cycle.amplitude == pytest.approx(0.5, rel=0.01)
    assert cycle.frequency == pytest.approx(1.3, abs=0.06)
    assert actuator_experiments.oscillation(swinging(0.5, decay=0.3)).ending is Ending.SETTLED
    assert actuator_experiments.oscillation(swinging(0.005)).ending is Ending.SETTLED
    assert actuator_experiments.oscillation(swinging(0.5, distance=80.0)).ending is Ending.LOST
    assert actuator_experiments.oscillation(swinging(0.5, diverged="gone")).ending is Ending.LOST


def test_the_limit_cycle_needs_the_elevons_rate_limit_and_a_large_enough_step():
    made = actuator_experiments.models(Conditions())

    def ending(name, step):
        return actuator_experiments.oscillation(actuator_experiments.step_flight(made[name], 18.0, step, 1)).ending

    assert ending("saturated", 1.0) is ending("only the elevons' rate", 1.0) is Ending.CYCLE
    assert ending("first order", 1.0) is ending("only the motors' rate", 1.0) is Ending.SETTLED
    assert ending("saturated", 0.1) is Ending.SETTLED


# The printed limits, measured.


def test_the_actuators_obey_every_printed_limit():
    assert {row.verdict for row in actuator_experiments.run_actuator_limits(Conditions()).statements} == {
        Verdict.REPRODUCED
    }


@pytest.mark.parametrize("name", ["omega_min", "omega_max", "omega_rate", "delta_max", "delta_rate"])
def test_another_limit_is_noticed(name):
    rows = actuator_experiments.run_actuator_limits(Conditions(factors=((name, 1.1),))).statements
    assert [row.verdict for row in rows].count(Verdict.UNEXPLAINED) == 1
