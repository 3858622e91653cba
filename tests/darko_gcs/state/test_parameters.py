"""The vehicle's parameters: metadata, changes that were asked for, and the table, filtered and compared."""

import pytest

from darko_gcs.state.parameters import (
    ChangeState,
    Difference,
    ParameterChange,
    ParameterFilter,
    ParameterMetadata,
    default_differences,
    differences,
    matching_names,
    parameter_counts,
    parameter_details,
    refused_changes,
)
from darko_gcs.state.snapshot import EMPTY_SNAPSHOT
from tests.support.gcs.snapshots import snapshot_with

GAIN = ParameterMetadata(text="Position gain", unit="N/m", minimum=0.1, maximum=3.0, default=1.2)
SWITCH = ParameterMetadata(text="Integral in the linear law", minimum=0.0, maximum=1.0, default=1.0, is_integer=True)


@pytest.mark.parametrize(
    ("metadata", "value", "problem"),
    [
        (GAIN, 3.0, None),
        (GAIN, 3.1, "3.1 is outside 0.1..3 N/m"),
        (SWITCH, 0.5, "0.5 is not a whole number"),
        (ParameterMetadata(minimum=1.0), 0.0, "0 is outside 1.."),
        (ParameterMetadata(), 1e30, None),
    ],
)
def test_a_value_out_of_range_has_a_problem(metadata, value, problem):
    assert metadata.problem_with(value) == problem


ACTION = ParameterMetadata(values=((0.0, "go on"), (1.0, "Hold"), (2.0, "return")), minimum=0.0, maximum=2.0,
                           default=0.0, is_integer=True)  # fmt: skip
AIDS = ParameterMetadata(bits=((0, "GPS"), (2, "vision position")), is_integer=True)


@pytest.mark.parametrize(
    ("metadata", "value", "shown"),
    [
        (ACTION, 2.0, "return (2)"),
        (ACTION, 7, "7"),
        (AIDS, 5, "GPS + vision position (5)"),
        (AIDS, 9, "GPS + bit 3 (9)"),
        (AIDS, 0, "none (0)"),
        (GAIN, 1.5, "1.5"),
        (ParameterMetadata(), 3, "3"),
    ],
)
def test_values_are_shown_by_name_where_the_vehicle_has_names(metadata, value, shown):
    assert metadata.shown(value) == shown


@pytest.mark.parametrize(
    ("metadata", "text", "value"),
    [
        (ACTION, "return", 2.0),
        (ACTION, "GO_ON", 0.0),
        (ACTION, "1", 1.0),
        (AIDS, "vision-position, gps", 5.0),
        (AIDS, "gps+gps", 1.0),
        (AIDS, "none", 0.0),
        (GAIN, "1e-1", 0.1),
    ],
)
def test_a_text_means_a_number_or_a_name(metadata, text, value):
    assert metadata.value_of(text) == value


@pytest.mark.parametrize(
    ("metadata", "text", "words"),
    [
        (ACTION, "land", "'land' is not a number, nor one of: go on, Hold, return"),
        (AIDS, "gps, baro", "'gps, baro' is not a number, nor one of: GPS, vision position"),
        (GAIN, "much", "'much' is not a number"),
        (GAIN, "inf", "inf is not a number"),
    ],
)
def test_any_other_text_is_refused_with_the_names_there_are(metadata, text, words):
    with pytest.raises(ValueError, match=f"^{words}$"):
        metadata.value_of(text)


def test_only_an_enumeration_with_a_name_for_both_ends_is_a_closed_list():
    assert ACTION.is_listed
    assert not ACTION._replace(maximum=18.0).is_listed  # "0 unassigned", and a range beside it
    assert not GAIN.is_listed


S = snapshot_with(EMPTY_SNAPSHOT, identity={"source": (1, 1)}, parameters={
    "values": {"GAIN": 1.5, "ACTION": 2, "ODD[red]": 2.0}, "total": 3,
    "metadata": {
        "GAIN": ParameterMetadata(
            text="Position gain", unit="N/m", minimum=0.1, maximum=3.0, default=1.2, long_text="Not too much."
        ),
        "ACTION": ParameterMetadata(
            text="Link lost", default=2.0, minimum=0.0, maximum=2.0, is_integer=True, needs_reboot=True,
            values=((0.0, "go on"), (2.0, "land")),
        ),
    },
})  # fmt: skip


@pytest.mark.parametrize(
    ("wanted", "names"),
    [
        (ParameterFilter(), ("ACTION", "GAIN", "ODD[red]")),
        (ParameterFilter(text="gain POSI"), ("GAIN",)),
        (ParameterFilter(text="go on"), ("ACTION",)),  # a name of a value
        (ParameterFilter(text="nothing"), ()),
        (ParameterFilter(only_changed=True), ("GAIN",)),
        (ParameterFilter(favourites={"ODD[red]", "GONE"}), ("ODD[red]", "ACTION", "GAIN")),
        (ParameterFilter(favourites={"ODD[red]"}, only_favourites=True), ("ODD[red]",)),
    ],
)
def test_a_filter_lets_through_what_has_all_of_it(wanted, names):
    assert matching_names(S, wanted) == names


def test_a_name_with_the_text_comes_before_descriptions_and_favourites_with_it():
    s = snapshot_with(EMPTY_SNAPSHOT, parameters={
        "values": {"AIR": 1.0, "LINK": 1.0, "SYS_WIND": 1.0},
        "metadata": {"AIR": ParameterMetadata(text="Wind known"), "LINK": ParameterMetadata(text="of the wind")},
    })  # fmt: skip
    assert matching_names(s, ParameterFilter(text="wind", favourites={"LINK"})) == ("SYS_WIND", "LINK", "AIR")


def test_differences_are_those_that_a_float_on_the_wire_can_tell():
    other = {"GAIN": 1.5 * (1 + 1e-8), "ACTION": 0.0, "GONE": 1.0}
    assert differences(S, other) == (Difference("ACTION", 2, 0.0), Difference("GONE", None, 1.0))
    assert default_differences(S) == (Difference("GAIN", 1.5, 1.2),)


def test_the_details_tell_all_that_is_known():
    assert parameter_details(S, "GAIN") == [
        "GAIN: Position gain", "value 1.5 N/m, default 1.2 N/m, range 0.1..3 N/m", "Not too much.",
    ]  # fmt: skip
    assert parameter_details(S, "ACTION")[1:] == [
        "value land (2), default land (2), takes effect after a reboot", "0 go on, 2 land",
    ]  # fmt: skip
    changed = snapshot_with(S, parameters={"changes": {"GAIN": ParameterChange(9.0, ChangeState.REFUSED, "too much")}})
    assert "9: refused: too much" in parameter_details(changed, "GAIN")
    assert list(refused_changes(changed.parameters.changes)) == ["GAIN"]
    assert parameter_details(S, "ODD[red]") == ["ODD[red]: the vehicle has no description of it", "value 2"]


def test_the_counts_say_what_is_missing():
    assert parameter_counts(EMPTY_SNAPSHOT, 0) == "no vehicle has been heard yet"
    assert parameter_counts(snapshot_with(S, parameters={"values": {}}), 0) == "no parameters received yet"
    assert parameter_counts(snapshot_with(S, parameters={"total": 5}), 3) == "3 of 5 parameters received"
    assert parameter_counts(S, 2) == "2 of 3 parameters shown, 1 changed from default (*)"
