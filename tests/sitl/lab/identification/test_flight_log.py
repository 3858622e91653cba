"""Sensors out of logs: every standard message says the same, and what is missing is said."""

import math

import numpy as np
import pytest

from protocol.dialect import mavlink
from protocol.frames import SHOW_PITCHED_UP, Geodetic, LocalFrame, displayed, euler_from_quaternion
from protocol.tlog import TlogWriter
from protocol.wire.codec import Codec
from sitl.errors import SitlError
from sitl.lab.identification import rotations
from sitl.lab.identification.flight_log import LogConventions, read_flight
from sitl.model.airframe_files import load
from tests.support import foreign_logs
from tests.support.logs import quadplane_path
from tests.support.paths import DATA

COLLAGE = load("collage").parameters
BEGIN = 1_760_000_000_000_000
Q = (0.8, 0.0, 0.6, 0.0)
ORIGIN = Geodetic(43.5, 1.5, 150.0)
COMMAND = (500.0, 550.0, 0.1, -0.2)


def highres(ms):
    return mavlink.MAVLink_highres_imu_message(
        1000 * ms, 1.0, 2.0, -3.0, 0.1, 0.2, -0.3, 0, 0, 0, 0, 0, 0, 0, fields_updated=63
    )


def scaled(ms):
    force = [round(1e3 * x / 9.80665) for x in (1.0, 2.0, -3.0)]
    return mavlink.MAVLink_scaled_imu_message(ms, *force, 100, 200, -300, 0, 0, 0)


def raw(ms):
    force = [round(1e3 * x / 9.80665) for x in (1.0, 2.0, -3.0)]
    return mavlink.MAVLink_raw_imu_message(1000 * ms, *force, 100, 200, -300, 0, 0, 0)


def actuators(ms):
    return mavlink.MAVLink_darko_actuators_message(
        ms, [math.nan] * 2, COMMAND[:2], [math.nan] * 2, [math.nan] * 2, COMMAND[2:], 200.0, 850.0, 0.5, 0, 0
    )


def outputs(ms):
    values = [COMMAND[0] / COLLAGE.omega_max, COMMAND[1] / COLLAGE.omega_max]
    values += [angle / COLLAGE.delta_max for angle in COMMAND[2:]]
    return mavlink.MAVLink_actuator_output_status_message(1000 * ms, 4, values + [0.0] * 28)


def servos(ms):
    """Right elevon on 1, reversed; left one on 2; motors on 5 and 7."""
    elevons = [round(1500 + 500 * angle / COLLAGE.delta_max) for angle in (0.2, 0.1)]
    motors = [round(1000 + 1000 * speed / COLLAGE.omega_max) for speed in COMMAND[:2]]
    return mavlink.MAVLink_servo_output_raw_message(1000 * ms, 0, *elevons, 0, 0, motors[0], 0, motors[1], 0)


def attitude_quaternion(ms):
    return mavlink.MAVLink_attitude_quaternion_message(ms, *Q, 0.0, 0.0, 0.0)


def attitude(ms):
    return mavlink.MAVLink_attitude_message(ms, *euler_from_quaternion(Q), 0.0, 0.0, 0.0)


def odometry(ms):
    unknown = [math.nan] * 21
    return mavlink.MAVLink_odometry_message(1000 * ms, 1, 12, 0, 0, 0, Q, 0, 0, 0, 0, 0, 0, unknown, unknown, 0, 0, 0)


def local(ms):
    return mavlink.MAVLink_local_position_ned_message(ms, 4e-3 * ms, 5.0, -6.0, 4.0, 0.0, 0.0)


def geodetic(ms):
    here = LocalFrame(ORIGIN).to_geodetic((4e-3 * ms, 5.0, -6.0))
    lat, lon, alt = round(1e7 * here.lat_deg), round(1e7 * here.lon_deg), round(1e3 * here.alt)
    return mavlink.MAVLink_global_position_int_message(ms, lat, lon, alt, 0, 400, 0, 0, 0)


def written(folder, makers, *, seconds=2.0, shift_ms=None, rate=100):
    """A log in which each message comes 100 times a second, some of them with clocks of their own [ms]."""
    path, codec = folder / "log.tlog", Codec(1, 1)
    with TlogWriter.open(path) as writer:
        for ms in range(0, round(1e3 * seconds), 1000 // rate):
            for make in makers:
                own = ms + 1000 + (shift_ms or {}).get(make, 0)
                writer.write(BEGIN + 1000 * ms, codec.encode(make(own)))
    return path


@pytest.mark.parametrize("imu", [highres, scaled, raw])
@pytest.mark.parametrize("output", [actuators, outputs, servos])
@pytest.mark.parametrize("orientation", [attitude_quaternion, attitude, odometry])
@pytest.mark.parametrize("place", [local, geodetic])
def test_all_messages_say_the_same(tmp_path, imu, output, orientation, place):
    record = read_flight(
        written(tmp_path, (imu, output, orientation, place), seconds=0.2),
        LogConventions((5, 7, 2, -1) if output is servos else None, COLLAGE, hover_frame=False),
    )
    assert record.imu.values[3] == pytest.approx([0.1, -0.2, 0.3, 1.0, -2.0, 3.0], abs=0.006)
    assert record.commands.values[3] == pytest.approx(COMMAND, rel=0.005, abs=0.001)
    assert record.attitude.values[3] == pytest.approx([0.8, 0.0, -0.6, 0.0], abs=1e-6)
    moved = record.motion.values[10] - record.motion.values[0]
    assert moved == pytest.approx([0.4, 0.0, 0.0, 0.0, 0.0, 0.0], abs=0.015)
    assert record.motion.values[3, 3:] == pytest.approx([4.0, 0.0, 0.0], abs=0.01)
    assert record.imu.time == pytest.approx(np.arange(20) * 0.01, abs=1e-9)


def test_the_hover_frame_is_turned_into_that_of_forward_flight(tmp_path):
    path = written(tmp_path, (highres, actuators, attitude_quaternion, local), seconds=0.2)
    told, turned = (read_flight(path, LogConventions(None, COLLAGE, frame)) for frame in (False, True))
    for field in ("imu", "attitude"):
        assert len(getattr(turned, field).values) == 20
    assert turned.imu.values[0] == pytest.approx([0.3, -0.2, -0.1, 3.0, -2.0, -1.0], abs=1e-6)
    q, w, force = turned.attitude.values[:1], turned.imu.values[0, :3], turned.imu.values[0, 3:]
    before = rotations.matrices(told.attitude.values[:1])[0]
    assert rotations.matrices(q)[0] @ w == pytest.approx(before @ told.imu.values[0, :3])
    assert rotations.matrices(q)[0] @ force == pytest.approx(before @ told.imu.values[0, 3:])
    assert displayed(Q, SHOW_PITCHED_UP) == pytest.approx(q[0] * [1.0, 1.0, -1.0, -1.0])


def test_clocks_that_differ_are_aligned_and_repeated_samples_left_out(tmp_path):
    makers = (highres, highres, actuators, attitude, local)
    path = written(tmp_path, makers, shift_ms={actuators: 3_600_000, local: 40})
    record = read_flight(path, LogConventions(None, COLLAGE))
    assert len(record.imu.time) == 200
    assert record.commands.time[0] == pytest.approx(0.0, abs=1e-3)
    assert record.motion.time[0] == pytest.approx(0.04, abs=1e-3)  # of the same clock, only late


def test_the_message_that_comes_often_enough_is_taken(tmp_path):
    path, codec = tmp_path / "log.tlog", Codec(1, 1)
    with TlogWriter.open(path) as writer:
        for ms in range(0, 1000, 10):
            made = [raw(ms), actuators(ms), attitude(ms), local(ms)] + ([highres(ms)] if ms % 50 == 0 else [])
            for message in made:
                writer.write(BEGIN + 1000 * ms, codec.encode(message))
    assert read_flight(path, LogConventions(None, COLLAGE)).sources[0] == "RAW_IMU"


@pytest.mark.parametrize(
    ("makers", "words"),
    [
        ((actuators, attitude, local), "no IMU (HIGHRES_IMU, SCALED_IMU, SCALED_IMU2, SCALED_IMU3, RAW_IMU)"),
        ((highres, attitude, local), "no actuator outputs (DARKO_ACTUATORS, ACTUATOR_OUTPUT_STATUS)"),
        ((highres, servos, attitude, local), "SERVO_OUTPUT_RAW takes --channels, the outputs of left motor"),
        ((highres, actuators), "no attitude (ATTITUDE_QUATERNION, ODOMETRY, ATTITUDE); no position and velocity"),
    ],
)
def test_what_is_missing_is_said(tmp_path, makers, words):
    with pytest.raises(SitlError, match="cannot identify from this log") as error:
        read_flight(written(tmp_path, makers), LogConventions(None, COLLAGE))
    assert words in str(error.value)


def test_what_comes_too_seldom_is_said(tmp_path):
    path = written(tmp_path, (highres, actuators, attitude, local), rate=5)
    with pytest.raises(SitlError, match=r"IMU at 5.0 Hz \(HIGHRES_IMU\), must be 8 Hz; actuator outputs at 5.0 Hz"):
        read_flight(path, LogConventions(None, COLLAGE))


@pytest.mark.parametrize("name", ["square.plan", "nowhere.tlog"])
def test_what_is_no_log_is_refused(name):
    with pytest.raises(SitlError, match=name):
        read_flight(DATA / name, LogConventions(None, COLLAGE))


@pytest.mark.parametrize("channels", [None, (1, 2, 3, 4)])
def test_a_log_of_another_autopilot_says_what_it_lacks(channels):
    with pytest.raises(SitlError, match=r"IMU at 4.2 Hz \(SCALED_IMU2\), must be 8 Hz; .*actuator outputs"):
        read_flight(quadplane_path(), LogConventions(channels, COLLAGE))


@pytest.mark.parametrize("kind", ["ulog", "dataflash", "paparazzi"])
def test_a_log_of_another_format_is_read(tmp_path, kind):
    """Attitude and IMU of a hover frame; outputs and pulses of full scale at the airframe's limits."""
    path = foreign_logs.write_pair(tmp_path)
    if kind != "paparazzi":
        path.write_bytes(getattr(foreign_logs, kind)())
    channels = None if kind == "ulog" else (1, 2, 3, -4)
    record = read_flight(path, LogConventions(channels, COLLAGE, hover_frame=False))
    shares = (0.25, 0.5, -0.25, 0.75) if kind == "ulog" else (0.1, 0.2, 0.0, -0.2)
    ends = (COLLAGE.omega_max, COLLAGE.omega_max, COLLAGE.delta_max, COLLAGE.delta_max)
    assert record.commands.values[7] == pytest.approx(np.multiply(shares, ends), abs=1e-5)
    p, q, r, *force = record.imu.values[7]
    assert (p, -q, -r) == pytest.approx(foreign_logs.RATES, abs=2e-4)
    assert force == pytest.approx(np.multiply(foreign_logs.FORCE, (1.0, -1.0, -1.0)), abs=1e-3)
    (north, east, down), _ = foreign_logs.place(record.motion.time[4])
    assert record.motion.values[4, :3] == pytest.approx((north, -east, -down), abs=0.01)
    assert record.damage == ""


def test_damage_of_a_log_is_kept_with_it(tmp_path):
    path = tmp_path / "cut.ulg"
    path.write_bytes(foreign_logs.ulog()[:-20])
    assert read_flight(path, LogConventions(None, COLLAGE)).damage.endswith("the file was cut")
