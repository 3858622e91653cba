"""Fence and rally points as shapes on the map."""

from dataclasses import replace

import pytest

from darko_gcs.state.fence_shapes import fence_circles, fence_polygons, rally_points
from darko_gcs.tui.map_panel import MapPanel
from protocol.plans import load
from protocol.plans.fence_rally import fence_items, rally_items
from tests.support.gcs.limited_plan import write_limited_plan
from tests.support.gcs.snapshots import HOVERING, snapshot_with


@pytest.fixture
def limited(tmp_path):
    """A vehicle with a fence and rally points."""
    plan = load(write_limited_plan(tmp_path))
    return snapshot_with(HOVERING, plans={"fence": fence_items(plan), "rally": rally_items(plan)})


def test_the_shapes_lie_where_the_plan_puts_them(limited):
    ((corners, state),) = fence_polygons(limited)
    assert state == "fence"
    assert corners[0] == pytest.approx((30.0, -30.0), abs=0.1)
    assert fence_circles(limited) == [(pytest.approx(15.0, abs=0.1), pytest.approx(15.0, abs=0.1), 5.0, "keep-out")]
    assert rally_points(limited) == [pytest.approx((-5.0, -5.0), abs=0.1), pytest.approx((5.0, -5.0), abs=0.1)]


def test_the_map_shows_fence_and_rally_points(limited):
    drawn = [segment for line in MapPanel("Map", id="map").draw(limited, 60, 30) for segment in line]
    assert sum(len(text) for text, style in drawn if style == "fence") > 60
    assert any(style == "mark" for _, style in drawn)
    assert "R" in "".join(text for text, _ in drawn)


@pytest.mark.parametrize("count", [3.0, float("nan"), -1.0, 1e30])
def test_an_incomplete_polygon_is_not_drawn(limited, count):
    corner = replace(limited.plans.fence[0], params=(count, 0.0, 0.0, 0.0))
    assert fence_polygons(snapshot_with(limited, plans={"fence": (corner, corner)})) == []
