"""A return of a plan is measured, named and drawn to the place where the vehicle will land."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from darko_gcs.state.mission_legs import mission_legs
from darko_gcs.state.return_goal import return_goal
from darko_gcs.tui.actions import ACTIONS
from darko_gcs.tui.map_content import return_labels
from darko_gcs.tui.screens.mission_table import item_label, return_words
from protocol.dialect import mavlink
from sitl.autopilot.mission.runner import return_pattern
from sitl.autopilot.settings import Settings
from sitl.autopilot.world import ARENAS, World, make_rally
from tests.support.gcs.snapshots import HOVERING, snapshot_with
from tests.support.vehicle.mission_items import FRAME, global_item, item, waypoint

RELATIVE = mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT
RTL = item(mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH, frame=mavlink.MAV_FRAME_MISSION)
START = item(mavlink.MAV_CMD_DO_LAND_START, frame=mavlink.MAV_FRAME_MISSION)
RALLY = (
    global_item(mavlink.MAV_CMD_NAV_RALLY_POINT, -50.0, 0.0, frame=RELATIVE, z=12.0),
    global_item(mavlink.MAV_CMD_NAV_RALLY_POINT, 60.0, 0.0, frame=RELATIVE, z=12.0),
)
PLAN = (waypoint(90.0, 0.0, 20.0), RTL)


def vehicle(items, rally=RALLY, **parameters):
    s = snapshot_with(HOVERING, plans={"mission": tuple(items), "rally": rally}, parameters={"values": parameters})
    return snapshot_with(s, position={"told_home_p": (0.0, 0.0, 0.0), "p": (90.0, 0.0, -20.0)})


def test_table_map_and_question_say_that_a_rally_point_is_nearer_than_home():
    s = vehicle(PLAN)
    leg = mission_legs(PLAN, s)[1]
    assert leg.distance == pytest.approx(30.0, abs=0.1)
    assert item_label(RTL, leg) == "to rally 1"
    assert return_words(leg) == "lands at rally 1, 30 m away"
    ((text, place, _),) = return_labels(s)
    assert (text, place) == ("1 lands", pytest.approx((60.0, 0.0), abs=0.1))
    (question,) = [action.question(s) for action in ACTIONS if action.name == "return"]
    assert question.startswith("Return to rally point 1 and land?")


def test_without_a_nearer_rally_point_it_is_home():
    s = vehicle(PLAN, RALLY[:1])
    leg = mission_legs(PLAN, s)[1]
    assert leg.distance == pytest.approx(90.0, abs=0.1)
    assert (item_label(RTL, leg), return_words(leg), return_labels(s)) == ("return home", "", [])
    (question,) = [action.question(s) for action in ACTIONS if action.name == "return"]
    assert question.startswith("Return home and land?")


def test_a_landing_of_the_mission_comes_first_unless_the_parameter_says_otherwise():
    items = (*PLAN, START, waypoint(0.0, 200.0, 15.0), item(mavlink.MAV_CMD_NAV_LAND, 0.0, 220.0))
    leg = mission_legs(items, vehicle(items))[1]
    assert item_label(RTL, leg) == "to item 2"
    assert return_words(leg) == f"flies the landing from item 2, {math.hypot(90.0, 200.0):.0f} m away"
    assert mission_legs(items, vehicle(items, RTL_TYPE=0.0))[1].goal == "rally 1"
    assert mission_legs(items, vehicle(items, RTL_TYPE=3.0))[1].goal == "rally 1"


PLACES = st.floats(-200.0, 200.0)


@given(PLACES, PLACES, st.sampled_from((0, 1, 3)), st.booleans())
def test_it_is_where_the_vehicle_leads(north, west, kind, lands):
    landing = (START, waypoint(100.0, 100.0, 15.0), item(mavlink.MAV_CMD_NAV_LAND, 120.0, 100.0))
    items = (*PLAN, *(landing if lands else ()))
    world = World(FRAME, ARENAS["open"])
    world = world._replace(rally=make_rally(RALLY, world))
    here = (north, west, 20.0)
    pattern = return_pattern(items, world, Settings(return_type=kind), here)
    end = pattern.points[0] if pattern is not None else world.safe_point(here)
    goal = return_goal(items, 1, (north, -west, -20.0), vehicle(items, RTL_TYPE=float(kind)))
    assert (goal.place[0], -goal.place[1]) == pytest.approx(end[:2], abs=0.1)
