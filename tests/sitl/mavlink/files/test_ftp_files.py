"""Files on offer over MAVLink FTP: what is there, and that no path leads out of the tree."""

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocol.dialect import mavlink
from protocol.engines.file_store import NoFiles
from protocol.plans import load
from sitl.mavlink.flight_recorder import FlightRecorder
from sitl.mavlink.ftp_files import VehicleFiles
from sitl.vehicle.parameters import Configuration
from tests.support.paths import DATA
from tests.support.vehicle.file_session import WALL, FileSession

TABLE_NOW = Configuration().wire_table()
SQUARE = load(DATA / "square.plan").items


@pytest.fixture
def session(tmp_path):
    return FileSession(tmp_path)


def test_the_vehicle_announces_that_it_has_files(session):
    version = session.message(mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION)
    assert version.capabilities & mavlink.MAV_PROTOCOL_CAPABILITY_FTP


def test_the_whole_tree_can_be_listed_and_every_file_read(session):
    session.fly(0.1)
    folders = [name for name, size in session.entries("/").items() if size is None]
    assert folders == ["@PARAM", "@MISSION", "component_metadata", "logs"]
    for folder in folders:
        entries = session.entries(folder)
        assert entries
        for name, size in entries.items():
            assert len(session.read(f"/{folder}/{name}").data) == size


def test_nothing_can_be_written(session):
    for opcode in (6, 8, 9, 10, 11, 12, 13):
        payload = struct.pack("<HBBBBBxI", opcode, 0, opcode, 14, 0, 0, 0) + b"logs/new.tlog\0"
        request = mavlink.MAVLink_file_transfer_protocol_message(0, 1, 1, list(payload.ljust(251, b"\0")))
        session.ground.send(request)
        session.exchange()
        session.exchange()
        answer = next(m for m in reversed(session.heard) if m.get_type() == "FILE_TRANSFER_PROTOCOL")
        assert (answer.payload[3], answer.payload[5], answer.payload[12]) == (129, opcode, 9)


def tree(tmp_path_factory):
    folder = tmp_path_factory.mktemp("state")
    (folder / "secret.tlog").write_text("secret")
    (folder / "logs").mkdir()
    (folder / "logs" / "00001-20260101-000000.tlog").write_text("log")
    (folder / "logs" / "00002-20260101-000000.tlog").symlink_to(folder / "secret.tlog")
    (folder / "logs" / "notes.txt").write_text("secret")
    return VehicleFiles(lambda: TABLE_NOW, lambda _kind: SQUARE, FlightRecorder(folder / "logs", lambda: WALL))


PARTS = ["..", ".", "", "logs", "secret.tlog", "notes.txt", "00001-20260101-000000.tlog", "@PARAM", "param.pck",
         "00002-20260101-000000.tlog", "?start=1", "etc", "passwd", "\\", "C:", "component_metadata"]  # fmt: skip


@given(path=st.one_of(st.text(max_size=40), st.lists(st.sampled_from(PARTS), max_size=7).map("/".join)))
def test_no_path_leads_out_of_the_tree(tmp_path_factory, path):
    files = tree(tmp_path_factory)
    for look in (files.entries, files.open):
        try:
            seen = look(path)
        except OSError:
            continue
        text = repr(seen) if look == files.entries else seen.read(0, 1000).decode("latin-1")
        assert "secret" not in text
        assert "00002" not in text


@pytest.mark.parametrize(
    ("path", "error"),
    [
        ("logs/nosuch", FileNotFoundError),
        ("logs", IsADirectoryError),
        ("", IsADirectoryError),
        ("a/b/c", FileNotFoundError),
    ],
)
def test_opening_what_is_not_a_file_fails(path, error):
    files = VehicleFiles(lambda: TABLE_NOW, lambda _kind: (), NoFiles())
    with pytest.raises(error):
        files.open(path)


def test_a_file_cannot_be_listed():
    files = VehicleFiles(lambda: TABLE_NOW, lambda _kind: (), NoFiles())
    with pytest.raises(NotADirectoryError):
        files.entries("@PARAM/param.pck")
