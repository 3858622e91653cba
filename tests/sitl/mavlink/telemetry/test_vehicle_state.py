"""HEARTBEAT's state of the system, by PX4's rule, and HEARTBEAT on request."""

import pytest

from protocol.dialect import mavlink
from protocol.frames import LocalFrame
from protocol.names import Mode
from sitl.autopilot.settings import Settings
from sitl.autopilot.world import ARENAS, World
from sitl.defaults import HOME
from sitl.mavlink.telemetry.vehicle_snapshot import HeartbeatStatus, take_snapshot
from sitl.mavlink.telemetry.vehicle_state import heartbeat, instrument_bits
from sitl.model.aerodynamics import thrusts
from sitl.model.airframe_files import load
from sitl.model.plant import inflow
from sitl.sensors.instruments import ACCELEROMETER, FIRST_DELAYED, GYROSCOPE, INSTRUMENTS, N_DELAYED, PITOT
from sitl.simulation.avionics import Navigation
from sitl.simulation.navigation_status import Aid, NavigationStatus
from sitl.simulation.simulation import Simulation
from sitl.simulation.start import Start
from sitl.vehicle.aircraft import Aircraft
from sitl.vehicle.parameters import Configuration, WorldSettings
from tests.support.vehicle.fake_station import FakeStation
from tests.support.vehicle.mission_items import NAN, waypoint

ACTIVE, STANDBY = mavlink.MAV_STATE_ACTIVE, mavlink.MAV_STATE_STANDBY
CRITICAL, EMERGENCY = mavlink.MAV_STATE_CRITICAL, mavlink.MAV_STATE_EMERGENCY
SUSPENDED = 2  # mission_mode of MISSION_CURRENT outside the mission mode
ARM, REQUEST = mavlink.MAV_CMD_COMPONENT_ARM_DISARM, mavlink.MAV_CMD_REQUEST_MESSAGE
GET, SET = mavlink.MAV_CMD_GET_MESSAGE_INTERVAL, mavlink.MAV_CMD_SET_MESSAGE_INTERVAL


@pytest.mark.parametrize(
    ("armed", "critical", "crashed", "state"),
    [
        (False, False, False, STANDBY),
        (False, True, False, STANDBY),
        (True, False, False, ACTIVE),
        (True, True, False, CRITICAL),
        (False, False, True, EMERGENCY),
    ],
)
def test_armed_or_not_decides_the_state(armed, critical, crashed, state):
    status = HeartbeatStatus(Mode.HOLD, armed=armed, critical=critical, crashed=crashed)
    assert heartbeat(status).system_status == state


def test_arming_and_disarming_on_the_ground_are_told_at_once(tmp_path):
    station = FakeStation.with_vehicle(tmp_path)
    states = [station.last("HEARTBEAT").system_status]
    for armed in (1, 0):
        assert station.command(ARM, armed) == mavlink.MAV_RESULT_ACCEPTED
        states.append(station.last("HEARTBEAT").system_status)
    assert states == [STANDBY, ACTIVE, STANDBY]


def told_with(station, command, *params):
    """The last MISSION_CURRENT before the answer to a command, which is accepted."""
    station.heard.clear()
    assert station.command(command, *params) == mavlink.MAV_RESULT_ACCEPTED
    answer = next(i for i, m in enumerate(station.heard) if m.get_type() == "COMMAND_ACK")
    (*_, told) = (m for m in station.heard[:answer] if m.get_type() == "MISSION_CURRENT")
    return told.mission_mode, told.mission_state, told.seq


def test_the_state_of_the_mission_is_told_before_the_answer_that_changes_it(tmp_path):
    station = FakeStation.with_vehicle(tmp_path, up=20.0)
    assert station.upload([waypoint(50, 0, 20), waypoint(0, 40, 20)]) == mavlink.MAV_MISSION_ACCEPTED
    station.advance(1.0)
    assert station.last("MISSION_CURRENT").mission_mode == SUSPENDED
    assert station.last("MISSION_CURRENT").mission_state == mavlink.MISSION_STATE_NOT_STARTED
    assert told_with(station, mavlink.MAV_CMD_MISSION_START, 1) == (1, mavlink.MISSION_STATE_ACTIVE, 1)
    station.advance(0.1)
    pause = mavlink.MAV_CMD_DO_PAUSE_CONTINUE
    assert told_with(station, pause, 0) == (SUSPENDED, mavlink.MISSION_STATE_PAUSED, 1)
    assert told_with(station, pause, 1) == (1, mavlink.MISSION_STATE_ACTIVE, 1)


@pytest.mark.parametrize(
    ("params", "first"), [((0, 0), 1), ((NAN, NAN), 1), ((), 1), ((0, NAN), 0), ((0, 2), 0), ((2, 0), 2)]
)
def test_a_start_names_its_first_item_or_leaves_it_out(tmp_path, params, first):
    station = FakeStation.with_vehicle(tmp_path, up=20.0)
    station.upload([waypoint(50, 0, 20), waypoint(0, 40, 20), waypoint(0, -40, 20)])
    assert told_with(station, mavlink.MAV_CMD_MISSION_START, 1)[2] == 1
    station.advance(0.1)
    station.command(mavlink.MAV_CMD_DO_PAUSE_CONTINUE, 0)
    station.heard.clear()
    assert station.command(mavlink.MAV_CMD_MISSION_START, *params) == mavlink.MAV_RESULT_ACCEPTED
    assert station.autopilot.mission.current == first


def test_the_chosen_item_is_told_whether_it_changed_or_not(tmp_path):
    station = FakeStation.with_vehicle(tmp_path)
    station.upload([waypoint(50, 0, 20), waypoint(0, 0, 20)])
    for seq, now in ((1, 1), (1, 1), (-1, 1), (0, 0)):
        station.heard.clear()
        assert station.command(mavlink.MAV_CMD_DO_SET_MISSION_CURRENT, seq, 1) == mavlink.MAV_RESULT_ACCEPTED
        assert station.last("MISSION_CURRENT").seq == now


def test_motors_stopped_in_the_air_stand_by(tmp_path):
    station = FakeStation.with_vehicle(tmp_path, up=3.0)
    assert station.last("HEARTBEAT").system_status == ACTIVE
    assert station.command(ARM, 0, 21196) == mavlink.MAV_RESULT_ACCEPTED
    assert station.last("HEARTBEAT").system_status == STANDBY


@pytest.mark.parametrize("autopilot", [mavlink.MAV_AUTOPILOT_PX4, mavlink.MAV_AUTOPILOT_GENERIC])
def test_heartbeat_is_sent_on_request_and_is_the_streamed_one(tmp_path, autopilot):
    station = FakeStation.with_vehicle(tmp_path, node_options={"autopilot_type": autopilot})
    streamed = station.last("HEARTBEAT").to_dict()
    station.heard.clear()
    assert station.command(REQUEST, mavlink.MAVLINK_MSG_ID_HEARTBEAT) == mavlink.MAV_RESULT_ACCEPTED
    assert [m.to_dict() for m in station.all("HEARTBEAT")] == [streamed]
    assert streamed["autopilot"] == autopilot


def test_its_interval_is_told_and_cannot_be_changed(tmp_path):
    station = FakeStation.with_vehicle(tmp_path)
    assert station.command(GET, mavlink.MAVLINK_MSG_ID_HEARTBEAT) == mavlink.MAV_RESULT_ACCEPTED
    assert station.last("MESSAGE_INTERVAL").interval_us == 1_000_000
    for interval, result in ((0.0, 0), (1e6, 0), (1e5, mavlink.MAV_RESULT_DENIED), (-1.0, mavlink.MAV_RESULT_DENIED)):
        assert station.command(SET, mavlink.MAVLINK_MSG_ID_HEARTBEAT, interval) == result


def test_power_and_thrust_are_those_of_the_propellers_in_the_air_as_it_moves():
    blown = WorldSettings(gusts=0.5, wind_speed=3.0, wind_direction=270.0)
    start = Start(up=5.0, airborne=True)
    flown = Simulation(load("collage").parameters, start=start, navigation=Navigation.SENSORS, aligned=True)
    configuration = Configuration(Settings(), flown.tuning, blown)
    aircraft = Aircraft(flown, World(LocalFrame(HOME), ARENAS["open"]), configuration, airborne=True)
    aircraft.advance(500)
    vehicle, snapshot = aircraft.vehicle, take_snapshot(aircraft)
    w, truth, a = vehicle.wind, vehicle.truth, vehicle.airframe
    assert snapshot.power == vehicle.power
    assert snapshot.battery == aircraft.battery
    assert snapshot.battery_reading == vehicle.avionics.battery_reading(
        aircraft.battery, vehicle.power, vehicle.periods
    )
    assert snapshot.wind == w
    assert snapshot.thrust == thrusts(truth.actuators, inflow(truth.body, w), a)
    assert snapshot.thrust != thrusts(truth.actuators, 0.0, a)


# Instruments that SYS_STATUS reports as present, and those that it reports as healthy.


TUBE = mavlink.MAV_SYS_STATUS_SENSOR_DIFFERENTIAL_PRESSURE
GYRO, ACCEL = mavlink.MAV_SYS_STATUS_SENSOR_3D_GYRO, mavlink.MAV_SYS_STATUS_SENSOR_3D_ACCEL


def status(*failed, reads=True):
    aids = [Aid()] * N_DELAYED
    aids[PITOT - FIRST_DELAYED] = Aid(read_age=0.0 if reads else 9.0)
    return NavigationStatus(
        source=Navigation.SENSORS, aids=tuple(aids), failed=tuple(k in failed for k in range(INSTRUMENTS))
    )


@pytest.mark.parametrize(("instrument", "bit"), [(PITOT, TUBE), (GYROSCOPE, GYRO), (ACCELEROMETER, ACCEL)])
def test_an_instrument_that_has_failed_is_there_and_not_well(instrument, bit):
    well = instrument_bits(status(), has_position=True, has_tube=True)
    failed = instrument_bits(status(instrument), has_position=True, has_tube=True)
    assert well[0] == failed[0]
    assert well[0] & bit
    assert well[1] & ~failed[1] == bit


def test_a_tube_that_reads_nothing_is_not_well_and_one_that_is_not_aboard_not_there():
    assert not instrument_bits(status(reads=False), has_position=True, has_tube=True)[1] & TUBE
    assert not instrument_bits(status(), has_position=True, has_tube=False)[0] & TUBE


@pytest.mark.parametrize("source", [Navigation.SENSORS, Navigation.MOCAP])
def test_navigation_goes_on_without_a_tube_that_has_failed(source):
    helps = (Aid(0.0, 0.0),) * N_DELAYED
    assert status(PITOT)._replace(source=source, aids=helps).unfused == ("pitot tube",)
    assert status()._replace(source=source, aids=helps).unfused == ()
