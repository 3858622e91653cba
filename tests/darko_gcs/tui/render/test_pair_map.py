"""Two vehicles on one map."""

import math

from darko_gcs.tui.render.map_drawing import MapFlight, draw_pair_map


def text(flights, width=40, height=10):
    return ["".join(segment for segment, _ in line) for line in draw_pair_map(flights, width, height)]


def test_each_vehicle_is_an_arrow_with_its_letter_where_it_is():
    a = MapFlight("A", "hover", [(0.0, 0.0), (0.0, 50.0)], (0.0, 50.0, math.radians(90.0)))
    b = MapFlight("B", "forward", [(0.0, 0.0), (30.0, 0.0)], (30.0, 0.0, 0.0))
    rows = text([a, b])
    (row_a,) = (number for number, row in enumerate(rows) if "→A" in row)
    (row_b,) = (number for number, row in enumerate(rows) if "↑B" in row)
    assert row_b < row_a
    assert rows[row_b].index("↑B") < rows[row_a].index("→A")
    assert "m a row" in rows[-1]


def test_places_that_are_no_numbers_are_left_out():
    a = MapFlight("A", "hover", [(math.nan, 0.0), (0.0, 0.0)], (math.inf, 0.0, 0.0))
    rows = text([a, MapFlight("B", "forward", [], None)])
    assert not any("A" in row or "B" in row for row in rows)
