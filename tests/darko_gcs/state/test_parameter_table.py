"""Parameters as they are looked through: filters, differences, details."""

from dataclasses import replace

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

S = replace(
    EMPTY_SNAPSHOT,
    source=(1, 1), parameters={"GAIN": 1.5, "ACTION": 2, "ODD[red]": 2.0}, parameter_count=3,
    parameter_metadata={
        "GAIN": ParameterMetadata(
            text="Position gain", unit="N/m", minimum=0.1, maximum=3.0, default=1.2, long_text="Not too much."
        ),
        "ACTION": ParameterMetadata(
            text="Link lost", default=2.0, minimum=0.0, maximum=2.0, is_integer=True, needs_reboot=True,
            values=((0.0, "go on"), (2.0, "land")),
        ),
    },
)  # fmt: skip


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
    changed = replace(S, parameter_changes={"GAIN": ParameterChange(9.0, ChangeState.REFUSED, "too much")})
    assert "9: refused: too much" in parameter_details(changed, "GAIN")
    assert list(refused_changes(changed.parameter_changes)) == ["GAIN"]
    assert parameter_details(S, "ODD[red]") == ["ODD[red]: the vehicle has no description of it", "value 2"]


def test_the_counts_say_what_is_missing():
    assert parameter_counts(EMPTY_SNAPSHOT, 0) == "no vehicle has been heard yet"
    assert parameter_counts(replace(S, parameters={}), 0) == "no parameters received yet"
    assert parameter_counts(replace(S, parameter_count=5), 3) == "3 of 5 parameters received"
    assert parameter_counts(S, 2) == "2 of 3 parameters shown, 1 changed from default (*)"
