"""Any cut and any flipped byte of a log: it is read up to the damage, or refused by one error that names the file."""

import re
from functools import cache

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from protocol.errors import FileError
from protocol.flight_log.flight_series import flight_series
from protocol.flight_log.flight_summary import damage_note, summarise
from protocol.foreign_logs import read_log
from protocol.tlog.reader import Timeline
from tests.support import foreign_logs as logs

WRITERS = {"ulog": logs.ulog, "dataflash": logs.dataflash, "log": logs.paparazzi_log, "data": logs.paparazzi_data}
DRAWN = settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


@cache
def whole(kind):
    return WRITERS[kind]()


@pytest.fixture(params=sorted(WRITERS))
def kind(request):
    return request.param


def read(folder, kind, content):
    """The log whose file of a kind has some content; None if it is refused."""
    if kind in {"log", "data"}:
        path = logs.write_pair(folder, **{kind: content})
    else:
        path = folder / "flight.dat"
        path.write_bytes(content)
    try:
        reader = read_log(path)
    except FileError as error:
        refused = str(error)
    else:
        refused = ""
    if refused:
        assert re.fullmatch(rf"{re.escape(str(folder))}/flight\.\w+: [^\n]+", refused)
        return None
    assert summarise(reader).records == len(reader) > 0
    flight_series(reader, "flight")
    assert reader.clock.duration <= 4000.0
    return reader


@pytest.mark.long
@given(st.data())
@DRAWN
def test_any_cut_is_read_to_its_end(kind, tmp_path, data):
    content = whole(kind)
    end = data.draw(st.integers(0, len(content) - 1))
    reader = read(tmp_path, kind, content[:end])
    if reader is None or kind == "log":
        return
    before = read(tmp_path, kind, content)
    shared = min(len(reader.rows("HIGHRES_IMU")), len(before.rows("HIGHRES_IMU")))
    for field in ("time_usec", "xgyro", "zacc"):
        found, known = (one.columns("HIGHRES_IMU")[field] for one in (reader, before))
        assert (found[:shared] == known[:shared]).all()
    assert all(piece.offset + piece.length <= end for piece in reader.damage)


@pytest.mark.long
@given(st.data())
@DRAWN
def test_any_flipped_byte_leaves_the_rest(kind, tmp_path, data):
    content = bytearray(whole(kind))
    at = data.draw(st.integers(0, len(content) - 1))
    content[at] ^= data.draw(st.integers(1, 255))
    read(tmp_path, kind, bytes(content))


@pytest.mark.long(after=1)
@given(st.data())
@DRAWN
def test_any_rubbish_after_a_beginning_is_no_traceback(kind, tmp_path, data):
    content = whole(kind)
    begin = data.draw(st.integers(0, min(len(content), 4000)))
    read(tmp_path, kind, content[:begin] + data.draw(st.binary(max_size=400)))


@pytest.mark.parametrize(("kind", "share"), [("ulog", 0.8), ("dataflash", 0.9), ("data", 0.9)])
def test_a_cut_in_a_record_is_told_with_its_place(tmp_path, kind, share):
    content = whole(kind)
    end = int(share * len(content))
    reader = read(tmp_path, kind, content[:end])
    (piece,) = reader.damage
    assert piece.what == "the file was cut"
    assert piece.offset + piece.length == end
    assert damage_note(reader) == f"damaged once at byte {piece.offset:,}: the file was cut"
    assert len(reader.rows("HIGHRES_IMU")) == pytest.approx(share * len(logs.instants()), rel=0.2)


def test_dataflash_goes_on_behind_its_damage(tmp_path):
    content = whole("dataflash")
    at = content.index(b"\xa3\x95\x05", len(content) // 2)
    reader = read(tmp_path, "dataflash", content[:at] + b"\0" * 100 + content[at:])
    (piece,) = reader.damage
    assert (piece.offset, piece.length) == (at, 100)
    assert len(reader.rows("HIGHRES_IMU")) == len(logs.instants())


def test_what_ulog_zeroed_at_its_end_is_one_piece_of_damage(tmp_path):
    reader = read(tmp_path, "ulog", whole("ulog") + bytes(5000))
    (piece,) = reader.damage
    assert (piece.offset, piece.length) == (len(whole("ulog")), 5000)


def test_a_line_that_is_not_as_defined_is_left_out(tmp_path):
    lines = whole("data").splitlines(keepends=True)
    at = next(k for k, line in enumerate(lines) if b"IMU_GYRO" in line and k > 100)
    lines[at] = lines[at].replace(b" 0 ", b" zero ")
    reader = read(tmp_path, "data", b"".join(lines))
    (piece,) = reader.damage
    assert piece.offset == len(b"".join(lines[:at]))
    assert len(reader.rows("HIGHRES_IMU")) == len(logs.instants()) - 1


def test_definitions_that_end_early_leave_out_messages(tmp_path):
    content = whole("log")
    reader = read(tmp_path, "log", content[: content.index(b"ROTORCRAFT_FP")])
    assert len(reader.rows("ATTITUDE_QUATERNION")) == len(logs.instants())
    assert not len(reader.rows("LOCAL_POSITION_NED"))
    assert {piece.what for piece in reader.damage} >= {"ROTORCRAFT_FP is not defined in the .log"}


def test_damage_is_a_mark_of_the_replay(tmp_path):
    reader = read(tmp_path, "ulog", whole("ulog")[:30_000])
    (mark,) = Timeline(reader).markers
    assert mark.what.endswith("bytes damaged: the file was cut")
    assert mark.time == pytest.approx(reader.clock.duration, abs=0.2)
