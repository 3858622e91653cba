"""Logs at their ends and limits: the diagnosis of damage, cut by cut, and files that are no logs."""

import pytest

from protocol.dialect import mavlink
from protocol.errors import FileError
from protocol.tlog import TlogReader, read_tlog
from protocol.tlog.reader import Timeline
from protocol.tlog.scan import TIME_LIMIT
from tests.support.logs import T0, bare, flight, log_of, record, unknown_frame

LOG = log_of(flight(3))
MESSAGE = mavlink.MAVLink_ping_message(1, 2, 3, 4)
V2, V1 = record(T0, bare(MESSAGE)), record(T0, bare(MESSAGE, version=1))
SIGNED = V2[:10] + b"\x01" + V2[11:] + bytes(13)
CUT_SHORT = "record cut short by the end of the file"


def diagnosis(end):
    """The diagnosis of the last bytes of a log, which are no record."""
    (damage,) = TlogReader(LOG + end).damage
    assert (damage.offset, damage.length) == (len(LOG), len(end))
    return damage.what


@pytest.mark.parametrize("last", [V1, V2, SIGNED], ids=["version 1", "version 2", "signed"])
def test_every_beginning_of_a_record_is_recognised_as_one(last):
    assert {diagnosis(last[:length]) for length in range(2, len(last))} == {CUT_SHORT}


@pytest.mark.parametrize("last", [V1, V2], ids=["version 1", "version 2"])
def test_a_whole_record_with_a_wrong_checksum_is_not_cut_short(last):
    assert diagnosis(last[:-1] + bytes([last[-1] ^ 0xFF])) == "wrong checksum or length of PING"


def test_bytes_that_cannot_be_a_time_begin_no_record():
    assert diagnosis(b"\x7f") == CUT_SHORT  # a single byte shows nothing
    for length in range(2, 9):
        assert diagnosis(b"\x00\x20" + bytes(length - 2)) == "no frame where one should start"
        assert diagnosis(b"\x00\x1f" + bytes(length - 2)) == CUT_SHORT
    assert diagnosis(b"\x00\x20" + V2[2:-1]) == "impossible time"


def test_bytes_after_a_time_that_begin_no_frame_are_not_cut_short():
    assert diagnosis(V2[:8] + b"\xfc") == "no frame where one should start"
    assert diagnosis(V2[:8] + b"\xfc" + V2[9:]) == "no frame where one should start"


def test_a_time_from_the_year_2255_on_is_impossible():
    frame = V2[8:]
    for time, damage in (
        (TIME_LIMIT - 1, []),
        (TIME_LIMIT, ["impossible time"]),
        (TIME_LIMIT + 1, ["impossible time"]),
    ):
        assert [piece.what for piece in TlogReader(LOG + record(time, frame) + LOG).damage] == damage


def test_a_record_within_the_frame_of_the_first_record_is_none_of_its_own():
    inner = record(T0, bare(MESSAGE))
    outer = bare(mavlink.MAVLink_encapsulated_data_message(0, inner + bytes(253 - len(inner))))
    reader = TlogReader(record(T0, outer) + LOG)
    assert [frame for _, frame in reader.records()] == [outer, *flight(3)]
    assert reader.damage == ()


def test_before_it_plays_a_log_is_at_its_first_record():
    line = Timeline(TlogReader(LOG))
    assert line.time_usec == T0
    line.advance(0.01)
    assert line.time_usec == T0 + 10_000


def test_zeros_are_called_zeros():
    assert [diagnosis(bytes(length)) for length in (1, 2, 40)] == ["zeros"] * 3


def test_the_clock_goes_backward_only_where_a_time_is_earlier_than_the_one_before():
    frames = flight(5)
    times = [T0, T0, T0 - 1, T0 - 1, T0 + 5]
    reader = TlogReader(b"".join(map(record, times, frames)))
    assert reader.backward.tolist() == [2]


def refusal(tmp_path, content):
    path = tmp_path / "a.tlog"
    path.write_bytes(content)
    with pytest.raises(FileError) as error:
        read_tlog(path)
    return str(error.value)


def test_a_file_that_begins_with_4096_characters_of_text_is_taken_for_a_text(tmp_path):
    text = refusal(tmp_path, b"a" * 4096 + b"\xff" * 100)
    assert refusal(tmp_path, b"a" * 4095 + b"\xff" * 100) != text
    assert "it is a text file" in text
    assert "it is a text file" in refusal(tmp_path, bytes(range(0x20, 0x7F)) + b"\t\n\r\f")
    for other in (b"\x1f", b"\x7f", b"\x00"):
        assert "hold no valid record" in refusal(tmp_path, b"a text" + other)


def test_a_file_that_begins_with_bare_frames_is_no_log_and_one_damaged_by_a_single_frame_is(tmp_path):
    frame, path = bare(MESSAGE), tmp_path / "a.tlog"
    assert "bare MAVLink frames" in refusal(tmp_path, 2 * frame + LOG)
    path.write_bytes(frame + LOG)
    assert [piece.length for piece in read_tlog(path).damage] == [len(frame)]


def test_frames_outside_the_dialect_make_a_log_if_they_are_more_than_half_of_the_file(tmp_path):
    unknown, path = record(T0, unknown_frame(77_000, bytes(20))), tmp_path / "a.tlog"
    assert "hold no valid record" in refusal(tmp_path, bytes(len(unknown)) + unknown)
    path.write_bytes(bytes(len(unknown) - 1) + unknown)
    assert len(read_tlog(path)) == 1
