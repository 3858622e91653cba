"""The station warns of whatever the vehicle would deny for its fence, circles and parameters with it."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from darko_gcs.state.fence_shapes import leg_dangers
from darko_gcs.state.mission_legs import mission_legs
from protocol.dialect import mavlink
from sitl.autopilot.mission.items import refuse_items
from sitl.autopilot.world import ARENAS, World, make_fence
from tests.support.gcs.snapshots import HOVERING, snapshot_with
from tests.support.vehicle.mission_items import FRAME, NAN, global_item, item, polygon, waypoint

TURNS, TO_ALT = mavlink.MAV_CMD_NAV_LOITER_TURNS, mavlink.MAV_CMD_NAV_LOITER_TO_ALT
DISC, HOLE = 5003, 5004
WORLD = World(FRAME, ARENAS["open"])
DEFAULT_RADIUS = 40.0
RELATIVE = mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT


def turns(north, west, radius, command=TURNS):
    params = (1.0, 0.0, radius, 0.0) if command == TURNS else (0.0, radius, 0.0, 0.0)
    return item(command, north, west, 20.0, params)


def dangers(items, fence=(), **limits):
    values = {"NAV_LOITER_RAD": DEFAULT_RADIUS, **limits}
    s = snapshot_with(HOVERING, plans={"mission": items, "fence": tuple(fence)}, parameters={"values": values})
    s = snapshot_with(s, position={"told_home_p": (0.0, 0.0, 0.0), "p": (0.0, 0.0, -20.0)})
    return leg_dangers(s, mission_legs(tuple(items), s), ())


def test_a_circle_partly_outside_is_named_by_its_item():
    fence = polygon(((-23.0, -150.0), (-23.0, 150.0), (150.0, 150.0), (150.0, -150.0)))
    inside, across = turns(40.0, -100.0, 30.0), turns(0.0, -100.0, 30.0)
    assert dangers((waypoint(0.0, 0.0, 20.0), inside), fence).words == []
    found = dangers((waypoint(0.0, 0.0, 20.0), inside, across), fence)
    assert found.words == ["OUTSIDE: circle of 2 outside the fence"]
    assert found.warned == (2,)
    both = dangers((waypoint(-40.0, 0.0, 20.0), across), fence)
    assert both.words == ["OUTSIDE: leg to 0 and circle of 1 outside the fence"]


@pytest.mark.parametrize("command", [TURNS, TO_ALT])
def test_a_circle_without_a_radius_has_that_of_the_vehicle(command):
    fence = polygon()
    assert dangers((turns(5.0, 0.0, NAN, command),), fence).words == []
    assert dangers((turns(15.0, 0.0, NAN, command),), fence).words == ["OUTSIDE: circle of 0 outside the fence"]


def test_a_circle_through_an_area_to_stay_out_of_is_blocked():
    hole = [global_item(HOLE, 60.0, 0.0, 5.0)]
    assert dangers((turns(30.0, 0.0, 30.0),), hole).words == ["BLOCKED: circle of 0 through an obstacle"]
    assert dangers((turns(20.0, 0.0, 30.0),), hole).words == []


def test_a_leg_that_leaves_the_fence_on_its_way_is_outside():
    horseshoe = polygon(((-10, -60), (80, -60), (80, -20), (10, -20), (10, 20), (80, 20), (80, 60), (-10, 60)))
    arms = (waypoint(0.0, 40.0, 20.0), waypoint(60.0, 40.0, 20.0), waypoint(60.0, -40.0, 20.0))
    assert dangers(arms, horseshoe).words == ["OUTSIDE: leg to 2 outside the fence"]
    discs = [global_item(DISC, 0.0, 0.0, 30.0), global_item(DISC, 80.0, 0.0, 30.0)]
    assert dangers((waypoint(0.0, 0.0, 20.0), waypoint(80.0, 0.0, 20.0)), discs).outside == (1,)
    discs.append(global_item(DISC, 40.0, 0.0, 15.0))
    assert dangers((waypoint(0.0, 0.0, 20.0), waypoint(80.0, 0.0, 20.0)), discs).words == []


def test_the_parameters_of_the_fence_count_and_are_named():
    far = (waypoint(90.0, 0.0, 20.0), turns(70.0, 0.0, 40.0), waypoint(10.0, 0.0, 60.0))
    assert dangers(far).words == []
    found = dangers(far, GF_MAX_HOR_DIST=100.0, GF_MAX_VER_DIST=50.0)
    limits = "(GF_MAX_HOR_DIST 100 m, GF_MAX_VER_DIST 50 m)"
    assert found.words == [f"OUTSIDE: leg to 2 and circle of 1 outside the fence {limits}"]


PLACES = st.floats(-120.0, 120.0).map(lambda number: round(number, 1))
RADII = st.sampled_from((15.0, 33.3, -60.0, NAN, 0.0))
ITEMS = st.one_of(
    st.builds(waypoint, PLACES, PLACES, st.sampled_from((15.0, 45.0))),
    st.builds(turns, PLACES, PLACES, RADII, st.sampled_from((TURNS, TO_ALT))),
)
AREAS = st.sampled_from(
    (
        polygon(),
        polygon(((-100, -90), (100, -100), (20, 0), (90, 100))),
        [global_item(DISC, 10.0, -20.0, 70.0)],
        [*polygon(), global_item(DISC, 60.0, 60.0, 40.0)],
        [global_item(HOLE, 40.0, 40.0, 30.0)],
        [],
    )
)


@given(st.lists(ITEMS, min_size=1, max_size=4), AREAS, st.sampled_from((0.0, 90.0)), st.sampled_from((0.0, 30.0)))
def test_there_is_a_warning_of_every_mission_that_the_vehicle_denies(items, fence, distance, height):
    made = make_fence(fence, WORLD)._replace(max_distance=distance, max_height=height)
    denied = refuse_items(items, WORLD._replace(fence=made), DEFAULT_RADIUS)
    found = dangers(tuple(items), fence, GF_MAX_HOR_DIST=distance, GF_MAX_VER_DIST=height)
    if denied is not None:
        seq = next(int(word.rstrip(":")) for word in denied.split("item ")[1].split()[:1])
        assert seq in found.warned, denied
    elif fence and fence[0].command != HOLE:
        assert not found.outside_circles
