"""Errors in the vehicle's own code: each is told and logged, the vehicle holds, and everything else goes on."""

import pytest

from protocol.dialect import mavlink
from protocol.names import Mode
from protocol.plans import load
from protocol.tlog import read_tlog
from sitl.mavlink.flight_recorder import FlightRecorder
from sitl.mavlink.telemetry import telemetry_service
from sitl.tools.error_guard import ErrorGuard
from tests.support.paths import DATA
from tests.support.vehicle.fake_station import FakeStation

CRITICAL = mavlink.MAV_SEVERITY_CRITICAL
SQUARE = load(DATA / "square.plan").items


class BrokenError(Exception):
    """Raised by what a test breaks."""


def breaks(*_args, **_options):
    raise BrokenError("broken by the test")


@pytest.fixture(autouse=True)
def contained(monkeypatch):
    monkeypatch.setattr(ErrorGuard, "raises", False)


@pytest.fixture
def told():
    return []


@pytest.fixture
def station(tmp_path, told):
    recorder = FlightRecorder(tmp_path / "logs", lambda: 1.7e9)
    made = FakeStation.with_vehicle(tmp_path, up=5.0, node_options={"tell": told.append, "recorder": recorder})
    yield made
    recorder.close()


def criticals(station):
    return "".join(m.text for m in station.all("STATUSTEXT") if m.severity == CRITICAL)


def test_an_error_of_a_mission_is_told_with_its_place_and_the_vehicle_holds(station, monkeypatch, told):
    station.upload(SQUARE)
    assert station.command(mavlink.MAV_CMD_MISSION_START) == mavlink.MAV_RESULT_ACCEPTED
    station.advance(1.0)
    monkeypatch.setattr(type(station.autopilot.mission), "update", breaks)
    station.advance(0.5)
    monkeypatch.undo()
    monkeypatch.setattr(ErrorGuard, "raises", False)
    assert station.flight_mode is Mode.HOLD
    assert "Internal error in MissionRequests.update (missions.py:" in criticals(station)
    assert "BrokenError: broken by the test" in criticals(station)
    (line,) = told
    assert line.endswith("errors.log)")
    station.advance(4.0)
    assert max(map(abs, station.vehicle.truth.body.velocity)) < 0.2
    assert len(station.autopilot.mission.items) == len(SQUARE)
    assert station.command(mavlink.MAV_CMD_MISSION_START) == mavlink.MAV_RESULT_ACCEPTED
    station.advance(1.0)
    assert station.flight_mode is Mode.MISSION


def test_the_traceback_is_in_the_log_of_errors_and_in_the_flight_s(station, monkeypatch, tmp_path):
    monkeypatch.setattr(type(station.autopilot.guided), "hold", breaks)
    station.command(mavlink.MAV_CMD_NAV_LOITER_UNLIM)
    logged = (tmp_path / "errors.log").read_text(encoding="utf-8")
    assert "Traceback (most recent call last)" in logged
    assert "BrokenError: broken by the test" in logged
    station.node._reporter._recorder.close()
    (log,) = (tmp_path / "logs").glob("*.tlog")
    flight = read_tlog(log)
    texts = "".join(flight.decode(index).text for index in flight.rows("STATUSTEXT"))
    assert "Traceback (most recent call last)" in texts


def test_a_command_that_an_error_cuts_short_has_failed(station, monkeypatch):
    monkeypatch.setattr(type(station.autopilot.guided), "hold", breaks)
    assert station.command(mavlink.MAV_CMD_NAV_LOITER_UNLIM) == mavlink.MAV_RESULT_FAILED
    assert "Internal error" in criticals(station)


def test_a_plan_that_cannot_be_checked_for_an_error_is_refused_and_the_old_one_stays(station, monkeypatch):
    station.upload(SQUARE)
    monkeypatch.setattr("sitl.mavlink.services.plan_service.validate", breaks)
    assert station.upload(SQUARE[:3]) == mavlink.MAV_MISSION_ERROR
    assert station.autopilot.mission.items == SQUARE
    assert "Mission refused: an internal error" in station.texts()


def test_a_parameter_that_an_error_keeps_from_being_put_in_force_is_answered_by_the_old_value(station, monkeypatch):
    monkeypatch.setattr(station.node.aircraft, "configure", breaks)
    station.set_parameter("MIS_TAKEOFF_ALT", 7.0)
    assert [m.param_value for m in station.all("PARAM_VALUE")] == [2.5]


def test_one_stream_that_cannot_be_made_leaves_the_others_and_is_told_now_and_then(station, monkeypatch):
    monkeypatch.setitem(telemetry_service.BUILDERS, mavlink.MAVLINK_MSG_ID_ATTITUDE, breaks)
    station.node._reporter._recorder = None
    before = len(station.all("LOCAL_POSITION_NED"))
    station.advance(4.0)
    assert len(station.all("LOCAL_POSITION_NED")) - before >= 79
    assert criticals(station).count("Internal error") == 1
    assert station.last("HEARTBEAT") is not None


def test_an_error_in_a_service_lets_a_landing_go_on(station, monkeypatch):
    station.mode(Mode.LAND)
    monkeypatch.setitem(telemetry_service.BUILDERS, mavlink.MAVLINK_MSG_ID_ATTITUDE, breaks)
    station.advance(1.0)
    assert "Internal error" in criticals(station)
    assert station.autopilot.mode is Mode.LAND


def test_an_error_in_a_service_ends_a_mission_once_not_again(station, monkeypatch):
    station.upload(SQUARE)
    station.command(mavlink.MAV_CMD_MISSION_START)
    monkeypatch.setattr(type(station.node._flight_plan), "update", breaks)
    station.advance(0.1)
    assert station.autopilot.mode is Mode.HOLD
    station.command(mavlink.MAV_CMD_MISSION_START)
    station.advance(1.0)
    assert station.autopilot.mode is Mode.MISSION


def test_a_reference_that_is_not_finite_is_an_error_before_it_is_flown(station, monkeypatch):
    update = type(station.autopilot).update
    monkeypatch.setattr(type(station.autopilot), "update", lambda *args: update(*args)._replace(heading=float("nan")))
    station.advance(1.0)
    assert "the reference is not finite" in criticals(station)
    assert abs(station.vehicle.truth.body.position.z - 5.0) < 0.2


def test_where_the_hold_itself_fails_the_vehicle_stays_where_it_was_to_be(station, monkeypatch):
    monkeypatch.setattr(type(station.autopilot), "update", breaks)
    monkeypatch.setattr(type(station.autopilot), "recover", breaks)
    monkeypatch.setattr(type(station.autopilot), "hold_after_error", breaks)
    station.advance(1.0)
    assert abs(station.vehicle.truth.body.position.z - 5.0) < 0.2


def test_a_failing_disk_keeps_no_error_from_being_told(station, monkeypatch):
    monkeypatch.setattr(type(station.node.state_folder), "add_error", breaks)
    monkeypatch.setattr(type(station.autopilot.guided), "hold", breaks)
    assert station.command(mavlink.MAV_CMD_NAV_LOITER_UNLIM) == mavlink.MAV_RESULT_FAILED
    assert "Internal error" in criticals(station)


def test_where_errors_are_to_be_seen_they_are_raised(station, monkeypatch):
    monkeypatch.setattr(ErrorGuard, "raises", True)
    monkeypatch.setattr(type(station.autopilot.guided), "hold", breaks)
    with pytest.raises(BrokenError):
        station.command(mavlink.MAV_CMD_NAV_LOITER_UNLIM)
