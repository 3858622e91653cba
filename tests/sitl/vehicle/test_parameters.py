"""Parameters: each is described on the field that it sets, and the docs state its default."""

import re

import pytest

from protocol.dialect import mavlink
from sitl.autopilot.settings import Settings
from sitl.errors import SitlError
from sitl.simulation.tuning import Tuning
from sitl.tools.parameter_metadata import annotated_fields
from sitl.vehicle.parameters import PARAMETERS, Configuration, WorldSettings, within_bounds
from tests.support.paths import DATA

ROOT = DATA.parents[1]
STATED = re.compile(r"`([A-Z_]+)` \((\d+(?:\.\d+)?)(?: [a-z/]+)?(?:: [^)]*)?\)")  # `NAME` (value unit: meaning)
DEFAULTS = Configuration()


FOR_STUDIES = {"governor", "nu_prime", "robust_pi", "paparazzi"}  # choices of studies that the vehicle does not offer


@pytest.mark.parametrize("group", [Settings, Tuning, WorldSettings])
def test_every_other_field_is_set_by_a_parameter(group):
    set_by_parameters = [field.name for field in annotated_fields(group)]
    assert set_by_parameters == [name for name in group._fields if name not in FOR_STUDIES]


def test_names_fit_the_wire_and_are_unique():
    names = [field.metadata.name for group in (Settings, Tuning, WorldSettings) for field in annotated_fields(group)]
    assert names == list(PARAMETERS)
    assert all(re.fullmatch(r"[A-Z0-9_]{1,16}", name) for name in names)


def test_types_on_the_wire_are_those_of_the_fields():
    for parameter in DEFAULTS.wire_table():
        bound = PARAMETERS[parameter.name]
        value = getattr(getattr(DEFAULTS, bound.group), bound.field)
        wire = mavlink.MAV_PARAM_TYPE_INT32 if isinstance(value, int) else mavlink.MAV_PARAM_TYPE_REAL32
        assert parameter.type == wire
        assert parameter.minimum <= parameter.value == value <= parameter.maximum


def test_a_changed_parameter_changes_its_field_and_nothing_else():
    changed = DEFAULTS.replaced({"DRK_KPP": 2.0, "DRK_LQI": 0.0, "SIM_GUST_RMS": 1.5})
    expected = Configuration(tuning=Tuning(kpp=2.0, integral=0), world=WorldSettings(gusts=1.5))
    assert changed == expected
    assert isinstance(changed.tuning.integral, int)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"NOSUCH": 1.0}, "there is no parameter NOSUCH"),
        ({"DRK_KP": 1.0}, "there is no parameter DRK_KP; did you mean DRK_KPP?"),
        ({"DRK_KPP": 9.0}, "DRK_KPP = 9 is outside 0.1..3"),
        ({"DRK_V_ENTER": 60.0, "DRK_V_LEAVE": 50.0}, "DRK_V_ENTER must stay below DRK_V_LEAVE"),
        ({"DRK_VF_ENTER": 60.0}, "DRK_VF_ENTER must stay below DRK_VF_LEAVE"),
        ({"GF_ACTION": 4.0}, "GF_ACTION 4 (terminate) is not available"),
    ],
)
def test_impossible_values_are_refused(values, words):
    with pytest.raises(SitlError, match=re.escape(words)):
        DEFAULTS.replaced(values)


def test_two_values_may_change_together_that_could_not_change_one_by_one():
    changed = DEFAULTS.replaced({"DRK_V_ENTER": 250.0, "DRK_V_LEAVE": 300.0})
    assert (changed.tuning.v_enter, changed.tuning.v_leave) == (250.0, 300.0)


def test_values_beyond_their_bounds_move_to_the_nearest_bound():
    tuning = Tuning(v_enter=-2.0, v_leave=float("inf"))
    assert within_bounds(tuning) == Tuning(v_enter=-1.0, v_leave=1e5)
    assert within_bounds(DEFAULTS.settings) == DEFAULTS.settings


def test_the_docs_state_the_defaults():
    pages = [ROOT / "README.md", *(ROOT / "docs").glob("*.md")]
    stated = [
        (page.name, name, float(value))
        for page in pages
        for name, value in STATED.findall(page.read_text(encoding="utf-8"))
        if name in PARAMETERS
    ]
    assert len(stated) > 10
    assert [(page, name, value) for page, name, value in stated if value != DEFAULTS.value(name)] == []
