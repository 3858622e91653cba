"""A fence that is edited stays one that a file and a vehicle take; legs through obstacles are found."""

import math

import pytest

from darko_gcs.state.fence_edits import (
    CIRCLE_OUT,
    RALLY,
    STAY_IN,
    STAY_OUT,
    limit_item,
    limit_label,
    new_area,
    turned,
    with_corner,
    without,
)
from darko_gcs.state.fence_shapes import (
    blocked_legs,
    crosses,
    fence_circles,
    fence_polygons,
    is_inside,
    item_position,
    leg_dangers,
    obstacles,
)
from darko_gcs.state.map_overlay import OverlayShape
from darko_gcs.state.mission_legs import mission_legs
from protocol.frames import LocalFrame
from protocol.plans import Plan
from protocol.plans.fence_rally import fence_items, with_fence
from sitl.defaults import HOME
from tests.support.gcs.snapshots import HOVERING, snapshot_with
from tests.support.vehicle.mission_items import waypoint

LEVEL = (0.0, 0.0, 0.0)
SQUARE = ((0.0, 0.0), (0.0, 10.0), (10.0, 10.0), (10.0, 0.0))


def fenced(*areas):
    return snapshot_with(HOVERING, plans={"fence": tuple(item for area in areas for item in area)})


def area(command, north=0.0, east=0.0):
    return new_area(command, (north, east), HOME, LEVEL)


def test_a_new_polygon_is_a_square_and_a_circle_has_a_radius():
    s = fenced(area(STAY_IN, 5.0), area(CIRCLE_OUT, 0.0, 9.0))
    ((corners, state),) = fence_polygons(s)
    assert state == "fence"
    numbers = [part for corner in corners for part in corner]
    assert numbers == pytest.approx([45.0, 40.0, 45.0, -40.0, -35.0, -40.0, -35.0, 40.0], abs=0.02)
    ((north, east, radius, state),) = fence_circles(s)
    assert (north, east, radius, state) == (
        pytest.approx(0.0, abs=0.02),
        pytest.approx(9.0, abs=0.02),
        20.0,
        "keep-out",
    )


def test_corners_come_and_go_and_a_triangle_goes_as_a_whole():
    fence = (*area(STAY_OUT), *area(CIRCLE_OUT))
    corner = limit_item(STAY_IN, (30.0, 0.0), 0.0, 0.0, HOME, LEVEL)
    five = with_corner(fence, 1, corner)
    assert [item.params[0] for item in five[:5]] == [5.0] * 5
    assert {item.command for item in five[:5]} == {STAY_OUT}
    assert item_position(fenced(five), five[2]) == pytest.approx((30.0, 0.0), abs=0.02)
    assert [limit_label(five, row) for row in (2, 5)] == ["outside 3/5", "outside r 20 m"]
    three = without(without(five, 0), 3)
    assert len(three) == 3 + 1
    for edited in (five, without(five, 0), three):
        assert fence_items(with_fence(Plan(), edited)) == edited
    assert without(three, 1) == three[3:]
    assert without(five, 5) == five[:5]


def test_an_area_is_turned_as_a_whole():
    fence = (*area(STAY_OUT), *area(CIRCLE_OUT))
    assert [state for _, state in fence_polygons(fenced(turned(fence, 2)))] == ["fence"]
    assert turned(turned(fence, 2), 0) == fence
    assert turned(fence, 4)[:4] == fence[:4]


def test_a_rally_point_has_a_height_above_home():
    point = limit_item(RALLY, (30.0, -4.0), 0.0, 25.0, HOME, LEVEL)
    assert point.z == 25.0
    assert item_position(HOVERING, point) == pytest.approx((30.0, -4.0), abs=0.02)
    assert limit_label((point,), 0) == "rally point"


@pytest.mark.parametrize(
    ("start", "end", "does"),
    [
        ((-5.0, 5.0), (15.0, 5.0), True), ((-5.0, -5.0), (15.0, 15.0), True), ((5.0, 5.0), (6.0, 6.0), True),
        ((-5.0, 5.0), (5.0, 5.0), True), ((-5.0, 5.0), (-1.0, 5.0), False), ((-5.0, -5.0), (-5.0, 15.0), False),
        ((0.0, 20.0), (0.0, 30.0), False), ((20.0, 20.0), (20.0, 20.0), False), ((5.0, 5.0), (5.0, 5.0), True),
    ],
)  # fmt: skip
def test_a_leg_crosses_an_area_if_any_of_it_is_inside(start, end, does):
    assert crosses(start, end, SQUARE) is does
    assert crosses(end, start, SQUARE) is does


def test_the_bay_of_a_polygon_is_outside():
    bay = ((0.0, 0.0), (0.0, 10.0), (10.0, 10.0), (5.0, 5.0), (10.0, 0.0))
    assert is_inside((2.0, 5.0), bay)
    assert not is_inside((8.0, 5.0), bay)


def test_legs_through_keep_outs_and_below_the_tops_of_buildings_are_blocked():
    place = LocalFrame(HOME).to_geodetic
    ring = tuple(place((n, e, 0.0)) for n, e in ((40.0, -9.0), (40.0, 9.0), (60.0, 9.0), (60.0, -9.0)))
    items = tuple(
        waypoint(north, 0.0, height) for north, height in ((0.0, 8.0), (100.0, 8.0), (100.0, 30.0), (0.0, 30.0))
    )
    s = snapshot_with(HOVERING, plans={"mission": items})
    legs = mission_legs(items, s)

    def blocked(s, *shapes):
        return [seq for seq in blocked_legs(s, legs, obstacles(s, shapes)) if seq]

    hangar = OverlayShape("Hangar", ring, is_area=True, top=12.0)
    assert blocked(s) == []
    assert blocked(s, hangar) == [1]
    assert blocked(s, hangar._replace(top=None)) == []
    assert blocked(s, hangar._replace(top=40.0)) == [1, 3]
    keep_out = s._replace(plans=s.plans._replace(fence=area(STAY_OUT, 50.0)))
    assert blocked(keep_out) == [1, 3]
    circle = s._replace(plans=s.plans._replace(fence=area(CIRCLE_OUT, 50.0, 19.0)))
    assert blocked(circle) == [1, 3]
    assert obstacles(circle, ())[0].top == math.inf


def test_legs_that_end_outside_every_area_of_the_fence_are_named():
    items = tuple(waypoint(north, 0.0, 20.0) for north in (0.0, 30.0, 100.0, 200.0))
    s = snapshot_with(HOVERING, plans={"mission": items})
    legs = mission_legs(items, s)

    def words(*areas):
        fence = tuple(item for shape in areas for item in shape)
        return leg_dangers(s._replace(plans=s.plans._replace(fence=fence)), legs, ()).words

    assert words() == []
    assert words(area(STAY_IN, 0.0)) == ["OUTSIDE: legs to 2, 3 outside the fence"]
    assert words(area(STAY_IN, 0.0), area(STAY_IN, 75.0)) == ["OUTSIDE: leg to 3 outside the fence"]
    apart = words(area(STAY_IN, 0.0), area(STAY_IN, 100.0))  # from 40 to 60 m nothing allows the way
    assert apart == ["OUTSIDE: legs to 2, 3 outside the fence"]
    assert words(area(STAY_OUT, 200.0)) == ["BLOCKED: leg to 3 through an obstacle"]
