"""The printed limits, measured."""

import pytest

from sitl.lab.reproduction.experiment import Conditions, Verdict
from sitl.lab.reproduction.experiments import actuator_experiments


def test_the_actuators_obey_every_printed_limit():
    assert {row.verdict for row in actuator_experiments.run_actuator_limits(Conditions()).statements} == {
        Verdict.REPRODUCED
    }


@pytest.mark.parametrize("name", ["omega_min", "omega_max", "omega_rate", "delta_max", "delta_rate"])
def test_another_limit_is_noticed(name):
    rows = actuator_experiments.run_actuator_limits(Conditions(factors=((name, 1.1),))).statements
    assert [row.verdict for row in rows].count(Verdict.UNEXPLAINED) == 1
