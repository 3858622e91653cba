"""Bars in eighths of a cell."""

import math

from hypothesis import given, settings
from hypothesis import strategies as st

from darko_gcs.tui.render.horizon import bar
from tests.support.gcs.screens import line_text, styled_text

any_number = st.floats(allow_nan=True, allow_infinity=True)


@settings(deadline=None, max_examples=60)
@given(st.one_of(st.none(), any_number), st.integers(1, 120), st.booleans(), st.one_of(st.none(), any_number))
def test_a_bar_has_the_width_asked_for(value, width, saturated, command):
    line = bar(value, -1.0, 1.0, width=width, command=command, saturated=saturated, centre=0.0)
    assert len(line_text(line)) == width


def test_a_bar_is_filled_from_its_beginning_or_its_centre():
    assert line_text(bar(0.5, 0.0, 1.0, width=8)) == "████    "
    assert line_text(bar(0.25, 0.0, 1.0, width=2)) == "▌ "
    assert line_text(bar(1.0, -1.0, 1.0, width=8, centre=0.0)) == "    ████"
    assert line_text(bar(-1.0, -1.0, 1.0, width=8, centre=0.0)) == "████    "
    assert line_text(bar(math.nan, 0.0, 1.0, width=4)) == "----"


def test_a_bar_shows_saturation_and_the_command():
    assert styled_text([bar(1.0, 0.0, 1.0, width=8, saturated=True)], "bad") == "████████"
    assert line_text(bar(0.0, 0.0, 1.0, width=8, command=0.5))[4] == "│"
