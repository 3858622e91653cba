"""Cautions before what is sent to a vehicle in the air: fence, low legs, heights of new waypoints."""

from dataclasses import replace

from darko_gcs.state.alerts import _failsafe
from darko_gcs.state.fence_edits import CIRCLE_IN, CIRCLE_OUT, STAY_IN, new_area
from darko_gcs.state.fence_shapes import fence_breaches
from darko_gcs.state.message_log import add_line
from darko_gcs.tui.actions import start_question
from darko_gcs.tui.screens.mission_editing import _here
from protocol.dialect import mavlink
from sitl.defaults import HOME
from tests.support.gcs.snapshots import HOVERING, snapshot_with

ORIGIN = (0.0, 0.0, 0.0)


def fenced(command, middle):
    s = snapshot_with(HOVERING, position={"p": (100.0, 0.0, -20.0)})
    return fence_breaches(snapshot_with(s, plans={"fence": new_area(command, middle, HOME, ORIGIN)}))


def test_vehicle_and_home_are_looked_for_in_areas_to_stay_out_of_and_outside_the_others():
    assert fenced(CIRCLE_OUT, (100.0, 5.0)) == ["THE VEHICLE IS IN AN AREA TO STAY OUT OF"]
    assert fenced(CIRCLE_OUT, (0.0, 5.0)) == ["HOME IS IN AN AREA TO STAY OUT OF"]
    assert fenced(STAY_IN, (0.0, 0.0)) == ["THE VEHICLE IS OUTSIDE THE FENCE"]
    assert fenced(CIRCLE_IN, (100.0, 0.0)) == ["HOME IS OUTSIDE THE FENCE"]
    assert fenced(CIRCLE_OUT, (50.0, 50.0)) == []


def test_the_alert_of_a_critical_state_tells_the_last_critical_text():
    s = snapshot_with(HOVERING, status={"critical": True}, hybrid={"state": None})
    s = add_line(s, 1.0, mavlink.MAV_SEVERITY_CRITICAL, "Still 3 m from the keep-out area")
    s = add_line(s, 2.0, mavlink.MAV_SEVERITY_ALERT, "Alert: battery low")
    s = add_line(s, 3.0, mavlink.MAV_SEVERITY_INFO, "Hold")
    assert _failsafe(s).endswith("critical state (Still 3 m from the keep-out area)")


def climbing(target, **operator):
    state = {"landed_state": mavlink.MAV_LANDED_STATE_TAKEOFF}
    place = {"p": (0.0, 0.0, -4.0), "geodetic": HOME}
    return snapshot_with(HOVERING, status=state, position=place, guidance={"target": target}, operator=operator)


def test_a_waypoint_put_in_during_a_climb_is_as_high_as_the_climb_ends():
    assert _here(climbing(None, take_off_height=25.0))[2] == 25.0
    assert _here(climbing((0.0, 0.0, -18.0)))[2] == 18.0
    assert _here(climbing((0.0, 0.0, 0.0)))[2] == 3.0
    assert _here(climbing(None))[2] == 4.0


def test_the_question_before_the_mission_tells_of_low_legs():
    s = snapshot_with(HOVERING, mission={"state": mavlink.MISSION_STATE_NOT_STARTED, "current": 0})
    far = tuple(replace(item, x=item.x + 9000 * k) if item.x else item for k, item in enumerate(s.plans.mission))
    assert "LOW: leg" in start_question(snapshot_with(s, plans={"mission": far}), (), 1000.0)
    assert "LOW: leg" not in start_question(snapshot_with(s, plans={"mission": far}), (), 0.0)
