"""The writer leaves whole records, and the reader returns what was written."""

import errno
import io

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from protocol.errors import FileError, LocalProtocolError
from protocol.tlog import TlogReader, TlogWriter, read_tlog
from tests.support.logs import T0, flight, log_of

FRAMES = flight(20)


class Disk(io.BytesIO):
    """A file that accepts ``room`` bytes, the last of them in a short write, and then no more."""

    def __init__(self, room, *, fixed=False):
        super().__init__()
        self.room, self.fixed = room, fixed

    def write(self, data):
        taken = min(len(data), self.room - len(self.getvalue()))
        if not taken:
            raise OSError(errno.ENOSPC, "No space left on device")
        return super().write(data[:taken])

    def truncate(self, size=None):
        if self.fixed:
            raise OSError(errno.EINVAL, "Invalid argument")
        return super().truncate(size)


def test_a_log_is_read_as_it_was_written(tmp_path):
    path = tmp_path / "flight.tlog"
    with TlogWriter.open(path) as writer:
        for k, frame in enumerate(FRAMES):
            writer.write(T0 + k, frame)
    assert writer.written == len(FRAMES)
    assert list(read_tlog(path).records()) == [(T0 + k, frame) for k, frame in enumerate(FRAMES)]


def test_an_existing_log_is_appended_to(tmp_path):
    path = tmp_path / "flight.tlog"
    for frame in FRAMES[:2]:
        with TlogWriter.open(path) as writer:
            writer.write(T0, frame)
    assert [frame for _, frame in read_tlog(path).records()] == FRAMES[:2]


@pytest.mark.parametrize(("passed", "written"), [(999_999, 0), (1_000_000, 2)])
def test_records_are_written_after_a_second_unless_it_is_said_otherwise(passed, written):
    writer = TlogWriter(io.BytesIO())
    for time, frame in ((T0, FRAMES[0]), (T0 + passed, FRAMES[1])):
        writer.write(time, frame)
    assert writer.written == written


def test_a_crash_loses_at_most_unflushed_records():
    stream = io.BytesIO()
    writer = TlogWriter(stream, flush_after=1_000_000)
    for k, frame in enumerate(FRAMES):
        writer.write(T0 + 300_000 * k, frame)
    assert stream.getvalue() == log_of(FRAMES, step=300_000)[: len(stream.getvalue())]
    assert len(TlogReader(stream.getvalue())) == 20
    writer.write(T0, FRAMES[0])
    assert len(TlogReader(stream.getvalue())) == 20
    writer.flush()
    assert len(TlogReader(stream.getvalue())) == 21


def test_many_bytes_cause_an_earlier_flush():
    stream = io.BytesIO()
    writer = TlogWriter(stream, flush_bytes=1)
    writer.write(T0, FRAMES[0])
    assert len(TlogReader(stream.getvalue())) == 1


@given(room=st.integers(0, len(log_of(FRAMES)) - 1), flush_bytes=st.integers(1, 600))
@settings(max_examples=100, deadline=None)
def test_a_full_disk_raises_once_and_leaves_whole_records(room, flush_bytes):
    disk, errors = Disk(room), []
    writer = TlogWriter(disk, name="flight.tlog", flush_bytes=flush_bytes)
    for k, frame in enumerate(FRAMES):
        try:
            writer.write(T0 + 10_000 * k, frame)
        except FileError as error:
            errors.append(str(error))
    try:
        writer.flush()
    except FileError as error:
        errors.append(str(error))
    whole = TlogReader(disk.getvalue())
    assert errors == [f"flight.tlog: recording stopped after {len(whole)} records: No space left on device"]
    assert whole.damage == ()
    assert [frame for _, frame in whole.records()] == FRAMES[: writer.written]
    assert writer.written + writer.dropped == len(FRAMES)
    writer.close()


def test_a_stream_that_cannot_be_truncated_is_readable_up_to_its_last_whole_record():
    disk = Disk(100, fixed=True)
    writer = TlogWriter(disk)
    for frame in FRAMES:
        writer.write(T0, frame)
    with pytest.raises(FileError, match="No space left on device"):
        writer.flush()
    assert len(TlogReader(disk.getvalue())) == writer.written > 0


def test_an_error_in_close_is_raised_and_the_stream_is_closed():
    disk = Disk(10)
    writer = TlogWriter(disk)
    writer.write(T0, FRAMES[0])
    with pytest.raises(FileError, match="recording stopped after 0 records"):
        writer.close()
    assert disk.closed


def test_a_stream_that_accepts_nothing_fails():
    class Deaf(io.BytesIO):
        def write(self, _):
            return 0

    writer = TlogWriter(Deaf())
    writer.write(T0, FRAMES[0])
    with pytest.raises(FileError, match="the stream accepts no more"):
        writer.flush()


@pytest.mark.parametrize("frame", [b"", b"x", FRAMES[0][:-1], FRAMES[0] + b"x", FRAMES[0] * 2])
def test_only_one_whole_frame_is_a_record(frame):
    with pytest.raises(LocalProtocolError, match="not one whole frame"):
        TlogWriter(io.BytesIO()).write(T0, frame)


@pytest.mark.parametrize("time", [-1, 1 << 53])
def test_a_time_outside_the_range_is_refused(time):
    with pytest.raises(LocalProtocolError, match="outside the range of log times"):
        TlogWriter(io.BytesIO()).write(time, FRAMES[0])


def test_a_folder_that_is_missing_is_a_file_error(tmp_path):
    with pytest.raises(FileError, match="cannot be written: No such file"):
        TlogWriter.open(tmp_path / "none" / "flight.tlog")
