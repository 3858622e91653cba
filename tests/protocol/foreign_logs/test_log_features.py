"""Features of the formats beside plain samples; pyulog and pymavlink read the same files, which neither wrote."""

import struct
from io import BytesIO

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from pymavlink.DFReader import DFReader_binary
from pyulog import ULog

from protocol.errors import FileError
from protocol.foreign_logs import read_log
from tests.support import foreign_logs as logs

SYNC = logs.ulog_message("S", bytes.fromhex("2f731320250cbb12"))
RATES, FORCE = ("xgyro", "ygyro", "zgyro"), ("xacc", "yacc", "zacc")
DRAWN = settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
NUMBERS = st.floats(-1e3, 1e3, width=32)
TEXTS = st.text(st.characters(codec="ascii", exclude_characters="\0"), max_size=200)


def read(folder, content):
    path = folder / "flight.dat"
    path.write_bytes(content)
    return read_log(path)


def imu(reader):
    columns = reader.columns("HIGHRES_IMU")
    return np.stack([columns[name] for name in ("time_usec", *RATES, *FORCE)], axis=1)


def ulog(*messages, flags=bytes(40)):
    """A file of an IMU's topic and some messages."""
    head = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0) + logs.ulog_message("B", flags)
    fields = logs.ULOG_TOPICS["sensor_combined"][0]
    return head + logs.ulog_message("F", f"sensor_combined:{fields}".encode()) + b"".join(messages)


def added(number, instance=0):
    return logs.ulog_message("A", struct.pack("<BH", instance, number) + b"sensor_combined")


def sample(number, usec, values):
    return logs.ulog_message("D", struct.pack("<HQ6f", number, usec, *values))


def parameter(letter, name, value):
    key = f"float {name}".encode()
    return logs.ulog_message(
        letter, bytes([1] if letter == "Q" else []) + bytes([len(key)]) + key + struct.pack("<f", value)
    )


@given(st.lists(st.tuples(*[NUMBERS] * 6), min_size=1, max_size=20), st.integers(0, 3))
@DRAWN
def test_ulog_is_read_as_pyulog_reads_it(tmp_path, rows, instance):
    """Several instances, of which the first counts, whatever its number; parameters, syncs and events between them."""
    parts = [added(7, instance), added(3, instance + 1), parameter("P", "MC_ROLL_P", 6.5)]
    for k, row in enumerate(rows):
        parts += [sample(7, 1_000_000 + 4000 * k, row), sample(3, 1_000_000 + 4000 * k, (9.0,) * 6), SYNC]
        parts += [parameter("P", "MC_ROLL_P", float(k)), logs.ulog_message("O", struct.pack("<H", 12))]
    content = ulog(*parts)
    reader = read(tmp_path, content)
    assert not reader.damage
    data = ULog(BytesIO(content)).get_dataset("sensor_combined", instance).data
    assert imu(reader)[:, 0] == pytest.approx(data["timestamp"])
    assert imu(reader)[:, 4] == pytest.approx(data["accelerometer_m_s2[0]"])
    assert len(imu(reader)) == len(rows)


@given(st.integers(0, 36), st.integers(2, 30))
@DRAWN
def test_ulog_data_appended_after_a_crash_are_read(tmp_path, cut, count):
    """The message that was being written stays cut; what the crash handler appended begins where the flags say.

    (pyulog forgets the subscriptions there, and reads none of it.)
    """
    rows = [sample(0, 1_000_000 + 4000 * k, (float(k),) * 6) for k in range(count)]
    before = ulog(added(0), *rows[:-1])
    broken = before + rows[-1][: cut if cut < len(rows[-1]) else 0]
    flags = bytes(8) + b"\x01" + bytes(7) + struct.pack("<3Q", len(broken), 0, 0)
    later = [sample(0, 9_000_000 + 4000 * k, (50.0 + k,) * 6) for k in range(3)]
    content = ulog(added(0), *rows[:-1], flags=flags) + broken[len(before) :] + b"".join(later)
    reader = read(tmp_path, content)
    assert imu(reader)[:, 1].tolist() == [*range(count - 1), 50.0, 51.0, 52.0]
    told = [(piece.offset, piece.length, piece.what) for piece in reader.damage]
    assert told == ([(len(before), cut, "the file was cut")] if cut else [])


@pytest.mark.long
@given(st.integers(0, 9), st.binary(min_size=1, max_size=60))
@example(3, bytes(40))
@DRAWN
def test_ulog_goes_on_at_the_next_sync(tmp_path, at, rubbish):
    rows = [sample(0, 1_000_000 + 4000 * k, (float(k),) * 6) for k in range(10)]
    parts = [part for row in rows for part in (row, SYNC)]
    parts[2 * at] = b"\0\0\0" + rubbish  # no letter of a message
    reader = read(tmp_path, ulog(added(0), *parts))
    kept = [float(k) for k in range(10) if k != at]
    assert imu(reader)[:, 1].tolist() == kept
    (piece,) = reader.damage
    assert piece.what == "no message begins here"
    assert piece.length == 3 + len(rubbish)


def test_ulog_that_needs_what_is_not_known_is_refused(tmp_path):
    content = ulog(added(0), sample(0, 1, (1.0,) * 6), flags=bytes(8) + b"\x02" + bytes(31))
    with pytest.raises(FileError, match=r"flight\.dat: a ULog file that needs what is not known here: 02"):
        read(tmp_path, content)


@given(st.lists(st.tuples(*[NUMBERS] * 6), min_size=2, max_size=20), st.sampled_from(["0", "B", "?"]), TEXTS)
@DRAWN
def test_dataflash_is_read_as_pymavlink_reads_it(tmp_path, rows, scale, label):
    """Multipliers by MULT, one instance of two, kinds that are not known here, and a name of 64 letters."""
    kinds = logs.DATAFLASH_KINDS | {20: ("OWN", "QZ", "TimeUS,Word", "s-", "F-")}
    scales = {"-": 0.0, "?": 1.0, "0": 1.0, "B": 1e-2, "F": 1e-6}
    parts = [logs.dataflash_format(0x80, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns")]
    parts += [logs.dataflash_format(number, *kinds[number][:3]) for number in (1, 2, 3, 5, 20)]
    units = {"s": "s", "E": "rad/s", "o": "m/s/s", "-": "", "#": "instance"}
    parts += [logs.dataflash_record(1, "QbZ", 0, ord(mark), unit) for mark, unit in units.items()]
    parts += [logs.dataflash_record(2, "Qbd", 0, ord(mark), value) for mark, value in scales.items()]
    parts.append(logs.dataflash_record(3, "QBNN", 0, 5, "s#EEEooo", "F-" + 6 * scale))
    for k, row in enumerate(rows):
        parts += [logs.dataflash_record(5, "QBffffff", 1_000_000 + 2500 * k, i, *row) for i in (1, 0)]
        parts.append(logs.dataflash_record(20, "QZ", 1_000_000 + 2500 * k, label[:64]))
    content = b"".join(parts)
    reader = read(tmp_path, content)
    assert not reader.damage
    other = DFReader_binary(str(tmp_path / "flight.dat"))
    known = []
    while (message := other.recv_match(type="IMU")) is not None:
        if message.I == 0:
            names = ("GyrX", "GyrY", "GyrZ", "AccX", "AccY", "AccZ")
            known.append((message.TimeUS, *(scales[scale] * getattr(message, name) for name in names)))
    other.close()
    assert imu(reader) == pytest.approx(np.array(known), rel=1e-5, abs=1e-6)


def test_a_definition_that_changes_leaves_out_what_was_logged_before(tmp_path):
    """Whatever the new one asks for: records of the old one may end where the file does."""
    old = logs.dataflash_format(30, "XTR", "QB", "TimeUS,A") + logs.dataflash_record(30, "QB", 1_000_000, 1)
    new = logs.dataflash_format(30, "XTR", "QZZZ", "TimeUS,A,B,C")
    reader = read(tmp_path, logs.dataflash() + old + new)
    assert [piece.what for piece in reader.damage] == ["XTR is defined anew; what was logged of it is not read"]
    assert len(imu(reader)) == len(logs.instants())
    again = read(tmp_path, logs.dataflash() + old + old)
    assert not again.damage


@given(st.integers(-5, 5))
@DRAWN
def test_a_definition_of_a_wrong_length_is_damage(tmp_path, more):
    length = 3 + 9 + more
    wrong = logs.dataflash_record(0x80, "BBnNZ", 31, length, "XTR", "QB", "TimeUS,A")
    record = logs.dataflash_record(31, "QB", 1_000_000, 1)
    reader = read(tmp_path, logs.dataflash() + wrong + record)
    told = [piece.what for piece in reader.damage]
    assert told == (["a definition that cannot be read", "no record begins here"] if more else [])
    assert len(imu(reader)) == len(logs.instants())


@given(st.lists(st.integers(800, 2200), min_size=1, max_size=12), st.text("abc xyz", min_size=1, max_size=30))
@DRAWN
def test_arrays_and_texts_of_paparazzi(tmp_path, widths, text):
    line = f"12.5000 12 ACTUATORS {','.join(map(str, widths))}\n12.6 12 INFO_MSG {text}\n12.7 12 PONG \n"
    reader = read_log(logs.write_pair(tmp_path, data=line.encode()))
    told = reader.columns("SERVO_OUTPUT_RAW")
    assert [told[f"servo{number}_raw"][0] for number in range(1, len(widths) + 1)] == widths
    assert bool(text.strip()) == bool(len(reader.rows("STATUSTEXT")))


@pytest.mark.parametrize("place", [(0, 0), (435_000_000, 15_000_000)])
def test_a_place_without_a_fix_is_none(tmp_path, place):
    messages = {"GPS_INT": [*logs.PAPARAZZI_MESSAGES["GPS_INT"], ("fix", "uint8", "")]}
    log = logs.paparazzi_log(messages=logs.PAPARAZZI_MESSAGES | messages)
    fixes = [2, 3] if any(place) else [0, 0]
    data = "".join(f"12.{k} 12 GPS_INT {place[0]} {place[1]} 1000 {fix}\n" for k, fix in enumerate(fixes, 1))
    reader = read_log(logs.write_pair(tmp_path, log=log, data=(data + "12.5 12 INFO_MSG here\n").encode()))
    assert len(reader.rows("GLOBAL_POSITION_INT")) == fixes.count(3)
