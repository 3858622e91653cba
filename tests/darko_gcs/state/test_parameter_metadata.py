"""Which values a parameter can have."""

import pytest

from darko_gcs.state.parameter_metadata import ParameterMetadata

GAIN = ParameterMetadata(text="Position gain", unit="N/m", minimum=0.1, maximum=3.0, default=1.2)
SWITCH = ParameterMetadata(text="Integral in the linear law", minimum=0.0, maximum=1.0, default=1.0, is_integer=True)


@pytest.mark.parametrize(
    ("metadata", "value", "problem"),
    [
        (GAIN, 3.0, None),
        (GAIN, 3.1, "3.1 is not within 0.1..3 N/m"),
        (SWITCH, 0.5, "0.5 is not a whole number"),
        (ParameterMetadata(minimum=1.0), 0.0, "0 is not within 1.."),
        (ParameterMetadata(), 1e30, None),
    ],
)
def test_a_value_out_of_range_has_a_problem(metadata, value, problem):
    assert metadata.problem_with(value) == problem
