"""Sensor messages of a vehicle on sensors: its receiver, its pressures, its bits of SYS_STATUS, its truth."""

import math

import pytest

from protocol.dialect import mavlink
from sitl.autopilot.settings import Settings
from sitl.autopilot.world import ARENAS, World
from sitl.mavlink.telemetry import sensor_messages
from sitl.mavlink.telemetry.recent_means import inertial_mean
from sitl.mavlink.telemetry.sensor_messages import static_pressure
from sitl.model.airframe_files import load
from sitl.model.vectors import Vector
from sitl.sensors.instruments import BAROMETER, GNSS, OFF
from sitl.simulation.avionics import Navigation
from sitl.simulation.simulation import Simulation
from sitl.simulation.start import Start
from sitl.simulation.tuning import Tuning
from sitl.vehicle.aircraft import AUTOPILOT_PERIODS, Aircraft
from sitl.vehicle.parameters import Configuration, WorldSettings
from tests.support.vehicle.fake_station import FRAME, HOME, FakeStation

REQUEST, INTERVAL = mavlink.MAV_CMD_REQUEST_MESSAGE, mavlink.MAV_CMD_SET_MESSAGE_INTERVAL
GPS, MAG, BARO = (
    mavlink.MAV_SYS_STATUS_SENSOR_GPS,
    mavlink.MAV_SYS_STATUS_SENSOR_3D_MAG,
    mavlink.MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE,
)
POSE, AHRS = mavlink.MAV_SYS_STATUS_SENSOR_VISION_POSITION, mavlink.MAV_SYS_STATUS_AHRS
PREARM, INERTIAL = mavlink.MAV_SYS_STATUS_PREARM_CHECK, 0b11


def boot(folder, navigation, **options):
    return FakeStation.with_vehicle(folder, navigation=navigation, **{"aligned": False, **options})


@pytest.fixture(scope="module")
def flying(tmp_path_factory):
    station = boot(tmp_path_factory.mktemp("state"), Navigation.SENSORS, up=9.0, aligned=True)
    station.advance(3.0)
    return station


@pytest.fixture(scope="module")
def arena(tmp_path_factory):
    station = boot(tmp_path_factory.mktemp("state"), Navigation.MOCAP)
    station.advance(3.0)
    return station


def ask(station, name):
    station.heard.clear()
    number = getattr(mavlink, f"MAVLINK_MSG_ID_{name}")
    assert station.command(REQUEST, number) == mavlink.MAV_RESULT_ACCEPTED
    return station.last(name)


def test_gps_raw_int_is_a_reading_of_the_receiver(flying):
    told, truth = ask(flying, "GPS_RAW_INT"), ask(flying, "HIL_STATE_QUATERNION")
    assert told.fix_type == mavlink.GPS_FIX_TYPE_3D_FIX
    north, height = (told.lat - truth.lat) * 0.0111, (told.alt - truth.alt) * 1e-3
    assert 0.0 < math.hypot(north, height) < 3.0  # [m]; not the truth
    spec = flying.vehicle.avionics.sensors.gnss
    assert told.v_acc == pytest.approx(1e3 * math.hypot(spec.noise_up, spec.drift_up), abs=1.0)
    assert told.h_acc > 0
    assert told.vel_acc > 0
    assert (told.eph, told.satellites_visible) == (65535, 255)


def test_scaled_pressure_and_highres_imu_are_of_the_barometer_s_height(flying):
    pressure, imu = ask(flying, "SCALED_PRESSURE"), ask(flying, "HIGHRES_IMU")
    here = static_pressure(flying.node.snapshot(), 9.0)
    assert pressure.press_abs == pytest.approx(here, abs=0.3)
    assert imu.abs_pressure == pytest.approx(here, abs=0.3)
    assert imu.pressure_alt == pytest.approx(HOME.alt + 9.0, abs=2.0)
    field = math.hypot(imu.xmag, imu.ymag, imu.zmag)
    assert field == pytest.approx(0.469, abs=0.05)  # [Gs]
    assert imu.fields_updated == 0b1_1111_1111 | 1 << 9 | 1 << 10 | 1 << 11


def test_static_pressure_is_that_of_the_standard_atmosphere(flying):
    snapshot = flying.node.snapshot()
    assert static_pressure(snapshot, -HOME.alt) == pytest.approx(1013.25)
    assert static_pressure(snapshot, 1000.0 - HOME.alt) == pytest.approx(898.75, abs=0.1)


def test_sys_status_tells_what_is_there_and_what_helps(flying):
    told = ask(flying, "SYS_STATUS")
    present, health = told.onboard_control_sensors_present, told.onboard_control_sensors_health
    for bit in (INERTIAL, GPS, MAG, BARO, AHRS):
        assert present & health & bit == bit
    assert not present & POSE


def test_a_lost_instrument_is_present_and_not_healthy_and_no_fix_is_told(tmp_path):
    station = boot(tmp_path, Navigation.SENSORS)
    station.advance(3.0)
    station.vehicle.avionics.instruments["failures"][[GNSS, BAROMETER]] = OFF
    station.advance(3.0)
    told = ask(station, "SYS_STATUS")
    assert told.onboard_control_sensors_present & (GPS | BARO) == GPS | BARO
    assert told.onboard_control_sensors_health & (GPS | BARO | MAG | AHRS | PREARM) == MAG
    fix = ask(station, "GPS_RAW_INT")
    assert (fix.fix_type, fix.lat, fix.vel) == (mavlink.GPS_FIX_TYPE_NO_FIX, 0, 65535)
    assert ask(station, "SCALED_PRESSURE") is None


def test_under_a_roof_there_is_no_receiver_but_motion_capture(arena):
    told = ask(arena, "SYS_STATUS")
    present, health = told.onboard_control_sensors_present, told.onboard_control_sensors_health
    assert present & health & (INERTIAL | POSE | AHRS | PREARM) == INERTIAL | POSE | AHRS | PREARM
    assert not present & (GPS | MAG | BARO)
    assert ask(arena, "GPS_RAW_INT").fix_type == mavlink.GPS_FIX_TYPE_NO_GPS
    assert arena.command(REQUEST, mavlink.MAVLINK_MSG_ID_SCALED_PRESSURE) != mavlink.MAV_RESULT_ACCEPTED


def test_before_it_is_aligned_a_vehicle_tells_no_pose_and_cannot_be_armed(tmp_path):
    station = boot(tmp_path, Navigation.SENSORS)
    station.advance(0.3)
    for name in ("ATTITUDE", "LOCAL_POSITION_NED", "GLOBAL_POSITION_INT", "ODOMETRY", "ALTITUDE"):
        assert ask(station, name) is None
    assert not ask(station, "SYS_STATUS").onboard_control_sensors_health & PREARM
    assert station.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1) == mavlink.MAV_RESULT_TEMPORARILY_REJECTED
    assert "Arming refused: aligning: keep still" in station.texts()
    station.advance(3.0)
    assert "Navigation: aligned" in station.texts()
    assert ask(station, "SYS_STATUS").onboard_control_sensors_health & PREARM
    assert ask(station, "ATTITUDE").pitch == pytest.approx(0.0, abs=0.1)
    assert station.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1) == mavlink.MAV_RESULT_ACCEPTED


def test_on_the_exact_state_there_is_what_stock_clients_need(tmp_path):
    station = FakeStation.with_vehicle(tmp_path)
    present = ask(station, "SYS_STATUS").onboard_control_sensors_present
    assert present & (INERTIAL | MAG | GPS) == INERTIAL | MAG | GPS
    assert not present & (BARO | POSE | AHRS)
    for message in (mavlink.MAVLINK_MSG_ID_ESTIMATOR_STATUS, mavlink.MAVLINK_MSG_ID_SCALED_PRESSURE):
        assert station.command(REQUEST, message) != mavlink.MAV_RESULT_ACCEPTED


def test_darko_truth_is_the_state_as_it_is_and_sent_only_when_asked_for(tmp_path):
    station = boot(tmp_path, Navigation.SENSORS, up=9.0, aligned=True)
    station.advance(2.0)
    assert station.all("DARKO_TRUTH") == []
    station.command(INTERVAL, mavlink.MAVLINK_MSG_ID_DARKO_TRUTH, 100_000)
    station.advance(1.0)
    assert len(station.all("DARKO_TRUTH")) in {10, 11}
    told, body = ask(station, "DARKO_TRUTH"), station.vehicle.truth.body
    north, east, down = told.position
    assert (north, -east, -down) == pytest.approx(body.position, abs=1e-5)
    assert told.position != pytest.approx([ask(station, "ODOMETRY").to_dict()[k] for k in "xyz"], abs=1e-3)
    assert math.hypot(*told.q) == pytest.approx(1.0, abs=1e-6)
    assert told.time_usec == round(1e6 * station.vehicle.time)


# HIGHRES_IMU, SCALED_IMU and RAW_IMU, as MAVSDK's imu topics read them: hover frame FRD.


G = 9.81


@pytest.fixture(scope="module", params=[0.0, 3.0], ids=["standing", "hovering"])
def station(request, tmp_path_factory):
    station = FakeStation.with_vehicle(tmp_path_factory.mktemp("state"), up=request.param)
    station.advance(3.0)
    return station


def test_at_rest_only_the_weight_is_felt_and_it_points_up(station):
    told = station.last("HIGHRES_IMU")
    assert (told.xacc, told.yacc, told.zacc) == pytest.approx((0.0, 0.0, -G), abs=0.15)
    assert (told.xgyro, told.ygyro, told.zgyro) == pytest.approx((0.0, 0.0, 0.0), abs=0.02)
    assert told.time_usec == pytest.approx(1e6 * station.vehicle.time, abs=0.1e6)


@pytest.mark.parametrize("name", ["SCALED_IMU", "RAW_IMU"])
def test_the_scaled_ones_count_thousandths_of_g(station, name):
    told = station.last(name)
    assert (told.xacc, told.yacc, told.zacc) == pytest.approx((0, 0, -1000 * G / 9.80665), abs=15)
    assert max(abs(told.xgyro), abs(told.ygyro), abs(told.zgyro)) < 20


def test_what_no_sensor_measures_is_marked_so(station):
    told = station.last("HIGHRES_IMU")
    assert told.fields_updated == 0b11_1111
    assert all(math.isnan(getattr(told, name)) for name in ("xmag", "ymag", "zmag", "abs_pressure", "temperature"))


def test_rates_are_those_of_attitude(station):
    snapshot = station.node.snapshot()._replace(rates=Vector(0.3, 0.2, 0.1))
    told, scaled = sensor_messages.highres_imu(snapshot), sensor_messages.scaled_imu(snapshot)
    assert (told.xgyro, told.ygyro, told.zgyro) == (-0.1, -0.2, -0.3)
    assert (scaled.xgyro, scaled.ygyro, scaled.zgyro) == (-100, -200, -300)


def test_more_than_a_field_holds_is_its_limit(station):
    snapshot = station.node.snapshot()._replace(rates=Vector(-50.0, 0.0, 50.0))
    for message in (sensor_messages.scaled_imu(snapshot), sensor_messages.raw_imu(snapshot)):
        assert (message.xgyro, message.zgyro) == (-32767, 32767)


@pytest.mark.parametrize("name", ["HIGHRES_IMU", "SCALED_IMU", "RAW_IMU"])
def test_a_rate_can_be_asked_for(station, name):
    number = getattr(mavlink, f"MAVLINK_MSG_ID_{name}")
    assert station.command(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, number, 50_000.0) == mavlink.MAV_RESULT_ACCEPTED
    station.heard.clear()
    station.advance(1.0)
    assert len(station.all(name)) == pytest.approx(20, abs=1)


def test_a_vehicle_with_sensors_tells_what_they_read(tmp_path):
    start = Start(up=3.0, airborne=True)
    vehicle = Simulation(load("nominal").parameters, start=start, navigation=Navigation.SENSORS)
    configuration = Configuration(Settings(), Tuning(), WorldSettings())
    aircraft = Aircraft(vehicle, World(FRAME, ARENAS["open"]), configuration, airborne=True)
    station = FakeStation.with_vehicle(tmp_path, aircraft=aircraft)
    station.advance(1.0)
    told = sensor_messages.highres_imu(station.node.snapshot())
    read = inertial_mean(vehicle.avionics, vehicle.periods, AUTOPILOT_PERIODS).reading
    forward, left, up = read.force
    assert (told.xacc, told.yacc, told.zacc) == (-up, -left, -forward)
    assert -told.zacc == pytest.approx(G, abs=1.0)
    rolling, pitching, yawing = read.rates
    assert (told.xgyro, told.ygyro, told.zgyro) == (-yawing, -pitching, -rolling)
    assert told.time_usec == round(1e6 * (vehicle.time - 0.01))
