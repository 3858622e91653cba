"""The speed that is asked for, and who asked."""

from dataclasses import replace

import pytest

from darko_gcs.state.mission_legs import inserted
from darko_gcs.state.reduce_events import reduce_event
from darko_gcs.state.speed_in_force import asked_speed, speed_in_force, speed_words
from protocol.dialect import mavlink
from protocol.events import CommandDone
from tests.support.gcs.snapshots import FORWARD, HOVERING, snapshot_with

AIR, GROUND = mavlink.SPEED_TYPE_AIRSPEED, mavlink.SPEED_TYPE_GROUNDSPEED
SPEED, GO_TO = mavlink.MAV_CMD_DO_CHANGE_SPEED, mavlink.MAV_CMD_DO_REPOSITION
HOLDING = snapshot_with(HOVERING, mission={"state": mavlink.MISSION_STATE_NOT_STARTED})


def answered(s, command, result=mavlink.MAV_RESULT_ACCEPTED):
    return reduce_event(s, CommandDone(request=1, command=command, result=result, reason=""), 1.0)


def words(s):
    speed = speed_in_force(s)
    return "" if speed is None else speed_words(speed)


def test_a_commanded_speed_holds_once_it_is_accepted_until_another_flight():
    asked = asked_speed(HOLDING, GROUND, 2.5)
    assert words(asked) == ""
    assert words(answered(asked, SPEED, mavlink.MAV_RESULT_DENIED)) == ""
    flying = answered(asked, SPEED)
    assert words(flying) == "2.5 m/s over ground, command"
    assert words(answered(flying, GO_TO)) == ""
    assert words(snapshot_with(flying, status={"mode": "LAND"})) == ""
    assert words(answered(asked_speed(flying, GROUND, -2.0), SPEED)) == ""


def test_a_speed_of_the_hover_is_not_that_of_the_cruise():
    cruising = snapshot_with(FORWARD, mission={"state": mavlink.MISSION_STATE_NOT_STARTED})
    assert words(answered(asked_speed(cruising, AIR, 2.5), SPEED)) == ""
    assert words(answered(asked_speed(cruising, AIR, 15.0), SPEED)) == "15 m/s, command"


def speed_item(speed):
    item = replace(HOVERING.plans.mission[0], command=SPEED, frame=mavlink.MAV_FRAME_MISSION)
    return replace(item, params=(float(GROUND), speed, -1.0, 0.0), x=0, y=0, z=0.0)


@pytest.mark.parametrize(("current", "told"), [(1, ""), (2, "2 m/s over ground, item 1")])
def test_an_item_of_the_mission_holds_from_where_it_stands(current, told):
    items = inserted(HOVERING.plans.mission, 1, (speed_item(2.0),))
    assert words(snapshot_with(HOVERING, plans={"mission": items}, mission={"current": current})) == told


def test_without_any_the_vehicles_own_holds_where_it_is_known():
    s = snapshot_with(HOLDING, parameters={"values": {"DRK_HOV_VMAX": 5.0, "DRK_FWD_SPEED": 15.0}})
    assert words(s) == "5 m/s over ground, DRK_HOV_VMAX"
