"""A mission as a list of items that is edited, and its legs: ends, how each is flown, which follow without a stop."""

import math

import pytest

from darko_gcs.state.mission_legs import (
    asked_leg_modes,
    beginning,
    distance_to_start,
    inserted,
    leg_chains,
    low_legs,
    mission_legs,
    moved,
    removed,
    replaced,
    whole_metres,
    with_leg_mode,
)
from darko_gcs.state.reduce import reduce
from darko_gcs.state.snapshot import EMPTY_SNAPSHOT
from protocol.dialect import mavlink
from protocol.dialect.vocabulary import LegMode
from protocol.plans import MissionItem, load
from sitl.defaults import HOME
from tests.support.gcs.messages import arrived, position
from tests.support.gcs.snapshots import HOVERING, snapshot_with
from tests.support.paths import DATA
from tests.support.vehicle.mission_items import LAND, TAKE_OFF, item, waypoint

WAYPOINT, JUMP, TRANSITION = mavlink.MAV_CMD_NAV_WAYPOINT, mavlink.MAV_CMD_DO_JUMP, mavlink.MAV_CMD_DO_VTOL_TRANSITION


def point_item(x):
    return MissionItem(command=WAYPOINT, frame=1, params=(0.0, 0.0, 0.0, math.nan), x=x, y=0, z=-5.0)


def jump(to):
    return MissionItem(command=JUMP, frame=2, params=(float(to), 2.0, 0.0, 0.0), x=0, y=0, z=0.0)


def transition(state):
    return MissionItem(command=TRANSITION, frame=2, params=(float(state), 0.0, 0.0, 0.0), x=0, y=0, z=0.0)


A, B, C = point_item(1), point_item(2), point_item(3)


def test_items_are_inserted_replaced_removed_and_moved():
    assert inserted((A, B), 1, (C,)) == (A, C, B)
    assert inserted((), 0, (C,)) == (C,)
    assert replaced((A, B), 1, C) == (A, C)
    assert removed((A, B, C), 1) == (A, C)
    assert moved((A, B, C), 0, 2) == (B, C, A)
    assert moved((A, B, C), 2, 1) == (A, C, B)


@pytest.mark.parametrize(
    ("edited", "to"),
    [
        (inserted((A, B, jump(1)), 1, (C,)), 2),
        (inserted((A, B, jump(1)), 2, (C,)), 1),
        (removed((A, B, jump(1)), 0), 0),
        (removed((A, B, C, jump(1)), 1), 1),  # to the item that follows the removed one
        (moved((A, B, jump(1)), 1, 0), 0),
        (moved((A, B, jump(0)), 1, 0), 1),
    ],
)
def test_a_jump_keeps_to_its_item(edited, to):
    assert edited[-1].params == (float(to), 2.0, 0.0, 0.0)


def test_a_leg_gets_its_way_and_the_legs_after_it_keep_theirs():
    items, row = with_leg_mode((A, B, C), 1, LegMode.FORWARD)
    assert row == 2
    assert items == (A, transition(4), B, transition(0), C)
    assert asked_leg_modes(items) == (LegMode.NONE, LegMode.FORWARD, LegMode.FORWARD, LegMode.NONE, LegMode.NONE)


def test_transitions_that_change_nothing_are_taken_out():
    items, row = with_leg_mode((A, transition(4), B, transition(0), C), 2, LegMode.NONE)
    assert (items, row) == ((A, B, C), 1)
    items, row = with_leg_mode((transition(3), A, B, C), 2, LegMode.HOVER)
    assert (items, row) == ((transition(3), A, B, C), 2)


def test_a_transition_that_is_not_understood_stays():
    strange = transition(1)
    assert with_leg_mode((A, strange, B), 2, LegMode.HOVER)[0] == (A, strange, transition(3), B)


def test_jumps_lead_to_the_same_leg_after_a_way_was_chosen():
    items, _ = with_leg_mode((A, B, C, jump(2)), 1, LegMode.HOVER)
    assert items == (A, transition(3), B, transition(0), C, jump(4))


ON_GROUND = snapshot_with(EMPTY_SNAPSHOT, position={"home": HOME})
RETURN = item(mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH, frame=mavlink.MAV_FRAME_MISSION)


def speed(value):
    return item(mavlink.MAV_CMD_DO_CHANGE_SPEED, params=(0.0, value, -1.0, 0.0), frame=2)


def way(state):
    return item(mavlink.MAV_CMD_DO_VTOL_TRANSITION, params=(float(state), 0.0, 0.0, 0.0), frame=2)


def test_each_leg_has_its_length_and_its_climb():
    legs = mission_legs((TAKE_OFF, waypoint(30.0, -40.0, 10.0), LAND), ON_GROUND)
    assert [leg.seq for leg in legs] == [0, 1, 2]
    assert [leg.distance for leg in legs] == pytest.approx([0.0, 50.0, 0.0], abs=0.01)
    assert [leg.climb for leg in legs] == pytest.approx([3.0, 7.0, 0.0], abs=0.01)  # the descent is no leg


def test_degrees_and_metres_give_the_same_leg():
    items = load(DATA / "square100.plan").items
    legs = mission_legs(items, ON_GROUND)
    assert [round(leg.distance) for leg in legs] == [0, 100, 100, 100, 100, 0]


def test_legs_are_unknown_without_home():
    assert mission_legs((TAKE_OFF,), EMPTY_SNAPSHOT) == ()


def test_the_first_leg_begins_at_a_vehicle_in_the_air_but_not_on_its_way_through_a_mission():
    items = (waypoint(30.0, 0.0, 3.0),)
    hovering = snapshot_with(
        HOVERING, position={"p": (10.2, 0.3, -3.1)}, mission={"state": mavlink.MISSION_STATE_NOT_STARTED}
    )
    assert mission_legs(items, hovering)[0].start == (10.0, 0.0, -3.0)
    flown = snapshot_with(hovering, position={"p": (25.0, 0.0, -3.0)}, mission={"state": mavlink.MISSION_STATE_ACTIVE})
    assert mission_legs(items, flown)[0].start[0] == 0.0
    assert mission_legs(items, flown, beginning(hovering)) == mission_legs(items, hovering)


def test_a_hover_between_whole_metres_asks_about_one_leg():
    """So that its length does not go up and down by a metre: the vehicle hovers the shorter one."""
    near, asked = None, set()
    for north in (10.45, 10.55, 10.4, 10.6, 10.5):
        near = whole_metres((north, 0.0, -3.1), near)
        asked.add(near)
    assert asked == {(10.0, 0.0, -3.0)}
    assert whole_metres((10.8, 0.0, -3.1), near) == (11.0, 0.0, -3.0)


def test_the_whole_metres_of_a_hover_are_kept_from_message_to_message():
    s = EMPTY_SNAPSHOT
    for north in (10.45, 10.55):
        s = reduce(s, arrived(position(1000, north)), 1.0)
        assert s.position.p[0] == pytest.approx(north)
    assert s.position.near == (10.0, 0.0, -3.0)


def test_waypoints_without_a_stop_are_asked_about_together_and_a_take_off_not_at_all():
    items = (
        TAKE_OFF,
        waypoint(10.0, 0.0, 5.0),
        way(4),
        waypoint(20.0, 0.0, 5.0, hold=2.0),
        waypoint(20.0, -9.0, 5.0),
        RETURN,
    )
    chains = leg_chains(mission_legs(items, ON_GROUND))
    assert [seqs for seqs, _ in chains] == [(1, 3), (4,), (5,)]
    (_, first), (_, second), (_, home) = chains
    assert first.asked == (LegMode.NONE, LegMode.FORWARD)
    assert (first.heading, second.heading, home.heading) == pytest.approx((None, 0.0, math.pi / 2), abs=0.01)
    assert home.points[-1] == (0.0, 0.0, -5.0)


def test_a_chain_is_as_long_as_the_vehicle_looks_ahead():
    items = tuple(waypoint(10.0 * k, 0.0, 5.0) for k in range(1, 11))
    assert [len(seqs) for seqs, _ in leg_chains(mission_legs(items, ON_GROUND))] == [8, 2]


def test_a_speed_is_of_the_hover_or_of_the_cruise_and_ends_a_chain():
    items = tuple(part for value in (2.0, 15.0, -1.0) for part in (speed(value), waypoint(value, 0.0, 5.0)))
    chains = leg_chains(mission_legs(items, ON_GROUND))
    assert [(chain.hover_speed, chain.airspeed) for _, chain in chains] == [(2.0, None), (2.0, 15.0), (None, None)]


def test_in_the_air_a_take_off_is_passed_over_and_the_first_leg_begins_at_the_vehicle():
    items = (TAKE_OFF, waypoint(30.0, 0.0, 10.0))
    far = snapshot_with(
        HOVERING,
        position={"p": (330.0, 0.0, -10.0)},
        plans={"mission": items},
        mission={"state": mavlink.MISSION_STATE_NOT_STARTED},
    )
    (leg,) = mission_legs(items, far)
    assert (leg.seq, round(leg.distance)) == (1, 300)
    assert distance_to_start(snapshot_with(far, mission={"current": 0})) == pytest.approx(300.0, abs=0.1)
    assert distance_to_start(snapshot_with(far, position={"p": None})) is None
    assert distance_to_start(snapshot_with(far, plans={"mission": ()})) is None


@pytest.mark.parametrize(
    ("height", "north", "ways", "forward", "is_low"),
    [
        (3.0, 100.0, (), (), True),
        (20.0, 100.0, (), (), False),
        (3.0, 10.0, (), (), False),
        (3.0, 10.0, (), (1,), True),
        (3.0, 10.0, (4,), (), True),
        (3.0, 100.0, (3,), (), False),
    ],
)
def test_a_leg_that_is_flown_forward_near_the_ground_is_low(height, north, ways, forward, is_low):
    first = waypoint(0.0, 0.0, height)
    items = (first, *map(way, ways), waypoint(north, 0.0, height))
    last = len(items) - 1
    low = low_legs(items, ON_GROUND, [seq if not ways else last for seq in forward])
    assert (last in low) is is_low
