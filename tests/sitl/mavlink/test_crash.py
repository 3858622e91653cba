"""A crash as every ground station sees it, and the reboot that ends it."""

import pytest

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Law, Reason
from sitl.mavlink.services.command_service import ExitRequest
from sitl.model.quaternions import from_euler
from sitl.model.state import Body
from sitl.model.vectors import Vector
from sitl.simulation.avionics import Navigation
from tests.support.vehicle.fake_station import FakeStation


@pytest.fixture
def crashed(tmp_path):
    """A station that saw the vehicle hit the ground at 12 m/s."""
    station = FakeStation.with_vehicle(tmp_path, up=3.0)
    station.ask_for("DARKO_HYBRID_STATE")
    vehicle = station.bench.aircraft.vehicle
    vehicle.place(
        Body(Vector(9.0, 4.0, 2.0), Vector(0.0, 0.0, -12.0), from_euler(0.3, 1.0, 0.0), Vector(0.0, 0.0, 0.0))
    )
    station.advance(3.0)
    return station


def test_a_crash_is_an_emergency_on_the_ground_disarmed_under_a_law_of_its_own(crashed):
    heartbeat, state = crashed.last("HEARTBEAT"), crashed.last("DARKO_HYBRID_STATE")
    assert heartbeat.system_status == mavlink.MAV_STATE_EMERGENCY
    assert not heartbeat.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED
    assert crashed.last("EXTENDED_SYS_STATE").landed_state == mavlink.MAV_LANDED_STATE_ON_GROUND
    assert (state.law, state.last_reason) == (Law.CRASHED, Reason.CRASH)


def test_it_is_said_once_and_gravely_with_speed_and_place(crashed):
    said = [m for m in crashed.heard if m.get_type() == "STATUSTEXT" and m.text.startswith("Crashed at ")]
    assert len(said) == 1
    assert said[0].severity == mavlink.MAV_SEVERITY_CRITICAL
    assert said[0].text.endswith("9 m north 4 m west of home")


def test_arming_is_refused_until_a_reboot_which_is_granted(crashed):
    assert crashed.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1) == mavlink.MAV_RESULT_TEMPORARILY_REJECTED
    assert crashed.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1, 21196) == mavlink.MAV_RESULT_TEMPORARILY_REJECTED
    assert crashed.command(mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, 1) == mavlink.MAV_RESULT_ACCEPTED
    assert crashed.bench.node.exit_request is ExitRequest.REBOOT


def test_where_the_wreck_lies_is_known_again_soon(tmp_path):
    station = FakeStation.with_vehicle(tmp_path, up=20.0, navigation=Navigation.SENSORS)
    station.advance(1.0)
    station.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 0, 21196)
    station.bench.advance_until(lambda: station.vehicle.law is Law.CRASHED, 5.0)
    station.advance(3.0)
    truth, told = station.vehicle.truth.body.position, station.last("LOCAL_POSITION_NED")
    assert (told.x, -told.y, -told.z) == pytest.approx(truth, abs=1.5)
    assert (told.vx, told.vy, told.vz) == pytest.approx((0.0, 0.0, 0.0), abs=0.5)
