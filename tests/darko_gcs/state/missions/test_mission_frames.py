"""A mission item keeps its place when its frame changes."""

import math
from dataclasses import replace

import pytest

from darko_gcs.state.mission_items import edited_item, in_frame, item_fields, place_of, shifted
from protocol.dialect import mavlink
from protocol.frames import Geodetic
from protocol.plans import MissionItem
from protocol.units import UNKNOWN_INT32

HOME = Geodetic(43.5648, 1.4811, 150.0)
AMSL, NED, RELATIVE, ENU = 0, 1, 3, 4
BODY = mavlink.MAV_FRAME_BODY_FRD
ITEM = MissionItem(
    command=mavlink.MAV_CMD_NAV_WAYPOINT,
    frame=RELATIVE,
    params=(0.0, 0.0, 0.0, math.nan),
    x=435649000,
    y=14812000,
    z=3.0,
)


def test_degrees_become_metres_and_heights_turn_over():
    item = in_frame(ITEM, NED, HOME)
    assert item.x / 1e4 == pytest.approx(11.1, abs=0.1)  # 0.0001 deg
    assert item.y / 1e4 == pytest.approx(8.1, abs=0.1)
    assert item.z == pytest.approx(-3.0)
    east_first = in_frame(ITEM, ENU, HOME)
    assert (east_first.x, east_first.y, east_first.z) == (item.y, item.x, pytest.approx(3.0))


def test_home_may_lie_beside_the_local_origin():
    here, beside = in_frame(ITEM, NED, HOME), in_frame(ITEM, NED, HOME, (5.0, -2.0, -1.0))
    assert ((beside.x - here.x) / 1e4, (beside.y - here.y) / 1e4) == (5.0, -2.0)
    assert beside.z - here.z == pytest.approx(-1.0)


@pytest.mark.parametrize("frame", [AMSL, NED, RELATIVE, ENU, 5, 6])
def test_there_and_back_is_the_same_place(frame):
    back = in_frame(in_frame(ITEM, frame, HOME, (5.0, -2.0, -1.0)), RELATIVE, HOME, (5.0, -2.0, -1.0))
    assert abs(back.x - ITEM.x) <= 12  # a centimetre
    assert abs(back.y - ITEM.y) <= 12
    assert back.z == pytest.approx(3.0, abs=1e-3)


def test_a_height_above_home_becomes_one_above_the_sea():
    assert in_frame(ITEM, AMSL, HOME).z == 153.0
    assert math.isnan(in_frame(replace(ITEM, z=math.nan), AMSL, HOME).z)


@pytest.mark.parametrize(
    ("item", "frame", "home", "problem"),
    [
        (ITEM, NED, None, "home is not known yet"),
        (replace(ITEM, x=UNKNOWN_INT32), NED, HOME, "nothing to convert"),
        (replace(ITEM, z=math.nan), NED, HOME, "nothing to convert"),
        (ITEM, BODY, HOME, "cannot be converted to MAV_FRAME 12"),
        (replace(ITEM, frame=BODY), RELATIVE, HOME, "numbers of MAV_FRAME 12 cannot"),
    ],
)
def test_numbers_that_cannot_be_converted_are_refused(item, frame, home, problem):
    with pytest.raises(ValueError, match=problem):
        in_frame(item, frame, home)


def test_an_edit_of_the_frame_and_a_number_reads_the_number_in_the_old_frame():
    texts = [text for _, text in item_fields(ITEM)]
    texts[1], texts[-1] = str(NED), "20"
    item = edited_item(ITEM, texts, HOME)
    assert (item.frame, item.z) == (NED, pytest.approx(-20.0))


@pytest.mark.parametrize("frame", [AMSL, NED, RELATIVE, ENU])
def test_an_item_is_moved_in_its_own_frame(frame):
    item = in_frame(ITEM, frame, HOME)
    north, east, down = place_of(item, HOME)
    there = shifted(item, (3.0, -4.0, 2.0), HOME)
    assert there.frame == frame
    assert place_of(there, HOME) == pytest.approx((north + 3.0, east - 4.0, down - 2.0), abs=0.02)


def test_a_level_move_leaves_the_height_as_it_is_to_the_last_bit():
    item = replace(ITEM, z=0.1)
    assert shifted(item, (1.0, 0.0, 0.0), HOME).z == item.z


@pytest.mark.parametrize(
    "item",
    [
        replace(ITEM, frame=mavlink.MAV_FRAME_MISSION),
        replace(ITEM, x=UNKNOWN_INT32),
        replace(ITEM, x=0, y=0),
        replace(ITEM, z=math.nan),
        replace(ITEM, frame=BODY),
    ],
)
def test_an_item_without_a_place_of_its_own_cannot_be_moved(item):
    assert place_of(item, HOME) is None
    with pytest.raises(ValueError, match="no place of its own"):
        shifted(item, (1.0, 0.0, 0.0), HOME)
