"""Fences from plan items: what they allow, and that invalid ones are refused with a reason."""

import math

import pytest

from protocol.dialect import mavlink
from protocol.plans.mission_item import MissionItem
from sitl.autopilot.world import ARENAS, World, make_fence
from sitl.defaults import HOME
from tests.support.vehicle.mission_items import FRAME, SQUARE, global_item, polygon

INSIDE, OUTSIDE, DISC, HOLE = 5001, 5002, 5003, 5004  # MAV_CMD_NAV_FENCE_...
RETURN = mavlink.MAV_CMD_NAV_FENCE_RETURN_POINT
WORLD = World(FRAME, ARENAS["open"], home=(3.0, 0.0, 1.0))
BEYOND_THE_POLE = MissionItem(command=DISC, frame=0, params=(9.0, 0, 0, 0), x=910_000_000, y=0, z=0.0)


@pytest.mark.parametrize(
    ("items", "p", "inside"),
    [
        (polygon(), (0.0, 0.0, 5.0), True),
        (polygon(), (49.0, -49.0, 5.0), True),
        (polygon(), (51.0, 0.0, 5.0), False),
        (polygon(command=OUTSIDE), (0.0, 0.0, 5.0), False),
        (polygon(command=OUTSIDE), (0.0, 51.0, 5.0), True),
        ([global_item(DISC, 0.0, 0.0, 30.0)], (20.0, 20.0, 5.0), True),
        ([global_item(DISC, 0.0, 0.0, 30.0)], (22.0, 22.0, 5.0), False),
        ([global_item(HOLE, 40.0, 0.0, 30.0)], (11.0, 0.0, 5.0), False),
        ([*polygon(), global_item(DISC, 80.0, 0.0, 40.0)], (100.0, 0.0, 5.0), True),  # in one of two is enough
        ([*polygon(), global_item(HOLE, 0.0, 0.0, 10.0)], (0.0, 5.0, 5.0), False),
        (polygon(((0, 0), (50, 50), (20, 0), (50, -50))), (40.0, 0.0, 5.0), False),  # a notch
    ],
)
def test_a_point_is_allowed_in_one_inclusion_zone_and_no_exclusion_zone(items, p, inside):
    fence = make_fence(items, WORLD)
    assert (fence.breach([p]) is None) is inside


@pytest.mark.parametrize(
    ("items", "result", "reason"),
    [
        (polygon()[:3], 6, "4 corners"),
        ([*polygon()[:3], global_item(OUTSIDE, 0.0, 0.0, 4.0)], 13, "corner 4 of 4"),
        (polygon(SQUARE[:2]), 6, "param1 is 2, not a whole number from 3 to 1000 (number of corners)"),
        ([global_item(INSIDE, 0.0, 0.0, math.nan)], 6, "param1 is nan, not a whole number"),
        ([global_item(DISC, 0.0, 0.0, -3.0)], 6, "param1 is -3, not a number from 0.01 to 100000 m (radius)"),
        ([global_item(DISC, 0.0, 0.0, math.nan)], 6, "param1 is nan, not a number from 0.01 to 100000 m (radius)"),
        ([global_item(DISC, 0.0, 0.0, 9.0, frame=mavlink.MAV_FRAME_LOCAL_NED)], 2, "frame 1"),
        ([global_item(4999, 0.0, 0.0)], 3, "command 4999 is not supported"),
        ([*polygon(), global_item(RETURN, 60.0, 0.0)], 5, "item 4: the return point is wrong: outside the fence"),
        ([global_item(RETURN, 0.0, 0.0)] * 2, 13, "item 1: a second return point beside item 0"),
        ([global_item(RETURN, 0.0, 0.0, z=math.inf)], 12, "item 0: param7 is inf"),
        ([global_item(RETURN, 0.0, 0.0, frame=mavlink.MAV_FRAME_LOCAL_NED)], 2, "frame 1"),
        ([BEYOND_THE_POLE], 10, "param5 is 91, not a number from -90 to 90 deg (latitude)"),
    ],
)
def test_an_invalid_fence_is_refused_with_its_result_and_a_reason(items, result, reason):
    refusal = make_fence(items, WORLD)
    assert refusal.result == result
    assert reason in refusal.text


@pytest.mark.parametrize(
    ("frame", "z", "up"), [(3, 20.0, 21.0), (0, HOME.alt + 20.0, 20.0), (3, math.nan, 1.0)], ids=["home", "sea", "open"]
)
def test_the_return_point_is_where_its_frame_says(frame, z, up):
    fence = make_fence([global_item(RETURN, 10.0, -5.0, frame=frame, z=z), *polygon()], WORLD)
    assert fence.return_point == pytest.approx((10.0, -5.0, up), abs=0.02)
    assert fence.breach([(0.0, 0.0, 5.0)]) is None
