"""Logs of PX4, ArduPilot and Paparazzi: the same flight is read out of each, whatever the files are called."""

import math

import numpy as np
import pytest

from protocol.errors import FileError
from protocol.flight_log.flight_summary import summarise
from protocol.foreign_logs import log_tables, read_log
from protocol.foreign_logs.message_tables import MessageRows, as_telemetry_log
from protocol.foreign_logs.paparazzi_pair import factor_of
from protocol.foreign_logs.vehicle_messages import VehicleKind, VehicleMessages, angles_of, quaternions_of
from protocol.tlog import TlogReader
from tests.support import foreign_logs as logs

KINDS = ("ulog", "dataflash", "old dataflash", "paparazzi")
WRITERS = {
    "ulog": logs.ulog,
    "dataflash": logs.dataflash,
    "old dataflash": lambda: logs.dataflash(units=False),
}


def written(kind, folder):
    """The flight's file, under a name that says nothing."""
    if kind == "paparazzi":
        return logs.write_pair(folder)
    path = folder / "flight.dat"
    path.write_bytes(WRITERS[kind]())
    return path


@pytest.fixture(params=KINDS)
def kind(request):
    return request.param


@pytest.fixture
def reader(kind, tmp_path):
    return read_log(written(kind, tmp_path))


def columns(reader, name, *fields):
    found = reader.columns(name)
    return np.stack([found[field].astype(float) for field in fields], axis=1)


def test_attitudes_and_rates_are_those_flown(reader):
    t = logs.instants()
    angles = columns(reader, "ATTITUDE", "roll", "pitch", "yaw")
    assert angles == pytest.approx(np.stack([0 * t + logs.ROLL, 0 * t + logs.PITCH, logs.yaw(t)], axis=1), abs=2e-4)
    q = columns(reader, "ATTITUDE_QUATERNION", "q1", "q2", "q3", "q4")
    assert q[7] == pytest.approx(logs.quaternion(logs.ROLL, logs.PITCH, logs.yaw(t[7])), abs=1e-4)
    rates = columns(reader, "ATTITUDE_QUATERNION", "rollspeed", "pitchspeed", "yawspeed")
    assert rates == pytest.approx(np.tile(logs.RATES, (len(t), 1)), abs=2e-4)


def test_positions_and_velocities_are_ned(reader, kind):
    told = columns(reader, "LOCAL_POSITION_NED", "x", "y", "z", "vx", "vy", "vz")
    times = logs.instants()[:: 2 if kind == "paparazzi" else 1]
    expected = np.array([np.concatenate(logs.place(t)) for t in times.tolist()])
    assert told == pytest.approx(expected, abs=3e-3)
    assert columns(reader, "LOCAL_POSITION_NED", "time_boot_ms")[:, 0] == pytest.approx(1e3 * (logs.BOOT + times))


def test_the_imu_is_of_the_first_sensor_in_frd(reader):
    told = columns(reader, "HIGHRES_IMU", "xgyro", "ygyro", "zgyro", "xacc", "yacc", "zacc")
    assert told == pytest.approx(np.tile((*logs.RATES, *logs.FORCE), (len(logs.instants()), 1)), abs=5e-4)
    first = columns(reader, "HIGHRES_IMU", "time_usec")[0, 0]
    assert first == pytest.approx(1e6 * logs.BOOT)


def test_actuators_and_battery(reader, kind):
    if kind == "ulog":
        told = reader.columns("ACTUATOR_OUTPUT_STATUS")["actuator"]
        assert told[:, :4] == pytest.approx(np.tile(logs.OUTPUTS, (len(told), 1)))
        assert not told[:, 4:].any()
    else:
        told = columns(reader, "SERVO_OUTPUT_RAW", *(f"servo{number}_raw" for number in range(1, 6)))
        assert told == pytest.approx(np.tile((*logs.PULSES, 0.0), (len(told), 1)))
    voltage, current = columns(reader, "SYS_STATUS", "voltage_battery", "current_battery")[0]
    assert (voltage, current) == pytest.approx((1e3 * logs.VOLTAGE, 1e2 * logs.CURRENT))


def test_state_texts_and_date_are_told(reader, kind):
    summary = summarise(reader)
    (flight,) = summary.flights
    mode = {"ulog": "HOLD", "paparazzi": "mode 3"}.get(kind, "AUTO")
    assert [period.name for period in flight.modes] == [mode]
    (armed,) = flight.armed
    assert armed.start == pytest.approx(1.0, abs=0.01)
    assert flight.distance == pytest.approx(logs.RADIUS * logs.TURN * 2.0, rel=0.05)
    assert flight.height == pytest.approx(30.0)
    if kind == "paparazzi":
        assert [text.text for text in summary.texts] == ["gentle breeze", "mode NAV"]
        assert summary.start_usec / 1e6 == pytest.approx(logs.UTC + 0.5 + logs.BOOT)
    else:
        assert [text.text for text in summary.texts] == ["gentle breeze" if kind == "ulog" else "ArduPlane V4.5.0"]
        assert summary.start_usec / 1e6 == pytest.approx(logs.UTC, abs=0.01)
    assert not reader.damage


def test_places_on_the_globe(tmp_path):
    reader = read_log(written("dataflash", tmp_path))
    lat, lon, alt, height, north, east = columns(
        reader, "GLOBAL_POSITION_INT", "lat", "lon", "alt", "relative_alt", "vx", "vy"
    ).T
    assert lat[0] == pytest.approx(1e7 * (logs.HOME[0] + math.degrees(logs.RADIUS / 6_371_000.0)), abs=2)
    assert (lon[0], alt[0], height[0]) == (1e7 * logs.HOME[1], 180e3, 30e3)
    assert (north[0], east[0]) == pytest.approx((0.0, 100 * logs.RADIUS * logs.TURN), abs=1)


def test_a_vehicle_of_paparazzi_keeps_its_number_and_every_aircraft_is_told(tmp_path):
    data = logs.paparazzi_data()
    path = logs.write_pair(tmp_path, data=data + data.replace(b" 12 ", b" 34 "))
    assert sorted({flight.system for flight in summarise(read_log(path)).flights}) == [12, 34]


def test_a_data_file_finds_its_log_and_a_log_its_data(tmp_path):
    path = logs.write_pair(tmp_path, log=logs.paparazzi_log("../../elsewhere/flight.data"))
    assert len(read_log(path)) == len(read_log(tmp_path / "flight.data")) > 600
    (tmp_path / "flight.data").unlink()
    with pytest.raises(FileError, match=r"flight\.log: a Paparazzi log without its data, flight\.data"):
        read_log(path)


@pytest.mark.parametrize("name", ["", ".", "..", "/", "x" * 5000, "flight.log"])
def test_a_name_that_no_data_can_have_is_passed_over(tmp_path, name):
    path = logs.write_pair(tmp_path, log=logs.paparazzi_log(name))
    assert len(read_log(path)) > 600


def test_data_without_definitions_are_refused(tmp_path):
    path = tmp_path / "alone.data"
    path.write_bytes(logs.paparazzi_data())
    with pytest.raises(FileError, match=r"alone\.data: Paparazzi data without alone\.log"):
        read_log(path)


def test_entities_in_definitions_are_refused(tmp_path):
    bomb = b'<?xml version="1.0"?><configuration data_file="&a;">'
    log = logs.paparazzi_log().replace(b"<configuration", b'<!DOCTYPE c [<!ENTITY a "x">]><configuration', 1)
    path = logs.write_pair(tmp_path, log=b'<configuration x="1"/>')
    for content in (bomb, log):
        path.write_bytes(content)
        with pytest.raises(FileError):
            read_log(path)


@pytest.mark.parametrize(
    ("attributes", "factor"),
    [
        ({"unit": "rad", "alt_unit": "deg", "alt_unit_coef": "57.29578"}, 1.0),
        ({"alt_unit": "deg", "alt_unit_coef": "57.29578"}, 1.0),
        ({"alt_unit": "deg/s", "alt_unit_coef": "0.0139882"}, 2.0**-12),
        ({"alt_unit": "m/s", "alt_unit_coef": "0.0000019"}, 2.0**-19),  # as printed it is off by 0.4 %
        ({"alt_unit": "m", "alt_unit_coef": "0.0039063"}, 2.0**-8),
        ({"alt_unit": "m", "alt_unit_coef": "0.01"}, 0.01),
        ({"unit": "1e-1V", "alt_unit": "V", "alt_unit_coef": "0.1"}, 0.1),
        ({"unit": "cm", "alt_unit": "m"}, 0.01),
        ({"alt_unit_coef": "no number"}, 1.0),
        ({"alt_unit_coef": "-1"}, 1.0),
        ({"alt_unit_coef": "NaN"}, 1.0),
        ({"unit": "pprz"}, 1.0),
    ],
)
def test_units_of_paparazzi(attributes, factor):
    assert factor_of(attributes) == pytest.approx(factor, rel=1e-7)


def test_units_of_dataflash_are_those_that_the_file_tells(tmp_path, monkeypatch):
    monkeypatch.setitem(logs.DATAFLASH_UNITS, "d", "rad")
    path = tmp_path / "radians.bin"
    path.write_bytes(logs.dataflash())
    roll = columns(read_log(path), "ATTITUDE", "roll")[0, 0]
    assert roll == pytest.approx(math.remainder(math.degrees(logs.ROLL), 2 * math.pi), abs=0.01)


def test_a_log_without_a_flight_is_refused(tmp_path):
    path = tmp_path / "none.ulg"
    path.write_bytes(logs.ulog(topics={"vehicle_status": logs.ULOG_TOPICS["vehicle_status"]})[:200])
    with pytest.raises(FileError, match=r"none\.ulg: a PX4 ULog that tells nothing of a flight"):
        read_log(path)


def test_a_telemetry_log_is_read_as_ever_and_other_files_are_refused(tmp_path):
    path = tmp_path / "text.log"
    path.write_bytes(b"12.5 is no message\n")
    with pytest.raises(FileError, match=r"text\.log: not a telemetry log: it is a text file"):
        read_log(path)
    with pytest.raises(FileError, match="cannot be read"):
        read_log(tmp_path / "missing")


def test_a_file_that_is_too_large_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr("protocol.foreign_logs.any_log.MAX_FOREIGN_SIZE", 1 << 20)
    path = tmp_path / "large.ulg"
    path.write_bytes(logs.ulog() + bytes(1 << 20))
    with pytest.raises(FileError, match=r"large\.ulg: larger than 1 MiB"):
        read_log(path)


def test_a_format_that_asks_for_more_than_a_message_is_left_out(tmp_path):
    """Formats in formats may multiply to any size; a format may contain itself."""
    nested = {
        "a": "uint8_t[60000] x;",
        "b": "a[60000] y;",
        "c": "c[2] z;",
        "vehicle_attitude": "uint64_t timestamp;b q;c p;",
    }
    head = logs.ulog()[:59]
    formats = b"".join(logs.ulog_message("F", f"{name}:{fields}".encode()) for name, fields in nested.items())
    added = logs.ulog_message("A", b"\0\0\0vehicle_attitude")
    path = tmp_path / "nested.ulg"
    path.write_bytes(head + formats + added + logs.ulog()[59:])
    reader = read_log(path)
    assert "no sound format of vehicle_attitude" in {piece.what for piece in reader.damage}
    assert len(reader.rows("HIGHRES_IMU")) == len(logs.instants())


def test_a_definition_of_no_length_ends_nothing(tmp_path):
    empty = logs.dataflash_record(0x80, "BBnNZ", 40, 0, "ZERO", "Q", "TimeUS")
    path = tmp_path / "zero.bin"
    path.write_bytes(logs.dataflash() + empty + bytes([0xA3, 0x95, 40]) * 3)
    reader = read_log(path)
    assert [piece.what for piece in reader.damage] == ["a definition that cannot be read", "no record begins here"]
    assert len(reader.rows("HIGHRES_IMU")) == len(logs.instants())


def test_a_time_that_is_none_of_the_flight_is_left_out(tmp_path):
    late = logs.dataflash_record(8, "QHHHH", 1 << 60, 1, 2, 3, 4)
    path = tmp_path / "late.bin"
    path.write_bytes(logs.dataflash() + late)
    reader = read_log(path)
    assert reader.clock.duration == pytest.approx(logs.SECONDS, abs=0.1)
    assert [piece.what for piece in reader.damage] == ["1 samples with times that are none of the flight"]


def test_damage_in_too_many_places_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(log_tables, "MAX_PIECES", 3)
    path = tmp_path / "broken.bin"
    path.write_bytes(logs.dataflash() + 5 * (logs.dataflash_record(8, "QHHHH", 0, 1, 2, 3, 4) + b"junk"))
    with pytest.raises(FileError, match=r"broken\.bin: damaged in more than 3 places, the last at byte \d+: no record"):
        read_log(path)


def test_angles_and_quaternions_are_each_other():
    angles = np.random.default_rng(1).uniform(-1.5, 1.5, (50, 3))
    assert angles_of(quaternions_of(angles)) == pytest.approx(angles, abs=1e-9)


def test_a_current_or_charge_that_is_not_known_is_told_so():
    vehicle = VehicleMessages(1, VehicleKind(12, 0))
    unknown = np.array([-1.0, np.nan, 0.5])
    vehicle.battery(np.arange(3.0), np.full(3, 11.5), unknown, unknown)
    reader = TlogReader(as_telemetry_log(vehicle.tables(), 0))
    told = columns(reader, "SYS_STATUS", "voltage_battery", "current_battery", "battery_remaining")
    assert told.tolist() == [[11500, -1, -1], [11500, -1, -1], [11500, 50, 50]]


def test_numbers_that_no_field_holds_become_its_ends_or_none():
    values = np.array([np.nan, np.inf, -np.inf, 1e300, -3.0, 2.5])
    rows = [
        MessageRows("SERVO_OUTPUT_RAW", 1, np.arange(6.0), {"servo1_raw": values}),
        MessageRows("HIGHRES_IMU", 1, np.arange(6.0), {"time_usec": values, "xacc": values}),
    ]
    reader = TlogReader(as_telemetry_log(rows, 0))
    assert not reader.damage
    assert reader.columns("SERVO_OUTPUT_RAW")["servo1_raw"].tolist() == [0, 65535, 0, 65535, 0, 2]
    times = reader.columns("HIGHRES_IMU")["time_usec"]
    assert (times[0], times[1] > 1 << 63, times[2]) == (0, True, 0)
    assert reader.columns("HIGHRES_IMU")["xacc"][[1, 3, 5]].tolist() == [np.inf, np.inf, 2.5]
