"""The answers to every command: the MAV_RESULT of its definition, and a reason; a refusal changes nothing.

https://mavlink.io/en/messages/common.html#mav_commands
"""

import math

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Law
from protocol.engines.server.stream_server import STREAM_COMMANDS
from protocol.names import FORCE_ARM_DISARM
from sitl.autopilot.settings import Settings
from sitl.autopilot.world import ARENAS, World
from sitl.mavlink import commands
from sitl.mavlink.handlers import answered_by
from sitl.mavlink.services.command_service import MaintenanceCommands
from sitl.model.airframe_files import load
from sitl.sensors.instruments import GNSS, OFF, STUCK, WRONG
from sitl.simulation.avionics import Navigation
from sitl.simulation.simulation import Simulation
from sitl.simulation.start import Start
from sitl.vehicle.aircraft import Aircraft
from sitl.vehicle.injected_failures import LEFT_AFTER_SAG, LOST_CELL, MISREAD
from sitl.vehicle.parameters import Configuration, WorldSettings
from tests.support.vehicle.fake_station import FRAME, HOME, PEER, Bench, FakeStation

MAINTENANCE = answered_by(MaintenanceCommands, int)
NAN, INF = math.nan, math.inf
ACCEPTED, REJECTED, DENIED = 0, 1, 2
UNSUPPORTED, FAILED, IN_PROGRESS, INT_ONLY, FRAME_UNSUPPORTED = 3, 4, 5, 8, 9
FINAL = frozenset({ACCEPTED, REJECTED, DENIED, UNSUPPORTED, FAILED, INT_ONLY, FRAME_UNSUPPORTED})
HIGH = 40.0
LAT, LON = HOME.lat_deg, HOME.lon_deg
RELATIVE, LOCAL = mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT, mavlink.MAV_FRAME_LOCAL_NED
C = {
    name.removeprefix("MAV_CMD_"): number for number, name in ((n, e.name) for n, e in mavlink.enums["MAV_CMD"].items())
}

# What is sent (parameters from the first on, NaN for the rest), and the answer. "ground" is disarmed.
ANSWERS = [
    # command, state, parameters, result, a word of the text
    ("COMPONENT_ARM_DISARM", "ground", (1,), ACCEPTED, ""),
    ("COMPONENT_ARM_DISARM", "ground", (0,), ACCEPTED, ""),
    ("COMPONENT_ARM_DISARM", "ground", (2,), DENIED, "param1 is 2"),
    ("COMPONENT_ARM_DISARM", "ground", (NAN,), DENIED, "param1 is nan"),
    ("COMPONENT_ARM_DISARM", "ground", (1, 2989), DENIED, "param2 is 2989"),
    ("COMPONENT_ARM_DISARM", "air", (0,), DENIED, "in the air"),
    ("NAV_TAKEOFF", "ground", (), ACCEPTED, "waits 20 s for arming"),
    ("NAV_TAKEOFF", "armed", (*(NAN,) * 6, INF), DENIED, "Take-off denied"),
    ("NAV_TAKEOFF", "armed", (*(NAN,) * 6, 0.2), DENIED, "not above the ground"),
    ("NAV_TAKEOFF", "armed", (*(NAN,) * 6, 1e6), DENIED, "Take-off denied"),
    ("NAV_TAKEOFF", "armed", (*(NAN,) * 4, LAT + 0.01, LON, 5.0), DENIED, "the position is 1111 m away"),
    (
        "NAV_TAKEOFF",
        "armed",
        (*(NAN,) * 4, 91.0, LON, 5.0),
        DENIED,
        "param5 is 91, not a number from -90 to 90 deg",
    ),
    ("NAV_TAKEOFF", "armed", (*(NAN,) * 4, LAT, LON, 5.0), ACCEPTED, ""),
    ("NAV_TAKEOFF", "air", (), REJECTED, "already in the air"),
    ("NAV_VTOL_TAKEOFF", "armed", (), ACCEPTED, ""),
    ("NAV_LAND", "ground", (), REJECTED, "not in the air"),
    ("NAV_LAND", "air", (), ACCEPTED, ""),
    ("NAV_VTOL_LAND", "ground", (), REJECTED, "not in the air"),
    ("NAV_RETURN_TO_LAUNCH", "ground", (), REJECTED, "not in the air"),
    ("NAV_RETURN_TO_LAUNCH", "air", (), ACCEPTED, ""),
    ("NAV_LOITER_UNLIM", "air", (), ACCEPTED, ""),
    ("NAV_LOITER_UNLIM", "air", (0, 0, 0, 0, 0, 0, 0), ACCEPTED, ""),
    ("NAV_LOITER_UNLIM", "air", (0, 0, 0, 0, LAT, LON, 0), DENIED, "DO_REPOSITION"),
    ("DO_SET_MODE", "air", (1, 4, 3), ACCEPTED, ""),
    ("DO_SET_MODE", "air", (0, 4, 3), DENIED, "is not available"),  # custom mode is not what it says
    ("DO_SET_MODE", "air", (INF, 4, 3), DENIED, "param1 is inf"),
    ("DO_SET_MODE", "air", (1, NAN, 3), DENIED, "param2 is nan"),
    ("DO_SET_MODE", "air", (1, 4, 99), DENIED, "is not available"),
    ("DO_SET_MODE", "air", (1, 1, 0), DENIED, "MANUAL is not available"),
    ("DO_SET_STANDARD_MODE", "air", (99,), FAILED, "not available"),
    ("DO_SET_STANDARD_MODE", "air", (NAN,), FAILED, "not available"),
    ("MISSION_START", "armed", (), REJECTED, "none is loaded"),
    ("MISSION_START", "air", (INF,), DENIED, "param1 is inf, not a whole number from 0 to 999 (first item)"),
    ("MISSION_START", "air", (0, 3), DENIED, "param2 is 3, not the last item"),
    ("DO_SET_MISSION_CURRENT", "air", (NAN,), DENIED, "param1 is nan, not a whole number"),
    ("DO_SET_MISSION_CURRENT", "air", (7,), FAILED, "No mission item 7"),
    ("DO_SET_MISSION_CURRENT", "air", (-1, 1), FAILED, "No mission item (it has 0)"),
    ("DO_SET_MISSION_CURRENT", "air", (0, 2), DENIED, "param2 is 2, not 0 or 1"),
    ("DO_PAUSE_CONTINUE", "air", (0,), ACCEPTED, ""),
    ("DO_PAUSE_CONTINUE", "air", (1,), REJECTED, "none is loaded"),
    ("DO_PAUSE_CONTINUE", "air", (NAN,), DENIED, "param1 is nan"),
    ("DO_REPOSITION", "air", (-1, 1, 0, NAN, LAT, LON, 9.0), INT_ONLY, "COMMAND_INT"),
    (
        "DO_REPOSITION",
        "air",
        (-1, 1, 0, NAN, NAN, NAN, INF),
        DENIED,
        "param7 is inf, not a number from -20000 to",
    ),
    ("DO_REPOSITION", "ground", (-1, 1, 0, NAN, NAN, NAN, 160.0), REJECTED, "not in the air"),
    ("DO_REPOSITION", "air", (-1, 1, 0, NAN, NAN, NAN, NAN), ACCEPTED, ""),
    ("DO_CHANGE_SPEED", "air", (1, 2.0, -1), ACCEPTED, ""),
    ("DO_CHANGE_SPEED", "air", (NAN, 2.0), ACCEPTED, ""),
    ("DO_CHANGE_SPEED", "air", (1, -1, -1), ACCEPTED, ""),
    ("DO_CHANGE_SPEED", "air", (1, -2, -1), ACCEPTED, ""),
    ("DO_CHANGE_SPEED", "air", (2, 2.0, -1), REJECTED, "Vertical speed refused: not hovering to a point"),
    ("DO_CHANGE_SPEED", "air", (2, 3.0, -1), DENIED, "the hover climbs with up to 2.5 m/s"),
    ("DO_CHANGE_SPEED", "air", (3, NAN, -1), DENIED, "param2 is nan"),
    ("DO_CHANGE_SPEED", "air", (3, 2.5, -1), DENIED, "the hover descends with up to 2 m/s"),
    ("DO_CHANGE_SPEED", "air", (4, 2.0, -1), DENIED, "param1 is 4"),
    ("DO_CHANGE_SPEED", "air", (1, 5.0, -1), DENIED, "up to 3 m/s in the hover"),
    ("DO_CHANGE_SPEED", "air", (1, 0.0, -1), DENIED, "param2 is 0, not -1, -2 or a number from 0.1 to 22 m/s (speed)"),
    ("DO_CHANGE_SPEED", "air", (1, NAN, -1), DENIED, "param2 is nan"),
    ("DO_CHANGE_SPEED", "air", (1, 2.0, 40), DENIED, "throttle"),
    ("DO_CHANGE_SPEED", "air", (1, 15.0, -1), REJECTED, "not in forward flight"),
    ("DO_CHANGE_SPEED", "ground", (1, 2.0, -1), REJECTED, "not flying to a point"),
    ("DO_VTOL_TRANSITION", "air", (4,), IN_PROGRESS, ""),
    ("DO_VTOL_TRANSITION", "air", (3,), ACCEPTED, ""),
    ("DO_VTOL_TRANSITION", "air", (3.7,), DENIED, "param1 is 3.7"),
    ("DO_VTOL_TRANSITION", "air", (0,), DENIED, "param1 is 0"),
    ("DO_VTOL_TRANSITION", "air", (INF,), DENIED, "param1 is inf"),
    ("DO_VTOL_TRANSITION", "air", (4, 2), DENIED, "param2 is 2"),
    ("DO_VTOL_TRANSITION", "ground", (4,), REJECTED, "not in the air"),
    ("DO_ORBIT", "air", (), ACCEPTED, ""),
    ("DO_ORBIT", "air", (40, 14, 9), DENIED, "ORBIT_YAW_BEHAVIOUR"),
    ("DO_ORBIT", "air", (INF,), DENIED, "param1 is inf, not a number from -100000 to 100000 m (radius)"),
    ("DO_ORBIT", "air", (5,), DENIED, "cannot be flown"),
    ("DO_ORBIT", "air", (40, -14), DENIED, "cannot be flown"),
    ("DO_ORBIT", "air", (40, 14, NAN, 3), DENIED, "turns"),
    ("DO_ORBIT", "air", (40, 14, NAN, NAN, 91, LON), DENIED, "param5 is 91"),
    ("DO_ORBIT", "air", (40, 14, NAN, NAN, LAT, LON, INF), DENIED, "param7 is inf"),
    ("DO_SET_MODE", "air", (1, 4, 8), DENIED, "FOLLOW_TARGET is not available"),
    ("DO_CHANGE_ALTITUDE", "air", (12.0, RELATIVE), ACCEPTED, ""),
    ("DO_CHANGE_ALTITUDE", "air", (12.0, LOCAL), DENIED, "param2 is 1"),
    ("DO_CHANGE_ALTITUDE", "air", (NAN, RELATIVE), DENIED, "param1 is nan"),
    ("DO_CHANGE_ALTITUDE", "air", (1e6, RELATIVE), DENIED, "Height denied: param1 is 1e+06"),
    ("DO_CHANGE_ALTITUDE", "ground", (12.0, RELATIVE), REJECTED, "not in the air"),
    ("DO_FENCE_ENABLE", "air", (0,), ACCEPTED, "Fence off until disarmed"),
    ("DO_FENCE_ENABLE", "air", (1,), ACCEPTED, "Fence in force"),
    ("DO_FENCE_ENABLE", "air", (2,), DENIED, "param1 is 2, not 0 or 1 (enable)"),
    ("CONDITION_YAW", "air", (90,), ACCEPTED, ""),
    ("CONDITION_YAW", "ground", (90,), REJECTED, "Turn refused: not holding in the hover"),
    ("CONDITION_YAW", "air", (90, 400), DENIED, "param2 is 400"),
    ("CONDITION_DELAY", "air", (3,), UNSUPPORTED, "CONDITION_DELAY is an item of missions alone"),
    ("CONDITION_DISTANCE", "air", (3,), UNSUPPORTED, "CONDITION_DISTANCE is an item of missions alone"),
    ("DO_SET_ROI_LOCATION", "air", (*(NAN,) * 4, LAT + 1e-3, LON, 150.0), ACCEPTED, ""),
    ("DO_SET_ROI_LOCATION", "air", (), DENIED, "DO_SET_ROI_LOCATION denied: no position"),
    ("DO_SET_ROI", "air", (3, NAN, NAN, NAN, LAT + 1e-3, LON, 150.0), ACCEPTED, ""),
    ("DO_SET_ROI", "air", (0,), ACCEPTED, ""),
    ("DO_SET_ROI", "air", (3,), DENIED, "DO_SET_ROI denied: no position"),
    ("DO_SET_ROI_WPNEXT_OFFSET", "air", (), ACCEPTED, ""),
    ("DO_SET_ROI_NONE", "air", (), ACCEPTED, ""),
    ("DO_MOUNT_CONFIGURE", "ground", (2,), ACCEPTED, ""),
    ("DO_MOUNT_CONTROL", "ground", (-90, 0, 0, 0, 0, 0, 2), ACCEPTED, ""),
    ("DO_MOUNT_CONTROL", "ground", (-90, 0, 0, 0, 0, 0, 4), DENIED, "param7 is 4, not 0, 1 or 2 (MAV_MOUNT_MODE)"),
    ("DO_GIMBAL_MANAGER_PITCHYAW", "ground", (-90, 0), ACCEPTED, ""),
    ("DO_GIMBAL_MANAGER_CONFIGURE", "ground", (), ACCEPTED, ""),
    ("DO_SET_CAM_TRIGG_DIST", "ground", (25, 0, 1), ACCEPTED, ""),
    ("DO_SET_CAM_TRIGG_DIST", "ground", (-1,), DENIED, "param1 is -1"),
    ("DO_SET_CAM_TRIGG_INTERVAL", "ground", (2000,), ACCEPTED, ""),
    ("SET_CAMERA_MODE", "ground", (0, 2), ACCEPTED, ""),
    ("IMAGE_START_CAPTURE", "ground", (0, 1, 2), ACCEPTED, ""),
    ("IMAGE_START_CAPTURE", "ground", (2, 1, 2), DENIED, "param1 is 2, not 0 or 1 (camera)"),
    ("IMAGE_STOP_CAPTURE", "ground", (), ACCEPTED, ""),
    ("VIDEO_START_CAPTURE", "ground", (), ACCEPTED, ""),
    ("VIDEO_STOP_CAPTURE", "ground", (), ACCEPTED, ""),
    ("DO_DIGICAM_CONTROL", "ground", (), ACCEPTED, ""),
    ("DO_ORBIT", "ground", (), REJECTED, "not in the air"),
    ("DO_FLIGHTTERMINATION", "air", (1,), UNSUPPORTED, "forced disarm"),
    ("RUN_PREARM_CHECKS", "ground", (), ACCEPTED, "Pre-arm: ready"),
    ("RUN_PREARM_CHECKS", "armed", (), REJECTED, "already armed"),
    ("PREFLIGHT_STORAGE", "ground", (0, 0, 0), ACCEPTED, ""),
    ("PREFLIGHT_STORAGE", "air", (1, -1, -1), ACCEPTED, ""),
    ("PREFLIGHT_STORAGE", "ground", (3,), DENIED, "param1 is 3"),
    ("PREFLIGHT_STORAGE", "ground", (INF,), DENIED, "param1 is inf"),
    ("PREFLIGHT_STORAGE", "ground", (0, 2), DENIED, "MISSION_CLEAR_ALL"),
    ("PREFLIGHT_STORAGE", "ground", (0, 0, 10), DENIED, "param3 is 10"),
    ("PREFLIGHT_STORAGE", "armed", (2,), REJECTED, "disarm first"),
    ("PREFLIGHT_REBOOT_SHUTDOWN", "ground", (0,), ACCEPTED, ""),
    ("PREFLIGHT_REBOOT_SHUTDOWN", "ground", (3,), DENIED, "param1 is 3"),
    ("PREFLIGHT_REBOOT_SHUTDOWN", "ground", (NAN,), DENIED, "param1 is nan"),
    ("PREFLIGHT_REBOOT_SHUTDOWN", "armed", (1,), REJECTED, "disarm first"),
    ("PREFLIGHT_REBOOT_SHUTDOWN", "air", (2,), REJECTED, "disarm first"),
    ("DO_GRIPPER", "ground", (), UNSUPPORTED, "DO_GRIPPER is not supported"),
]
# The same of COMMAND_INT, whose frame matters: command, state, frame, p1..p4, (x, y, z).
PLACE = (round(LAT * 1e7), round(LON * 1e7), HIGH)
OPEN = (NAN,) * 4
PLACED_ANSWERS = [
    ("DO_REPOSITION", "air", RELATIVE, OPEN, PLACE, ACCEPTED, ""),
    ("DO_REPOSITION", "air", LOCAL, OPEN, (0, 0, HIGH), FRAME_UNSUPPORTED, "Frame 1"),
    ("DO_REPOSITION", "air", 77, OPEN, PLACE, FRAME_UNSUPPORTED, "Frame 77"),
    ("DO_REPOSITION", "air", RELATIVE, (15.0, *OPEN[1:]), PLACE, DENIED, "15 m/s"),
    ("DO_REPOSITION", "air", RELATIVE, (-1.0, *OPEN[1:]), PLACE, ACCEPTED, ""),
    ("DO_REPOSITION", "air", RELATIVE, (*OPEN[:3], INF), PLACE, DENIED, "param4 is inf"),
    ("DO_REPOSITION", "air", RELATIVE, OPEN, (2**31 - 1, PLACE[1], HIGH), DENIED, "not valid"),
    ("DO_REPOSITION", "air", RELATIVE, OPEN, (2**31 - 1, 2**31 - 1, HIGH), ACCEPTED, ""),
    ("DO_REPOSITION", "air", RELATIVE, OPEN, (910_000_000, 0, HIGH), DENIED, "param5 is 91"),
    ("DO_REPOSITION", "air", RELATIVE, OPEN, (*PLACE[:2], INF), DENIED, "param7 is inf"),
    ("DO_REPOSITION", "air", RELATIVE, OPEN, (0, 0, HIGH), DENIED, "arena"),
    ("DO_REPOSITION", "ground", RELATIVE, OPEN, PLACE, REJECTED, "not in the air"),
    ("DO_ORBIT", "air", LOCAL, OPEN, (0, 0, HIGH), FRAME_UNSUPPORTED, "Frame 1"),
    ("NAV_TAKEOFF", "armed", LOCAL, OPEN, (0, 0, 5.0), FRAME_UNSUPPORTED, "Frame 1"),
    ("NAV_TAKEOFF", "armed", RELATIVE, OPEN, (0, 0, 5.0), ACCEPTED, ""),
    ("COMPONENT_ARM_DISARM", "ground", LOCAL, (1.0, *OPEN[1:]), (0, 0, NAN), ACCEPTED, ""),  # no place: no frame
]


def station_of(state, folder):
    bench = Bench(folder, up=HIGH if state == "air" else 0.0)
    station = bench.station()
    if state == "armed":
        assert station.command(C["COMPONENT_ARM_DISARM"], 1) == ACCEPTED
    station.heard.clear()
    return station


def image(station):
    """State that a refusal must not change."""
    a, aircraft = station.bench.autopilot, station.bench.aircraft
    mission = None if a.mission is None else (a.mission.items, a.mission.current)
    return (
        a.mode,
        a.armed,
        a.flying,
        a.transitions.under_way,
        mission,
        a.world,
        aircraft.configuration,
        a.reference,
        station.bench.node.exit_request,
    )


def answers(station, command):
    return [m.result for m in station.heard if m.get_type() == "COMMAND_ACK" and m.command == command]


def check(station, command, before, result, word):
    assert answers(station, command) == [result]
    assert word in station.texts()
    if result in {ACCEPTED, IN_PROGRESS}:
        return
    assert word
    assert station.texts().count(word) == 1
    assert image(station) == before


@pytest.mark.parametrize(("name", "state", "params", "result", "word"), ANSWERS)
def test_each_command_is_answered_as_its_definition_says(tmp_path, name, state, params, result, word):
    station = station_of(state, tmp_path)
    before = image(station)
    station.command(C[name], *params)
    check(station, C[name], before, result, word)


@pytest.mark.parametrize(("name", "state", "frame", "params", "place", "result", "word"), PLACED_ANSWERS)
def test_a_place_is_understood_in_its_frame_or_refused(tmp_path, name, state, frame, params, place, result, word):
    station = station_of(state, tmp_path)
    before = image(station)
    station.send(mavlink.MAVLink_command_int_message(1, 1, frame, C[name], 0, 0, *params, *place))
    check(station, C[name], before, result, word)


def test_every_command_has_its_row():
    told = {C[name] for name, *_ in (*ANSWERS, *PLACED_ANSWERS)}
    elsewhere = {C["DO_SET_HOME"], 611}  # tests/sitl/mavlink/test_home.py
    assert {*commands.HANDLERS, *MAINTENANCE} - told == elsewhere


def test_failing_pre_arm_checks_are_reported_one_by_one(tmp_path):
    station = station_of("ground", tmp_path)
    vehicle = station.bench.aircraft.vehicle
    vehicle._arrays.flights["energy"] = 95e3  # of 100 kJ used
    station.bench.advance(0.1)
    assert station.command(C["RUN_PREARM_CHECKS"]) == ACCEPTED
    assert "Pre-arm: battery" in station.texts()
    assert "ready" not in station.texts()


def test_a_reset_to_the_defaults_is_reported_and_stored(tmp_path):
    station = station_of("ground", tmp_path)
    for name, value in ((b"MIS_TAKEOFF_ALT", 7.0), (b"SIM_WIND_SPD", 2.0)):
        station.send(mavlink.MAVLink_param_set_message(1, 1, name, value, mavlink.MAV_PARAM_TYPE_REAL32))
    station.heard.clear()
    assert station.command(C["PREFLIGHT_STORAGE"], 2) == ACCEPTED
    told = {m.param_id: m.param_value for m in station.heard if m.get_type() == "PARAM_VALUE"}
    assert told == {"MIS_TAKEOFF_ALT": 2.5, "SIM_WIND_SPD": 0.0}
    assert "defaults" in station.texts()
    again = station_of("ground", tmp_path)
    assert again.bench.aircraft.configuration.settings.takeoff_altitude == 2.5


@pytest.mark.parametrize(
    ("action", "exit_request", "word"), [(1, "REBOOT", "Rebooting"), (2, "SHUTDOWN", "Shutting down")]
)
def test_a_reboot_or_shutdown_is_acknowledged_before_it_happens(tmp_path, action, exit_request, word):
    station = station_of("ground", tmp_path)
    assert station.command(C["PREFLIGHT_REBOOT_SHUTDOWN"], action, 1, 1) == ACCEPTED
    assert word in station.texts()
    assert station.bench.node.exit_request.name == exit_request


def test_a_rebooted_vehicle_speaks_to_its_former_peers(tmp_path):
    bench = Bench(tmp_path / "first")
    bench.station(key="learnt").beat()
    again = Bench(tmp_path / "again").node
    again.know(bench.node.peers)
    assert {peer for peer, _ in again.datagrams(10.0)} == {PEER, "learnt"}


def test_a_reboot_in_a_fall_is_refused(tmp_path):
    station = station_of("air", tmp_path)
    assert station.command(C["COMPONENT_ARM_DISARM"], 0, FORCE_ARM_DISARM) == ACCEPTED
    assert station.bench.aircraft.view().law is not Law.LANDED
    assert station.command(C["PREFLIGHT_REBOOT_SHUTDOWN"], 1) == REJECTED
    assert "not on the ground" in station.texts()


KNOWN = sorted({*commands.HANDLERS, *MAINTENANCE})
NUMBERS = st.one_of(
    st.sampled_from(
        [NAN, INF, -INF, 0.0, -0.0, 1.0, 2.0, 3.0, 4.0, 6.0, -1.0, -2.0, 15.0, 40.0, 21196.0, LAT, LON, 1e30]
    ),
    st.floats(width=32),
)
INTEGERS = st.one_of(st.sampled_from([0, 1, *PLACE[:2], 2**31 - 1, -(2**31)]), st.integers(-(2**31), 2**31 - 1))
COMMANDS = st.one_of(st.sampled_from(KNOWN), st.sampled_from(KNOWN), st.integers(0, 65535))
ORDERS = st.one_of(
    st.builds(
        lambda command, params: mavlink.MAVLink_command_long_message(1, 1, command, 0, *params),
        COMMANDS,
        st.tuples(*[NUMBERS] * 7),
    ),
    st.builds(
        lambda command, frame, params, x, y, z: mavlink.MAVLink_command_int_message(
            1, 1, frame, command, 0, 0, *params, x, y, z
        ),
        COMMANDS,
        st.integers(0, 255),
        st.tuples(*[NUMBERS] * 4),
        INTEGERS,
        INTEGERS,
        NUMBERS,
    ),
)


@pytest.mark.long
@settings(
    max_examples=120, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(state=st.sampled_from(["ground", "armed", "air"]), order=ORDERS)
def test_every_command_gets_one_answer_and_a_refusal_changes_nothing(tmp_path_factory, state, order):
    station = station_of(state, tmp_path_factory.mktemp("any"))
    before = image(station)
    station.send(order)
    (result,) = answers(station, order.command)
    assert result in FINAL | {IN_PROGRESS}
    if result not in {ACCEPTED, IN_PROGRESS}:
        assert image(station) == before
        assert station.texts() or order.command in STREAM_COMMANDS  # clients try out what messages there are
    station.bench.advance(0.1)  # and it still flies
    assert len(answers(station, order.command)) == 1 or result == IN_PROGRESS


# MAV_CMD_INJECT_FAILURE as a COMMAND_LONG: what is answered, what fails, and what heals.
#
# https://mavlink.io/en/messages/common.html#MAV_CMD_INJECT_FAILURE


INJECT = mavlink.MAV_CMD_INJECT_FAILURE
UNSUPPORTED = 3
GYRO, MAG, GPS, VIO = (
    mavlink.FAILURE_UNIT_SENSOR_GYRO,
    mavlink.FAILURE_UNIT_SENSOR_MAG,
    mavlink.FAILURE_UNIT_SENSOR_GPS,
    mavlink.FAILURE_UNIT_SENSOR_VIO,
)
BATTERY, MOTOR, SERVO, LINK = (
    mavlink.FAILURE_UNIT_SYSTEM_BATTERY,
    mavlink.FAILURE_UNIT_SYSTEM_MOTOR,
    mavlink.FAILURE_UNIT_SYSTEM_SERVO,
    mavlink.FAILURE_UNIT_SYSTEM_MAVLINK_SIGNAL,
)


def station(folder, navigation=Navigation.TRUTH, *, enabled=True, up=10.0):
    vehicle = Simulation(load("collage").parameters, start=Start(up=up, airborne=True), navigation=navigation)
    configuration = Configuration(Settings(failure_injection=int(enabled)), vehicle.tuning, WorldSettings())
    aircraft = Aircraft(vehicle, World(FRAME, ARENAS["open"]), configuration, airborne=True)
    return FakeStation.with_vehicle(folder, aircraft=aircraft)


def test_nothing_fails_unless_the_parameter_allows_it(tmp_path):
    ground = station(tmp_path, enabled=False)
    assert ground.command(INJECT, MOTOR, OFF, 1) == DENIED
    assert "set SYS_FAILURE_EN to 1" in ground.texts()
    ground.set_parameter("SYS_FAILURE_EN", 1)
    assert ground.command(INJECT, MOTOR, STUCK, 1) == ACCEPTED


@pytest.mark.parametrize(
    ("params", "result", "text"),
    [
        ((MOTOR, OFF, 3), DENIED, "there is no motor 3"),
        ((MOTOR, OFF, -1), DENIED, "there is no motor -1"),
        ((BATTERY, OFF, 2), DENIED, "there is no battery 2"),
        ((MOTOR, 8), DENIED, "8 is not a FAILURE_TYPE"),
        ((55, OFF), DENIED, "55 is not a FAILURE_UNIT"),
        ((math.nan, OFF), DENIED, "param1 is nan, not a whole number from 0 to 65535 (FAILURE_UNIT)"),
        ((MOTOR, math.inf), DENIED, "param2 is inf, not a whole number from 0 to 255 (FAILURE_TYPE)"),
        ((MOTOR, 1.5), DENIED, "param2 is 1.5, not a whole number"),
        ((MOTOR, WRONG), UNSUPPORTED, "motor wrong"),
        ((BATTERY, STUCK), UNSUPPORTED, "battery stuck"),
        ((LINK, STUCK), UNSUPPORTED, "link stuck"),
        ((GYRO, OFF), UNSUPPORTED, "navigation by truth does not read the gyroscope"),
        ((mavlink.FAILURE_UNIT_SENSOR_OPTICAL_FLOW, OFF), UNSUPPORTED, "no optical flow"),
        ((mavlink.FAILURE_UNIT_SYSTEM_RC_SIGNAL, OFF), UNSUPPORTED, "no radio control"),
    ],
)
def test_what_cannot_fail_is_refused_with_the_reason(tmp_path, params, result, text):
    ground = station(tmp_path)
    assert ground.command(INJECT, *params) == result
    assert text in ground.texts()
    assert ground.vehicle.faults == type(ground.vehicle.faults)()


def test_instances_are_left_and_right_and_none_is_both(tmp_path):
    ground = station(tmp_path)
    assert ground.command(INJECT, SERVO, STUCK, 2) == ACCEPTED
    assert (ground.vehicle.faults.left_elevon, ground.vehicle.faults.right_elevon) == (0, STUCK)
    assert ground.command(INJECT, SERVO, 0, 0) == ACCEPTED
    assert ground.command(INJECT, MOTOR, STUCK) == ACCEPTED
    assert ground.vehicle.faults[:4] == (STUCK, STUCK, 0, 0)
    ground.advance(0.1)
    assert "Healed: elevons" in ground.texts()
    assert "Failure injected: motors stuck" in ground.texts()


def test_an_instrument_fails_where_it_is_read(tmp_path):
    ground = station(tmp_path / "outdoors", Navigation.SENSORS)
    assert ground.command(INJECT, GPS, OFF) == ACCEPTED
    assert ground.vehicle.avionics.instruments["failures"][GNSS] == OFF
    assert ground.command(INJECT, VIO, OFF) == UNSUPPORTED
    assert ground.command(INJECT, GPS, 0) == ACCEPTED
    assert ground.vehicle.avionics.instruments["failures"][GNSS] == 0
    arena = station(tmp_path / "arena", Navigation.MOCAP, up=2.0)
    assert arena.command(INJECT, VIO, OFF) == ACCEPTED
    assert arena.command(INJECT, MAG, OFF) == UNSUPPORTED


def test_a_battery_that_fails_makes_the_vehicle_land_and_a_wrong_one_reads_less(tmp_path):
    ground = station(tmp_path)
    full = ground.bench.aircraft.battery
    assert ground.command(INJECT, BATTERY, WRONG) == ACCEPTED
    assert full.remaining - ground.bench.aircraft.battery.remaining == pytest.approx(MISREAD, abs=1e-3)
    assert ground.command(INJECT, BATTERY, OFF) == ACCEPTED
    sagged = ground.bench.aircraft.battery
    assert sagged.remaining == pytest.approx(LEFT_AFTER_SAG)
    assert full.voltage() - sagged.voltage() > LOST_CELL
    ground.advance(1.5)
    assert ground.autopilot.landing
    assert ground.command(INJECT, BATTERY, 0) == ACCEPTED
    assert ground.bench.aircraft.battery.remaining > 0.9


@pytest.mark.long
def test_a_link_that_is_off_answers_once_then_nothing_and_comes_back_in_its_time(tmp_path):
    ground = station(tmp_path)
    ground.set_parameter("SIM_LINK_OFF_T", 3)
    assert ground.command(INJECT, LINK, OFF) == ACCEPTED
    ground.heard.clear()
    ground.advance(2.9)
    ground.send(mavlink.MAVLink_command_long_message(1, 1, mavlink.MAV_CMD_NAV_LAND, 0, *(0.0,) * 7))
    assert not ground.heard
    assert not ground.autopilot.landing
    ground.advance(0.3)
    assert "Link is back" in ground.texts()
    assert ground.command(mavlink.MAV_CMD_NAV_LAND) == ACCEPTED


def test_a_vehicle_that_tumbles_says_so_and_is_not_armed_again(tmp_path):
    ground = station(tmp_path, up=60.0)
    assert ground.command(INJECT, MOTOR, OFF, 1) == ACCEPTED
    ground.bench.advance_until(lambda: ground.autopilot.terminated, 5.0)
    ground.advance(0.1)
    assert "Motors cut: tumbling at" in ground.texts()
    assert ground.last("HEARTBEAT").system_status == mavlink.MAV_STATE_FLIGHT_TERMINATION
    assert not ground.last("HEARTBEAT").base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED
    assert ground.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1, 21196) == 1
    assert "flight terminated (Tumbling at" in ground.texts()


def test_every_other_station_is_told_who_commanded_a_flight_and_the_one_itself_is_not(tmp_path):
    first = FakeStation.with_vehicle(tmp_path)
    second = FakeStation(first.bench, system=254, key="other")
    second.send(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3))
    first.advance(0.1)
    second.command(C["COMPONENT_ARM_DISARM"], 1)
    second.command(C["REQUEST_MESSAGE"], mavlink.MAVLINK_MSG_ID_HOME_POSITION)
    first.advance(0.1)
    told = "Ground station 254 commanded: arm"
    assert first.texts().count(told) == first.texts().count("commanded") == 1
    assert "commanded" not in second.texts()
    first.command(C["COMPONENT_ARM_DISARM"], 0)
    assert second.texts().endswith("Ground station 255 commanded: disarmDisarmed")
