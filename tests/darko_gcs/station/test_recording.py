"""Recording on the ground: full disks, folders that cannot be written, names that exist."""

import resource
import socket
from contextlib import contextmanager
from datetime import UTC, datetime

import pytest

from darko_gcs.__main__ import main
from darko_gcs.errors import GroundError
from darko_gcs.station import recording
from darko_gcs.station.recording import start_recording
from darko_gcs.station.station import Station
from darko_gcs.tui.widgets.status_bar import StatusBar
from protocol.tlog import TlogWriter, read_tlog
from protocol.wire.codec import Codec
from tests.support.gcs.linked_station import LinkedStation
from tests.support.gcs.messages import heartbeat
from tests.support.paths import DATA


@contextmanager
def disk_of(size):
    """Limit the size of this process's files [bytes], as a full disk does."""
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, limits[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)


def test_a_disk_that_fills_up_in_flight_is_reported_once_and_flight_and_display_go_on(tmp_path):
    recorder, path = start_recording(tmp_path / "logs")
    link = LinkedStation(tmp_path / "state", recorder=recorder, up=3.0)
    with disk_of(20_000):
        link.run(6.0)
        boot = link.snapshot.link.boot
        link.station.land(link.now)
        link.run(1.0)
    link.station.close()
    reports = [line for line in link.lines if str(path) in line]
    assert len(reports) == 1
    assert "recording stopped after" in reports[0]
    assert "File too large" in reports[0]
    assert f"NOT RECORDING: {link.station.recording_fault}" == reports[0]
    assert (" NOT RECORDING ", "bad") in StatusBar().draw(link.snapshot, 120, 1)[0]
    assert link.snapshot.link.boot > boot + 0.9
    assert link.snapshot.status.mode == "LAND"
    reader = read_tlog(path)
    assert not reader.damage  # the file ends with a whole record
    assert 10_000 < reader.size <= 20_000


def test_a_device_that_is_full_from_the_start_is_reported(tmp_path):
    link = LinkedStation(tmp_path, recorder=TlogWriter.open("/dev/full"), up=3.0)
    link.run(3.0)
    assert any("/dev/full: recording stopped after 0 records: No space left" in line for line in link.lines)
    assert link.snapshot.identity.source == (1, 1)


def test_a_disk_that_is_full_at_the_end_does_not_prevent_closing(tmp_path):
    recorder, path = start_recording(tmp_path)
    station = Station(recorder)
    station.receive(Codec(1, 1).encode(heartbeat(armed=True)), 0.0, 0)
    with disk_of(0):
        station.close()
    assert station.recording_fault.startswith(f"{path}: recording stopped after 0 records")


def test_a_recording_in_which_nothing_was_heard_leaves_no_file(tmp_path):
    recorder, path = start_recording(tmp_path)
    assert path.exists()
    Station(recorder).close()
    assert list(tmp_path.iterdir()) == []


def test_the_end_is_noted_in_the_recording(tmp_path):
    recorder, path = start_recording(tmp_path)
    station = Station(recorder)
    station.receive(Codec(1, 1).encode(heartbeat(armed=True)), 0.0, 0)
    station.record_note("The terminal was closed, vehicle armed", 1.0, 1_000_000)
    station.close()
    reader = read_tlog(path)
    (text,) = reader.columns("STATUSTEXT")["text"].tolist()
    assert text == b"The terminal was closed, vehicle armed"
    assert reader.systems.tolist() == [1, 255]


def test_a_folder_that_cannot_be_written_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(GroundError, match=r"cannot record in .*file/logs: Not a directory"):
        start_recording(tmp_path / "file" / "logs")


def test_a_scripted_flight_goes_on_without_a_log(tmp_path, capsys):
    (tmp_path / "file").write_text("")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        port = str(taken.getsockname()[1])
        code = main(["fly", "--headless", "--mission", str(DATA / "square.plan"), "--port", port,
                     "--record", str(tmp_path / "file")])  # fmt: skip
    lines = capsys.readouterr().err.splitlines()
    assert lines[0].startswith("NOT RECORDING: cannot record in ")
    assert "cannot listen on" in lines[1]  # it went on to open the link
    assert code == 3


def test_a_recording_never_continues_an_existing_file(tmp_path, monkeypatch):
    class StoppedClock(datetime):
        @classmethod
        def now(cls, _zone=None):
            return datetime(2026, 3, 1, 12, 0, 0, tzinfo=UTC)

    monkeypatch.setattr(recording, "datetime", StoppedClock)
    names = []
    for _ in range(3):
        recorder, path = start_recording(tmp_path)
        recorder.write(0, Codec(1, 1).encode(heartbeat(armed=True)))
        recorder.close()
        names.append(path.name)
    assert names == ["20260301-120000.tlog", "20260301-120000-2.tlog", "20260301-120000-3.tlog"]
