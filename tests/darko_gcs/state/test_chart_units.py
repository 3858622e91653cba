"""Curves whose units differ by a factor alone share an axis."""

import math

import pytest

from darko_gcs.state.chart_units import UNIT_FAMILIES, shared_units


def test_units_of_one_quantity_share_the_axis_of_the_first():
    shared = shared_units(["m/s", "cm/s", "rad", "deg", "", "m/s"])
    assert {unit: axis for unit, (axis, _) in shared.items()} == {
        "m/s": "m/s", "cm/s": "m/s", "rad": "rad", "deg": "rad", "": ""
    }  # fmt: skip
    assert shared["cm/s"][1] == pytest.approx(0.01)
    assert shared["deg"][1] == pytest.approx(math.pi / 180.0)
    assert shared_units(["mV", "V"])["V"] == ("mV", pytest.approx(1000.0))


def test_no_unit_is_of_two_quantities():
    units = [unit for family in UNIT_FAMILIES for unit in family]
    assert len(units) == len(set(units))
