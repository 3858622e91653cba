"""Recording on the ground: disks that fill up, folders that cannot be written, clocks that jump."""

import io
import re
import resource
import socket
import time
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path

import pytest

from darko_gcs import recording
from darko_gcs.__main__ import main
from darko_gcs.errors import GroundError
from darko_gcs.link import Link
from darko_gcs.recording import start_recording
from darko_gcs.station import Station
from darko_gcs.widgets.status import StatusBar
from protocol.codec import Codec
from protocol.dialect import mavlink
from protocol.tlog import TlogReader, TlogWriter, read_tlog
from tests.support.ground import PEER, Ground
from tests.support.paths import DATA

SECOND = 10**9  # [ns]
HOUR = 3600 * SECOND


@contextmanager
def disk_of(size):
    """Files of this process end at a size [bytes], as on a disk that is full."""
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, limits[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)


class Flight:
    """A real vehicle in the air, and the station that records it."""

    def __init__(self, folder, recorder):
        self.vehicle, self.station, self.now = Ground(folder, airborne=True).node, Station(recorder), 1.0

    def run(self, seconds):
        for _ in range(round(seconds / 0.02)):
            self.now += 0.02
            self.vehicle.advance(10)
            for _, data in self.vehicle.datagrams(self.now):
                self.station.receive(data, self.now, round(self.now * 1e6))
            self.station.tick(self.now)
            for data in self.station.outgoing(self.now, round(self.now * 1e6)):
                self.vehicle.receive(data, PEER, self.now)

    @property
    def said(self):
        return [line.text for line in self.station.snapshot.messages]


def test_a_disk_that_fills_up_in_flight_is_said_once_and_flight_and_display_go_on(tmp_path):
    recorder, path = start_recording(tmp_path / "logs")
    flight = Flight(tmp_path / "state", recorder)
    with disk_of(20_000):
        flight.run(6.0)
        seen = flight.station.snapshot.boot
        flight.station.land(flight.now)
        flight.run(1.0)
    flight.station.close()
    words = [text for text in flight.said if str(path) in text]
    assert len(words) == 1
    assert "recording stopped after" in words[0]
    assert "File too large" in words[0]
    assert f"NOT RECORDING: {flight.station.recording_fault}" == words[0]
    line = StatusBar().draw(flight.station.snapshot, 120, 1)[0]
    assert (" NOT RECORDING ", "bad") in line
    assert flight.station.snapshot.boot > seen + 0.9
    assert flight.station.snapshot.mode == "LAND"
    reader = read_tlog(path)
    assert not reader.damage  # what is there ends with a whole record
    assert 10_000 < reader.size <= 20_000


def test_a_device_that_is_full_from_the_start_is_said(tmp_path):
    flight = Flight(tmp_path, TlogWriter.open("/dev/full"))
    flight.run(3.0)
    assert any("/dev/full: recording stopped after 0 records: No space left" in text for text in flight.said)
    assert flight.station.snapshot.source == (1, 1)


def test_a_disk_that_is_full_at_the_very_end_breaks_no_leaving(tmp_path):
    recorder, path = start_recording(tmp_path)
    station = Station(recorder)
    station.receive(Codec(1, 1).encode(mavlink.MAVLink_heartbeat_message(19, 12, 0x81, 0, 4, 3)), 0.0, 0)
    with disk_of(0):
        station.close()
    assert station.recording_fault.startswith(f"{path}: recording stopped after 0 records")


def test_a_folder_that_cannot_be_written_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(GroundError, match=r"recordings cannot be kept in .*file/logs: Not a directory"):
        start_recording(tmp_path / "file" / "logs")


def test_a_scripted_flight_is_flown_without_a_log_rather_than_not_at_all(tmp_path, capsys):
    (tmp_path / "file").write_text("")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        port = str(taken.getsockname()[1])
        code = main(["fly", "--headless", "--mission", str(DATA / "square.plan"), "--port", port,
                     "--record", str(tmp_path / "file")])  # fmt: skip
    told = capsys.readouterr().err.splitlines()
    assert told[0].startswith("NOT RECORDING: recordings cannot be kept in ")
    assert "cannot listen on" in told[1]  # it went on to the link
    assert code == 3


def test_no_recording_goes_on_in_a_file_that_is_there(tmp_path, monkeypatch):
    class SetBack(datetime):
        @classmethod
        def now(cls, _zone=None):
            return datetime(2026, 3, 1, 12, 0, 0, tzinfo=UTC)

    monkeypatch.setattr(recording, "datetime", SetBack)
    names = []
    for _ in range(3):
        recorder, path = start_recording(tmp_path)
        recorder.close()
        names.append(path.name)
    assert names == ["20260301-120000.tlog", "20260301-120000-2.tlog", "20260301-120000-3.tlog"]


@pytest.mark.parametrize("jump", [-HOUR, HOUR, -100 * 365 * 24 * HOUR])
async def test_a_wall_clock_that_is_set_in_flight_does_not_reach_the_stamps(monkeypatch, jump):
    log, began = io.BytesIO(), time.time_ns()
    link = Link(Station(TlogWriter(log)))
    vehicle = Codec(1, 1)
    for number in range(6):
        if number == 3:
            monkeypatch.setattr(time, "time_ns", lambda: began + jump)
        beat = mavlink.MAVLink_heartbeat_message(19, 12, 0x81, number, 4, 3)
        link.datagram_received(vehicle.encode(beat), ("127.0.0.1", 9))
    link.station._recorder.flush()
    reader = TlogReader(log.getvalue())
    assert len(reader) == 6
    assert not len(reader.backward)
    assert reader.times[-1] - reader.times[0] < 60e6
    assert abs(int(reader.times[0]) - began // 1000) < 60e6
    assert link.station.snapshot.age(link.now) < 60.0


def test_a_clock_before_1970_is_recorded_as_1970(monkeypatch):
    monkeypatch.setattr(time, "time_ns", lambda: -HOUR)
    assert Link(Station())._time_usec() == 0


WALL_CLOCK = re.compile(r"\btime\.time\b|\btime_ns\b|\bdatetime\.now\b")
NAMES_AND_STAMPS = {  # where the wall clock may be asked: what it tells there is written down, nothing waits for it
    "darko_gcs/app.py", "darko_gcs/link.py", "darko_gcs/recording.py", "darko_gcs/signing.py", "sitl/process.py",
}  # fmt: skip


def test_no_timer_runs_on_the_wall_clock():
    root = Path(__file__).parents[2]
    sources = [path for package in ("protocol", "sitl", "darko_gcs") for path in (root / package).rglob("*.py")]
    asking = {str(path.relative_to(root)) for path in sources if WALL_CLOCK.search(path.read_text("utf-8"))}
    assert asking - {"protocol/dialect/mavlink.py"} == NAMES_AND_STAMPS
