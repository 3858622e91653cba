"""QGroundControl's buttons for a PX4, as its public sources send them (PX4FirmwarePlugin)."""

import math

import pytest

from protocol.dialect import mavlink
from protocol.names import Mode, custom_mode
from protocol.plans.plan import MissionItem
from sitl.autopilot.arming import ARMING_TIMEOUT
from tests.support.vehicle.fake_station import HOME, NAN, Bench

ACCEPTED = mavlink.MAV_RESULT_ACCEPTED
ARM, TAKE_OFF = mavlink.MAV_CMD_COMPONENT_ARM_DISARM, mavlink.MAV_CMD_NAV_TAKEOFF
REPOSITION = mavlink.MAV_CMD_DO_REPOSITION
CHANGE_MODE = mavlink.MAV_DO_REPOSITION_FLAGS_CHANGE_MODE
CLIMB = MissionItem(
    command=TAKE_OFF, frame=3, params=(NAN,) * 4, x=round(HOME.lat_deg * 1e7), y=round(HOME.lon_deg * 1e7), z=4.0
)
CUSTOM = mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED


@pytest.fixture
def ground(tmp_path):
    return Bench(tmp_path).station()


@pytest.fixture
def air(tmp_path):
    bench = Bench(tmp_path, up=8.0)
    station = bench.station()
    bench.advance(0.5)
    return station


def set_mode(station, mode, base=CUSTOM):
    station.send(mavlink.MAVLink_set_mode_message(1, base, custom_mode(mode)))
    station.bench.advance(1.1)  # a HEARTBEAT


def reposition(station, *, yaw=NAN, altitude=NAN):
    return station.command(REPOSITION, -1.0, CHANGE_MODE, 0.0, yaw, NAN, NAN, altitude)


def test_take_off_is_ordered_first_and_begins_with_arming(ground):
    assert ground.command(TAKE_OFF, -1.0, 0.0, 0.0, NAN, NAN, NAN, HOME.alt + 4.0) == ACCEPTED
    ground.bench.advance(0.2)
    assert ground.flight_mode is Mode.TAKEOFF
    assert not ground.bench.autopilot.flying
    assert ground.command(ARM, 1.0) == ACCEPTED
    ground.bench.advance_until(lambda: "Take-off complete" in ground.texts(), 20.0)
    assert ground.bench.aircraft.vehicle.truth.body.position.z == pytest.approx(4.0, abs=0.5)


def test_a_mission_is_chosen_first_and_begins_with_arming(ground):
    assert ground.upload([CLIMB]) == mavlink.MAV_MISSION_ACCEPTED
    set_mode(ground, Mode.MISSION)
    assert ground.flight_mode is Mode.MISSION
    assert not ground.bench.autopilot.flying
    assert ground.command(ARM, 1.0) == ACCEPTED
    assert ground.bench.autopilot.flying
    assert ground.flight_mode is Mode.MISSION


def test_without_a_mission_the_mission_mode_is_refused(ground):
    set_mode(ground, Mode.MISSION)
    assert ground.flight_mode is Mode.HOLD
    assert "none is loaded" in ground.texts()


@pytest.mark.parametrize("how", ["time", "hold", "disarm", "new plan"])
def test_a_wait_for_arming_ends(ground, how):
    assert ground.upload([CLIMB]) == mavlink.MAV_MISSION_ACCEPTED
    set_mode(ground, Mode.MISSION)
    if how == "time":
        ground.bench.advance(ARMING_TIMEOUT + 0.5)
        assert "Mission cancelled: not armed in time" in ground.texts()
    elif how == "hold":
        set_mode(ground, Mode.HOLD)
    elif how == "disarm":
        assert ground.command(ARM, 0.0) == ACCEPTED
    else:
        assert ground.upload([CLIMB, CLIMB]) == mavlink.MAV_MISSION_ACCEPTED
    assert ground.bench.autopilot.mode is Mode.HOLD
    assert ground.command(ARM, 1.0) == ACCEPTED
    ground.bench.advance(0.5)
    assert not ground.bench.autopilot.flying


@pytest.mark.parametrize("mode", [Mode.HOLD, Mode.RTL, Mode.LAND])
def test_modes_are_switched_by_message(air, mode):
    set_mode(air, mode)
    assert air.flight_mode is mode


def test_an_unknown_mode_by_message_is_refused_with_a_reason(air):
    set_mode(air, Mode.RTL, base=0)
    air.send(mavlink.MAVLink_set_mode_message(1, CUSTOM, 77))
    set_mode(air, Mode.ACRO)
    assert air.flight_mode is Mode.HOLD
    for reason in (
        f"Mode {custom_mode(Mode.RTL)} is not available",
        "Mode 77 is not available",
        "Mode ACRO is not available",
    ):
        assert reason in air.texts()


def test_a_mode_for_another_vehicle_is_ignored(air):
    air.send(mavlink.MAVLink_set_mode_message(2, CUSTOM, custom_mode(Mode.LAND)))
    assert air.bench.autopilot.mode is Mode.HOLD


def test_a_station_that_is_not_in_control_cannot_switch_the_mode_by_message(air):
    assert air.command(mavlink.MAV_CMD_REQUEST_OPERATOR_CONTROL, 1, 0, 0, 255) == ACCEPTED
    second = air.bench.station(245)
    set_mode(second, Mode.LAND)
    assert air.bench.autopilot.mode is Mode.HOLD


def test_pause_holds(air):
    assert air.mode(Mode.RTL) == ACCEPTED
    assert reposition(air) == ACCEPTED
    assert air.bench.autopilot.mode is Mode.HOLD


def test_the_height_changes_above_the_present_position(air):
    x, y, _ = air.bench.autopilot.reference.position
    assert reposition(air, altitude=HOME.alt + 11.0) == ACCEPTED
    air.bench.advance(8.0)
    assert air.bench.aircraft.vehicle.truth.body.position == pytest.approx((x, y, 11.0), abs=0.5)


@pytest.mark.parametrize(("altitude", "frame"), [(11.0, 3), (HOME.alt + 11.0, 0)])
def test_the_height_changes_by_its_own_command(air, altitude, frame):
    assert air.command(mavlink.MAV_CMD_DO_CHANGE_ALTITUDE, altitude, frame) == ACCEPTED
    air.bench.advance(8.0)
    assert air.bench.aircraft.vehicle.truth.body.position.z == pytest.approx(11.0, abs=0.5)


def test_the_heading_changes_at_the_present_position(air):
    before = air.bench.autopilot.reference.position
    assert reposition(air, yaw=math.radians(60.0)) == ACCEPTED
    air.bench.advance(8.0)
    assert air.last("GLOBAL_POSITION_INT").hdg == pytest.approx(6000, abs=300)
    assert air.bench.aircraft.vehicle.truth.body.position == pytest.approx(before, abs=0.5)


@pytest.mark.parametrize(
    "higher",
    [
        lambda s: reposition(s, altitude=HOME.alt + 14.0),
        lambda s: s.command(mavlink.MAV_CMD_DO_CHANGE_ALTITUDE, 14.0, mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT),
    ],
)
def test_the_height_changes_while_it_circles_and_it_circles_on(air, higher):
    assert air.command(mavlink.MAV_CMD_DO_ORBIT, 40.0) == ACCEPTED
    air.bench.advance(0.5)
    before = air.bench.autopilot.reference.path
    assert higher(air) == ACCEPTED
    air.bench.advance(0.1)
    after = air.bench.autopilot.reference
    assert after.forward
    assert after.path == before._replace(start=before.start._replace(z=14.0), end=before.end._replace(z=14.0))


@pytest.mark.parametrize("mode", [Mode.RTL, Mode.LAND, Mode.POSCTL])
def test_modes_are_chosen_while_disarmed(ground, mode):
    set_mode(ground, mode)
    assert ground.flight_mode is mode
    assert not ground.bench.autopilot.flying
