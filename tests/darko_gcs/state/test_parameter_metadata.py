"""Values that a parameter can have."""

import pytest

from darko_gcs.state.parameters import ParameterMetadata

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
