"""Fence and rally points of a plan file become mission items and return unchanged."""

import pytest

from protocol.errors import FileError, LocalProtocolError
from protocol.plans import Plan, load, save
from protocol.plans.fence_rally import fence_items, rally_items, with_fence, with_rally
from tests.support.vehicle.fence_shapes import POINTS, SHAPES


def test_fence_and_rally_points_survive_a_plan_file(tmp_path):
    path = tmp_path / "x.plan"
    save(with_rally(with_fence(Plan(), SHAPES), POINTS), path)
    back = load(path)
    assert fence_items(back) == SHAPES
    assert rally_items(back) == POINTS


def test_a_fence_written_by_qgroundcontrol_becomes_items():
    fence = {
        "circles": [{"circle": {"center": [43.5, 1.4], "radius": 20}, "inclusion": False, "version": 1}],
        "polygons": [{"polygon": [[43.5, 1.4], [43.6, 1.4], [43.6, 1.5]], "inclusion": True, "version": 1}],
        "version": 2,
    }
    items = fence_items(Plan(geo_fence=fence, rally_points={"points": [[43.5, 1.4, 30]], "version": 2}))
    assert [(item.command, item.params[0], item.frame) for item in items] == [(5001, 3.0, 0)] * 3 + [(5004, 20.0, 0)]


@pytest.mark.parametrize(
    ("fence", "said"),
    [
        ({"polygons": [{"polygon": [[1, 2], [3, 4]]}]}, r"geoFence\.polygons\[0\]\.polygon: 2 corners"),
        ({"polygons": [{"polygon": [[1, 2], [3, 4], [95, 4]]}]}, r"polygon\[2\]: 95, 4, 0 is not on the globe"),
        ({"polygons": [{"polygon": [[1, 2], [3, "x"], [5, 4]]}]}, r"polygon\[1\]: \"x\" is not a number"),
        ({"circles": [{"circle": {"center": [1, 2], "radius": -5}}]}, r"circles\[0\]\.circle\.radius: -5 m"),
        ({"circles": [{"circle": {"center": [1, 2], "radius": 5}, "frame": 1}]}, "frame: 1 is not a global MAV_FRAME"),
        ({"circles": 3}, r"circles: 3 is not a list"),
    ],
)
def test_an_invalid_fence_is_refused_with_its_place_and_value(fence, said):
    with pytest.raises(FileError, match=said):
        fence_items(Plan(geo_fence=fence))


def test_an_incomplete_polygon_is_not_written():
    with pytest.raises(LocalProtocolError, match="does not begin a polygon"):
        with_fence(Plan(), SHAPES[:2])
    with pytest.raises(LocalProtocolError, match="ends before its last"):
        with_fence(Plan(), (*SHAPES[:2], SHAPES[3]))
