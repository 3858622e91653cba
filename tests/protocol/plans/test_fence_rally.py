"""Fence and rally points of a plan file become mission items and return unchanged."""

import math
from dataclasses import replace

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


RETURN = {"breachReturn": [43.5, 1.4, 30], "version": 2}
OLD = {"polygon": [[43.5, 1.4], [43.6, 1.4], [43.6, 1.5]], "breachReturn": [43.55, 1.45], "version": 1}


def test_the_breach_return_point_is_an_item_and_is_saved_again():
    (point,) = fence_items(Plan(geo_fence=RETURN))
    assert (point.command, point.frame, point.x, point.y, point.z) == (5000, 3, 435000000, 14000000, 30.0)
    again = with_fence(Plan(), (*SHAPES, point))
    assert again.geo_fence["breachReturn"] == [43.5, 1.4, 30.0]
    assert fence_items(again) == (*SHAPES, point)
    assert "breachReturn" not in with_fence(again, SHAPES).geo_fence


def test_a_return_point_above_the_sea_stays_there():
    point = replace(fence_items(Plan(geo_fence=RETURN))[0], frame=0, z=180.0)
    assert fence_items(with_fence(Plan(), (point,))) == (point,)


def test_a_fence_of_the_old_form_becomes_items():
    *corners, point = fence_items(Plan(geo_fence=OLD))
    assert [(item.command, item.params[0], item.x) for item in corners] == [
        (5001, 3.0, 435000000), (5001, 3.0, 436000000), (5001, 3.0, 436000000),
    ]  # fmt: skip
    assert point.command == 5000
    assert math.isnan(point.z)
    again = with_fence(Plan(geo_fence=OLD), (*corners, point))
    assert again.geo_fence.keys() == {"circles", "polygons", "breachReturn", "version"}
    assert fence_items(again) == (*corners, point)


@pytest.mark.parametrize(
    ("fence", "said"),
    [
        ({"breachReturn": [43.5], "version": 2}, r"geoFence\.breachReturn: 1 numbers where 3 were expected"),
        ({"breachReturn": [99, 1.4, 3], "version": 2}, r"geoFence\.breachReturn: 99, 1.4, 3 is not on the globe"),
        ({"breachReturn": 5, "version": 2}, r"geoFence\.breachReturn: 5 is not a list"),
        ({"polygon": [[1, 2], [3, 4]], "version": 1}, r"geoFence\.polygon: 2 corners are too few"),
        ({"version": 3}, r"geoFence\.version: 3 is neither 1 nor 2"),
        ({"ellipses": [[1, 2]], "version": 2}, r"geoFence\.ellipses: is not known as a part of a fence"),
        ({"maxAltitude": 120, "version": 2}, r"geoFence\.maxAltitude: is not known as a part of a fence"),
    ],
)
def test_nothing_of_a_fence_is_left_out_without_a_word(fence, said):
    with pytest.raises(FileError, match=said):
        fence_items(Plan(geo_fence=fence))


def test_a_fence_has_one_return_point():
    (point,) = fence_items(Plan(geo_fence=RETURN))
    with pytest.raises(LocalProtocolError, match="one return point"):
        with_fence(Plan(), (point, point))
