"""The braille canvas."""

from hypothesis import given
from hypothesis import strategies as st

from darko_gcs.tui.render.canvas import BrailleCanvas
from tests.support.gcs.screens import line_text, lines_text

any_number = st.floats(allow_nan=True, allow_infinity=True)


@given(st.lists(st.tuples(any_number, any_number), max_size=20))
def test_dots_outside_a_canvas_are_ignored(dots):
    canvas = BrailleCanvas(3, 2)
    for x, y in dots:
        canvas.plot(x, y)
        canvas.line((x, y), (1.0, 1.0))
    assert [len(line_text(line)) for line in canvas.lines()] == [3, 3]


def test_dots_are_where_they_were_plotted():
    canvas = BrailleCanvas(1, 1)
    canvas.plot(0, 0)
    canvas.plot(1, 3)
    assert lines_text(canvas.lines()) == "⢁"
