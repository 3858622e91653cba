"""Edits of a mission's list of items."""

import math

import pytest

from darko_gcs.state.mission_legs import asked_leg_modes, inserted, moved, removed, replaced, with_leg_mode
from protocol.dialect import mavlink
from protocol.dialect.vocabulary import LegMode
from protocol.plans import MissionItem

WAYPOINT, JUMP, TRANSITION = mavlink.MAV_CMD_NAV_WAYPOINT, mavlink.MAV_CMD_DO_JUMP, mavlink.MAV_CMD_DO_VTOL_TRANSITION


def waypoint(x):
    return MissionItem(command=WAYPOINT, frame=1, params=(0.0, 0.0, 0.0, math.nan), x=x, y=0, z=-5.0)


def jump(to):
    return MissionItem(command=JUMP, frame=2, params=(float(to), 2.0, 0.0, 0.0), x=0, y=0, z=0.0)


def transition(state):
    return MissionItem(command=TRANSITION, frame=2, params=(float(state), 0.0, 0.0, 0.0), x=0, y=0, z=0.0)


A, B, C = waypoint(1), waypoint(2), waypoint(3)


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
