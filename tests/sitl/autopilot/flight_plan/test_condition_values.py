"""The values that a condition saw, in words."""

import pytest

from protocol.flight_plans.evaluation import UnknownNameError
from protocol.flight_plans.expressions import parse_expression
from sitl.autopilot.flight_plan.plan_state import condition_values
from tests.support.plans import source

VALUES = {"laps": 2, "electrical.bat": 11.123456, "WP_A": 1}


class Names:
    """A few names; a function that changes something fails the test."""

    def value(self, name):
        if name not in VALUES:
            raise UnknownNameError(name)
        return VALUES[name]

    def loop_value(self, _name):
        return 3

    def call(self, name, _arguments):
        if name == "stateGetPositionEnu_f":
            return {"z": 7.5}
        assert name.startswith("Get"), name
        return 1.52


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("GetPosHeight() @GT 1.5", "GetPosHeight() 1.52"),
        ("laps > 1 && electrical.bat < 11.5", "laps 2, electrical.bat 11.12"),
        ("stateGetPositionEnu_f()->z > 5", "stateGetPositionEnu_f()->z 7.5"),
        ("NavSetWaypointHere(WP_A) || laps", "laps 2"),
        ("!InsideRoom(GetPosX(), GetPosY())", "GetPosX() 1.52, GetPosY() 1.52"),
        ("unheard_of > 1", ""),
        ("TRUE", ""),
        ("$lap > 2", "$lap 3"),
        ("laps + laps > laps", "laps 2"),
    ],
)
def test_what_was_read_is_told_once_and_nothing_is_changed(text, values):
    assert condition_values(parse_expression(source(text)).tree, Names()) == values
