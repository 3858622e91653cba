"""QGroundControl's buttons for a PX4, as its public sources send them (PX4FirmwarePlugin)."""

import math

import pytest

from protocol.dialect import mavlink
from protocol.modes import Mode, custom_mode
from protocol.plans.mission import MissionItem
from sitl.autopilot.flight import ARM_WITHIN
from tests.support.station import HOME, NAN, Sky

ACCEPTED = mavlink.MAV_RESULT_ACCEPTED
ARM, TAKE_OFF = mavlink.MAV_CMD_COMPONENT_ARM_DISARM, mavlink.MAV_CMD_NAV_TAKEOFF
REPOSITION = mavlink.MAV_CMD_DO_REPOSITION
CHANGE_MODE = mavlink.MAV_DO_REPOSITION_FLAGS_CHANGE_MODE
CLIMB = MissionItem(TAKE_OFF, 3, (NAN,) * 4, round(HOME.lat_deg * 1e7), round(HOME.lon_deg * 1e7), 4.0)
CUSTOM = mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED


@pytest.fixture
def ground(tmp_path):
    return Sky(tmp_path).station()


@pytest.fixture
def air(tmp_path):
    sky = Sky(tmp_path, up=8.0)
    station = sky.station()
    sky.advance(0.5)
    return station


def set_mode(station, mode, base=CUSTOM):
    station.send(mavlink.MAVLink_set_mode_message(1, base, custom_mode(mode)))
    station.sky.advance(1.1)  # a HEARTBEAT


def reposition(station, *, yaw=NAN, altitude=NAN):
    return station.command(REPOSITION, -1.0, CHANGE_MODE, 0.0, yaw, NAN, NAN, altitude)


def test_take_off_is_ordered_first_and_begins_by_arming(ground):
    assert ground.command(TAKE_OFF, -1.0, 0.0, 0.0, NAN, NAN, NAN, HOME.alt + 4.0) == ACCEPTED
    ground.sky.advance(0.2)
    assert ground.flight_mode is Mode.TAKEOFF
    assert not ground.sky.autopilot.flying
    assert ground.command(ARM, 1.0) == ACCEPTED
    ground.sky.advance_until(lambda: "Take-off complete" in ground.texts(), 20.0)
    assert ground.sky.craft.vehicle.truth.body.position.z == pytest.approx(4.0, abs=0.5)


def test_a_mission_is_chosen_first_and_begins_by_arming(ground):
    assert ground.upload([CLIMB]) == mavlink.MAV_MISSION_ACCEPTED
    set_mode(ground, Mode.MISSION)
    assert ground.flight_mode is Mode.MISSION
    assert not ground.sky.autopilot.flying
    assert ground.command(ARM, 1.0) == ACCEPTED
    assert ground.sky.autopilot.flying
    assert ground.flight_mode is Mode.MISSION


def test_no_mission_can_be_chosen_where_there_is_none(ground):
    set_mode(ground, Mode.MISSION)
    assert ground.flight_mode is Mode.HOLD
    assert "none is loaded" in ground.texts()


@pytest.mark.parametrize("how", ["time", "hold", "disarm", "new plan"])
def test_what_waits_for_arming_is_forgotten(ground, how):
    assert ground.upload([CLIMB]) == mavlink.MAV_MISSION_ACCEPTED
    set_mode(ground, Mode.MISSION)
    if how == "time":
        ground.sky.advance(ARM_WITHIN + 0.5)
        assert "Mission not begun: nobody armed" in ground.texts()
    elif how == "hold":
        set_mode(ground, Mode.HOLD)
    elif how == "disarm":
        assert ground.command(ARM, 0.0) == ACCEPTED
    else:
        assert ground.upload([CLIMB, CLIMB]) == mavlink.MAV_MISSION_ACCEPTED
    assert ground.sky.autopilot.mode is Mode.HOLD
    assert ground.command(ARM, 1.0) == ACCEPTED
    ground.sky.advance(0.5)
    assert not ground.sky.autopilot.flying


@pytest.mark.parametrize("mode", [Mode.HOLD, Mode.RTL, Mode.LAND])
def test_modes_are_switched_by_the_message(air, mode):
    set_mode(air, mode)
    assert air.flight_mode is mode


def test_a_mode_by_message_that_is_none_is_refused_in_words(air):
    set_mode(air, Mode.RTL, base=0)
    air.send(mavlink.MAVLink_set_mode_message(1, CUSTOM, 77))
    set_mode(air, Mode.ACRO)
    assert air.flight_mode is Mode.HOLD
    for words in (f"Mode {custom_mode(Mode.RTL)} is unknown", "Mode 77 is unknown", "Mode ACRO is not available"):
        assert words in air.texts()


def test_a_mode_for_another_vehicle_is_none_of_ours(air):
    air.send(mavlink.MAVLink_set_mode_message(2, CUSTOM, custom_mode(Mode.LAND)))
    assert air.sky.autopilot.mode is Mode.HOLD


def test_who_is_not_in_control_cannot_switch_the_mode_by_message(air):
    assert air.command(mavlink.MAV_CMD_REQUEST_OPERATOR_CONTROL, 1, 0, 0, 255) == ACCEPTED
    second = air.sky.station(245)
    set_mode(second, Mode.LAND)
    assert air.sky.autopilot.mode is Mode.HOLD


def test_pause_holds(air):
    assert air.mode(Mode.RTL) == ACCEPTED
    assert reposition(air) == ACCEPTED
    assert air.sky.autopilot.mode is Mode.HOLD


def test_the_height_changes_above_the_place_where_it_is(air):
    x, y, _ = air.sky.autopilot.reference.position
    assert reposition(air, altitude=HOME.alt + 11.0) == ACCEPTED
    air.sky.advance(8.0)
    assert air.sky.craft.vehicle.truth.body.position == pytest.approx((x, y, 11.0), abs=0.5)


@pytest.mark.parametrize(("altitude", "frame"), [(11.0, 3), (HOME.alt + 11.0, 0)])
def test_the_height_changes_by_its_own_command(air, altitude, frame):
    assert air.command(mavlink.MAV_CMD_DO_CHANGE_ALTITUDE, altitude, frame) == ACCEPTED
    air.sky.advance(8.0)
    assert air.sky.craft.vehicle.truth.body.position.z == pytest.approx(11.0, abs=0.5)


def test_the_heading_changes_where_it_is(air):
    before = air.sky.autopilot.reference.position
    assert reposition(air, yaw=math.radians(60.0)) == ACCEPTED
    air.sky.advance(8.0)
    assert air.last("GLOBAL_POSITION_INT").hdg == pytest.approx(6000, abs=300)
    assert air.sky.craft.vehicle.truth.body.position == pytest.approx(before, abs=0.5)
