"""Messages that other autopilots send in place of DarkO's fill the same fields."""

import math

import pytest
from pymavlink.dialects.v20 import all as all_dialects

from darko_gcs.feed.replay_feed import ReplayFeed
from darko_gcs.state.reduce import reduce
from darko_gcs.state.snapshot import EMPTY_SNAPSHOT
from protocol.dialect import mavlink
from protocol.tlog import TlogReader
from tests.support.logs import quadplane_log

GLOBAL_INT, RELATIVE = mavlink.MAV_FRAME_GLOBAL_INT, mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT
HOME = mavlink.MAVLink_home_position_message(
    43_5649000, 1_4810000, 150_000, 0.0, 0.0, 0.0, [1.0, 0.0, 0.0, 0.0], math.nan, math.nan, math.nan
)


def after(*messages):
    s = EMPTY_SNAPSHOT
    for message in messages:
        s = reduce(s, message, 1.0)
    return s


def target(frame=GLOBAL_INT, mask=0xFFF8, lat=43_5658983):
    return mavlink.MAVLink_position_target_global_int_message(
        100, frame, mask, lat, 1_4810000, 170.0, 0, 0, 0, 0, 0, 0, 0, 0
    )


@pytest.mark.parametrize(("direction", "wind"), [(0.0, (-4.0, 0.0)), (90.0, (0.0, -4.0)), (-90.0, (0.0, 4.0))])
def test_ardupilots_wind_comes_from_its_direction(direction, wind):
    s = after(all_dialects.MAVLink_wind_message(direction, 5.0, 3.0))
    assert s.estimates.wind == pytest.approx((*wind, 3.0))


def test_a_wind_that_is_no_number_is_ignored():
    assert after(all_dialects.MAVLink_wind_message(math.nan, 5.0, 0.0)).estimates.wind is None


def test_a_global_target_is_shown_in_the_local_frame():
    s = after(HOME, target())
    assert s.goal == pytest.approx((110.9, 0.0, -20.0), abs=0.2)
    assert after(target()).goal is None  # as long as neither home nor the vehicle's own place is known
    own = mavlink.MAVLink_position_target_local_ned_message(200, 1, 0, 1.0, 2.0, -3.0, *[0.0] * 8)
    assert after(HOME, target(), own).goal == (1.0, 2.0, -3.0)


@pytest.mark.parametrize("odd", [target(frame=RELATIVE), target(mask=0xFFFF), target(lat=2**31 - 1)])
def test_a_target_that_is_no_place_above_the_sea_takes_the_last_one_away(odd):
    assert after(HOME, target(), odd).guidance.target_place is None


def test_a_mission_of_float_items_is_a_mission():
    item = mavlink.MAVLink_mission_item_message(1, 1, 0, 3, 16, 0, 1, 0, 0, 0, 0, 43.5, 1.5, 20.0)
    (shown,) = after(item).plans.mission
    assert (shown.x, shown.y, shown.z) == (43_5000000, 1_5000000, 20.0)
    nonsense = mavlink.MAVLink_mission_item_message(1, 1, 0, 3, 16, 0, 1, 0, 0, 0, 0, 1e30, 1.5, 20.0)
    assert after(nonsense).plans.mission == ()


def test_the_power_comes_from_voltage_and_current():
    status = mavlink.MAVLink_sys_status_message(0, 0, 0, 0, 12_000, 1_500, -1, 0, 0, 0, 0, 0, 0)
    assert after(status).battery.power == pytest.approx(180.0)
    unknown = mavlink.MAVLink_sys_status_message(0, 0, 0, 0, 12_000, -1, -1, 0, 0, 0, 0, 0, 0)
    assert after(unknown).battery.power is None


def test_a_real_log_of_another_autopilot_fills_what_its_messages_allow():
    feed = ReplayFeed(TlogReader(quadplane_log()), "x")
    feed.seek(90.0)
    s = feed.snapshot
    filled = (
        s.attitude.q,
        s.position.p,
        s.position.v,
        s.estimates.airspeed,
        s.position.ground_speed,
        s.attitude.heading,
        s.estimates.wind,
        s.goal,
        s.guidance.navigation,
        s.position.geodetic,
    )
    assert all(value is not None for value in filled)
    assert any(s.actuation.servos)
    assert (s.status.mode, s.status.armed) == ("GUIDED", True)
    assert len(s.position.track) > 50
    assert len(s.plans.mission) == 5
    assert s.position.home is None
    before = s.goal
    feed.seek(120.0)
    assert feed.snapshot.goal == pytest.approx(before, abs=5.0)  # the same place all along
