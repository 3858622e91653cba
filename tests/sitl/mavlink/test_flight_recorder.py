"""The flight recorder: what it records, what it deletes, and a disk that fails."""

import pytest

from protocol.dialect import mavlink
from protocol.engines.file_transfer import Log
from protocol.events import LogReceived, LogsListed
from protocol.tlog import read_tlog
from sitl.mavlink import flight_recorder
from sitl.mavlink.flight_recorder import FlightRecorder
from sitl.mavlink.telemetry.telemetry_service import SnapshotMessages
from tests.support.vehicle.file_session import WALL, FileSession


@pytest.fixture
def session(tmp_path):
    return FileSession(tmp_path)


def test_a_flight_is_recorded_listed_and_downloaded(session):
    session.fly(0.5)
    session.disarm()
    session.ground.list_logs(session.now)
    (log,) = session.wait_for(LogsListed).logs
    assert log.time_utc == WALL
    session.ground.fetch_log(log, session.now)
    data = session.wait_for(LogReceived).data
    (named,) = session.recorder.logs()
    assert named == Log("00001-20260921-141320.tlog", int(WALL), len(data))
    assert session.read(f"logs/{named.name}").data == data


def test_a_log_is_a_telemetry_log_of_the_flight(session, tmp_path):
    session.fly(1.0)
    session.disarm()
    session.fly(0.5)
    assert not session.recorder.is_recording
    log = read_tlog(tmp_path / "logs" / session.recorder.logs()[0].name)
    assert not log.damage
    assert 1.9 <= (int(log.times[-1]) - WALL * 1e6) / 1e6 <= 2.1
    kinds = {log.decode(index).get_type() for index in range(len(log))}
    assert {"HEARTBEAT", "ATTITUDE_QUATERNION", "DARKO_HYBRID_STATE", "STATUSTEXT"} <= kinds


def test_a_log_begins_with_arming_and_ends_with_disarming(tmp_path):
    session = FileSession(tmp_path, up=0.0)
    session.fly(0.1)
    session.arm()
    session.fly(0.2)
    session.disarm()
    log = read_tlog(tmp_path / "logs" / session.recorder.logs()[0].name)
    texts = [log.decode(index).text for index in log.rows("STATUSTEXT")]
    assert texts[0] == "Armed"
    assert "Disarmed" in texts


def test_a_vehicle_that_was_never_armed_is_not_recorded(tmp_path):
    session = FileSession(tmp_path, up=0.0)
    session.fly(0.2)
    assert session.recorder.logs() == []
    session.arm()
    session.fly(0.1)
    assert session.recorder.is_recording


def flights(recorder, count, seconds=1.0, snapshot=None):
    """Arm and disarm; the recorder sees a vehicle that stands still."""
    for number in range(count):
        for step in range(round(seconds * 10)):
            recorder.follow(1000.0 * number + step / 10, SnapshotMessages(lambda: snapshot).messages, armed=True)
        for later in (0.0, flight_recorder.AFTER_DISARMING):
            recorder.follow(1000.0 * number + seconds + later, SnapshotMessages(lambda: snapshot).messages, armed=False)


def test_logs_are_bounded_in_number_and_size(session, tmp_path, monkeypatch):
    snapshot = session.node.snapshot()
    monkeypatch.setattr(flight_recorder, "MAX_FILES", 4)
    recorder = FlightRecorder(tmp_path / "box", lambda: WALL)
    flights(recorder, 7, snapshot=snapshot)
    assert [log.name[:5] for log in recorder.logs()] == ["00004", "00005", "00006", "00007"]
    monkeypatch.setattr(flight_recorder, "MAX_FILE_SIZE", 20_000)
    monkeypatch.setattr(flight_recorder, "MAX_TOTAL_SIZE", 90_000)
    flights(recorder, 1, 30.0, snapshot=snapshot)
    sizes = [path.stat().st_size for path in (tmp_path / "box").iterdir()]
    assert sum(sizes) <= 90_000
    assert max(sizes) < 20_000 + 300
    assert sorted(path.name for path in (tmp_path / "box").iterdir()) == [log.name for log in recorder.logs()]


def test_a_restart_goes_on_counting_whatever_the_clock_says(session, tmp_path):
    snapshot = session.node.snapshot()
    flights(FlightRecorder(tmp_path / "box", lambda: WALL), 2, snapshot=snapshot)
    again = FlightRecorder(tmp_path / "box", lambda: -5.0)
    flights(again, 1, snapshot=snapshot)
    assert [log.name for log in again.logs()] == [
        "00001-20260921-141320.tlog",
        "00002-20260921-141320.tlog",
        "00003-19700101-000000.tlog",
    ]


@pytest.mark.parametrize("clock", [-1e18, 1e18])
def test_a_clock_that_is_far_off_dates_a_log_wrongly_but_loses_nothing(session, tmp_path, clock):
    recorder = FlightRecorder(tmp_path / "box", lambda: clock)
    flights(recorder, 2, snapshot=session.node.snapshot())
    assert recorder.complaints() == []
    readers = [read_tlog(tmp_path / "box" / log.name) for log in recorder.logs()]
    assert [len(reader.rows("ATTITUDE")) for reader in readers] == [12, 12]
    assert not any(len(reader.backward) for reader in readers)


def test_erasing_spares_the_flight_under_way(session):
    flights(session.recorder, 2, snapshot=session.node.snapshot())
    session.fly(0.1)
    session.ground.send(mavlink.MAVLink_log_erase_message(1, 1))
    session.fly(0.1)
    assert [log.name[:5] for log in session.recorder.logs()] == ["00003"]
    assert "2 logs erased" in session.texts()


def test_a_folder_that_cannot_be_written_is_reported_and_the_flight_goes_on(tmp_path):
    (tmp_path / "logs").write_text("in the way")
    session = FileSession(tmp_path)
    session.fly(0.5)
    assert "Flight not recorded" in session.texts()
    assert session.node.aircraft.vehicle.time == pytest.approx(0.5)


def test_a_full_disk_ends_the_log_and_is_reported_once(session, tmp_path):
    session.fly(0.1)
    session.recorder._writer._stream = open("/dev/full", "wb", buffering=0)  # noqa: PTH123, SIM115
    session.fly(3.0)
    assert session.texts().count("recording stopped") == 1
    assert not session.recorder.is_recording


def test_a_log_that_grows_stays_as_it_was_when_it_was_opened(session):
    session.fly(1.5)
    (log,) = session.recorder.logs()
    file = session.recorder.open(log.name)
    session.fly(1.5)
    assert session.recorder.logs()[0].size > file.size == log.size
    file.close()
