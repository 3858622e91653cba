"""What the vehicle offers as files, and what it records: over the wire, byte for byte, without a socket."""

import json
import lzma
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocol.dialect import mavlink
from protocol.endpoint import GroundEndpoint
from protocol.engines.files import Log, NoFiles
from protocol.engines.ftp import crc32
from protocol.events import FileFailed, FileListed, FileReceived, LogReceived, LogsListed
from protocol.frames import Geodetic, LocalFrame
from protocol.plans import load
from protocol.plans.mission import MissionItem
from protocol.tlog import read_tlog
from sitl.airframe import load as load_airframe
from sitl.autopilot.arena import ARENAS
from sitl.autopilot.mission import World
from sitl.autopilot.settings import Settings
from sitl.craft import Craft
from sitl.memory import Memory
from sitl.parameters import TABLE, Bindings, Surroundings
from sitl.simulation.simulation import Simulation, Start, Tuning
from sitl.wire import blackbox as recorder
from sitl.wire.blackbox import Blackbox
from sitl.wire.files import VehicleFiles
from sitl.wire.metadata import GENERAL_URI, default_values, metadata_files
from sitl.wire.node import Node
from sitl.wire.packed import pack_parameters, pack_plan
from sitl.wire.telemetry import Instant
from tests.support.paths import DATA

WALL = 1_790_000_000.0  # 2026-09-21 14:13:20 UTC
TABLE_NOW = Bindings(Settings(), Tuning(), Surroundings()).wire_table()
SQUARE = load(DATA / "square.plan").items
FLYING = Start(up=3.0, airborne=True)


class Session:
    """A vehicle and a ground station on a perfect link."""

    def __init__(self, folder, start=FLYING):
        vehicle = Simulation(load_airframe("nominal").parameters, start=start)
        bindings = Bindings(Settings(), Tuning(), Surroundings())
        craft = Craft(vehicle, World(LocalFrame(Geodetic(43.5648, 1.4811, 150.0)), ARENAS["open"]), bindings,
                      airborne=start.airborne)  # fmt: skip
        self.blackbox = Blackbox(folder / "logs", lambda: WALL)
        self.node = Node(craft, Memory(folder / "state"), ["ground"], blackbox=self.blackbox)
        self.ground, self.now, self.events, self.heard = GroundEndpoint(), 0.0, [], []
        self.exchange()

    def exchange(self):
        for _, data in self.node.datagrams(self.now):
            self.heard += self.ground.receive_datagram(data, self.now)
        self.ground.handle_timer(self.now)
        for data in self.ground.datagrams_to_send():
            self.node.receive(data, "ground", self.now)
        self.events += self.ground.events()

    def fly(self, seconds):
        for _ in range(round(seconds / 0.02)):
            self.node.advance(10)
            self.now += 0.02
            self.exchange()

    def wait_for(self, *kinds):
        for _ in range(2000):
            found = next((event for event in self.events if isinstance(event, kinds)), None)
            if found is not None:
                self.events.clear()
                return found
            self.now += 0.01
            self.exchange()
        raise AssertionError(kinds)

    def read(self, path):
        self.ground.read_file(path, self.now)
        return self.wait_for(FileReceived, FileFailed)

    def disarm(self):
        self.ground.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 0.0, 21196.0, now=self.now)
        self.exchange()
        self.exchange()
        self.fly(1.1)

    def texts(self):
        return "".join(m.text for m in self.heard if m.get_type() == "STATUSTEXT")


@pytest.fixture
def session(tmp_path):
    return Session(tmp_path)


def message(session, number):
    session.ground.command(mavlink.MAV_CMD_REQUEST_MESSAGE, float(number), now=session.now)
    session.fly(0.04)
    return next(m for m in reversed(session.heard) if m.get_msgId() == number)


# Files over the wire


def test_the_vehicle_says_that_it_has_files(session):
    version = message(session, mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION)
    assert version.capabilities & mavlink.MAV_PROTOCOL_CAPABILITY_FTP


def test_the_whole_tree_can_be_walked_and_every_file_read(session):
    session.fly(0.1)
    session.ground.list_files("/", session.now)
    folders = [name for name, size in session.wait_for(FileListed).entries if size is None]
    assert folders == ["@PARAM", "@MISSION", "component_metadata", "logs"]
    for folder in folders:
        session.ground.list_files(folder, session.now)
        entries = session.wait_for(FileListed).entries
        assert entries
        for name, size in entries:
            assert len(session.read(f"/{folder}/{name}").data) == size


def test_component_metadata_leads_to_the_parameters(session):
    told = message(session, 397)
    assert told.uri == GENERAL_URI
    packed = session.read(told.uri.removeprefix("mftp://")).data
    assert crc32(packed) == told.file_crc
    (kind,) = json.loads(lzma.decompress(packed))["metadataTypes"]
    parameters = session.read(kind["uri"].removeprefix("mftp://")).data
    assert (kind["type"], kind["fileCrc"]) == (1, crc32(parameters))
    described = {entry["name"]: entry for entry in json.loads(lzma.decompress(parameters))["parameters"]}
    assert list(described) == [entry.name for entry in TABLE]
    wind = described["SIM_WIND_SPD"]
    assert (wind["type"], wind["units"], wind["min"], wind["max"], wind["default"]) == ("Float", "m/s", 0, 30, 0)
    assert all(d["min"] <= d["default"] <= d["max"] and d["shortDesc"] for d in described.values())
    assert described["DRK_GOVERNOR"]["type"] == "Int32"


def test_metadata_keeps_to_the_schema():
    general = json.loads(metadata_files()["general.json"])
    assert set(general) <= {"version", "vendorName", "modelName", "firmwareVersion", "hardwareVersion", "metadataTypes"}
    known = {"name", "type", "shortDesc", "longDesc", "units", "default", "decimalPlaces", "min", "max", "increment",
             "rebootRequired", "group", "category", "volatile", "values", "bitmask", "readOnly"}  # fmt: skip
    parameters = json.loads(metadata_files()["parameter.json"])
    assert parameters["version"] >= 3
    assert all(set(parameter) <= known for parameter in parameters["parameters"])


def test_nothing_can_be_written(session):
    for opcode in (6, 8, 9, 10, 11, 12, 13):
        payload = struct.pack("<HBBBBBxI", opcode, 0, opcode, 14, 0, 0, 0) + b"logs/new.tlog\0"
        request = mavlink.MAVLink_file_transfer_protocol_message(0, 1, 1, list(payload.ljust(251, b"\0")))
        session.ground.send(request)
        session.exchange()
        session.exchange()
        answer = next(m for m in reversed(session.heard) if m.get_type() == "FILE_TRANSFER_PROTOCOL")
        assert (answer.payload[3], answer.payload[5], answer.payload[12]) == (129, opcode, 9)


# Parameters and plans as files


def decoder():
    return pytest.importorskip("MAVProxy.modules.lib.param_ftp").ftp_param_decode


def test_mavproxy_reads_the_parameters(session):
    decoded = decoder()(session.read("@PARAM/param.pck").data)
    told = {name.decode(): value for name, value, _ in decoded.params}
    assert told == {p.name: pytest.approx(p.value, rel=1e-6) for p in TABLE_NOW}
    assert decoded.defaults is None


def test_mavproxy_reads_defaults_beside_changed_values():
    changed = Bindings(Settings(), Tuning(kpp=2.0, integral=0), Surroundings()).wire_table()
    decoded = decoder()(pack_parameters(changed, default_values()))
    values, defaults = ({name.decode(): v for name, v, _ in table} for table in (decoded.params, decoded.defaults))
    assert (values["DRK_KPP"], defaults["DRK_KPP"]) == (2.0, 1.5)
    assert (values["DRK_LQI"], defaults["DRK_LQI"]) == (0, 1)
    assert {n for n in values if values[n] != defaults[n]} == {"DRK_KPP", "DRK_LQI"}


def test_parts_of_the_parameters_join():
    whole = pack_parameters(TABLE_NOW)
    parts = [pack_parameters(TABLE_NOW, start=n, count=10) for n in range(0, len(TABLE_NOW), 10)]
    assert struct.unpack_from("<HHH", whole) == (0x671B, len(TABLE_NOW), len(TABLE_NOW))
    assert sum(struct.unpack_from("<HHH", part)[1] for part in parts) == len(TABLE_NOW)


@given(st.lists(st.from_regex(r"[A-Z0-9_]{1,16}", fullmatch=True), unique=True, min_size=1, max_size=40))
def test_any_names_survive_the_packing(names):
    table = [TABLE_NOW[0].__class__(name, mavlink.MAV_PARAM_TYPE_INT32, n) for n, name in enumerate(names)]
    decoded = decoder()(pack_parameters(table))
    assert {name.decode(): value for name, value, _ in decoded.params} == {p.name: p.value for p in table}


def test_a_plan_in_a_file_is_the_plan():
    data = pack_plan(SQUARE, 0)
    kind = mavlink.MAVLink_mission_item_int_message
    assert struct.unpack_from("<HHHHH", data) == (0x763D, 0, 0, 0, len(SQUARE))
    for seq, item in enumerate(SQUARE):
        fields = kind.unpacker.unpack_from(data, 10 + seq * kind.unpacker.size)
        message = kind(*(fields[kind.orders[at]] for at in range(len(fields))))
        assert (message.seq, message.mission_type, MissionItem.from_message(message)) == (seq, 0, item)


# Names


def tree(tmp_path_factory):
    folder = tmp_path_factory.mktemp("state")
    (folder / "secret.tlog").write_text("secret")
    (folder / "logs").mkdir()
    (folder / "logs" / "00001-20260101-000000.tlog").write_text("log")
    (folder / "logs" / "00002-20260101-000000.tlog").symlink_to(folder / "secret.tlog")
    (folder / "logs" / "notes.txt").write_text("secret")
    return VehicleFiles(lambda: TABLE_NOW, lambda _kind: SQUARE, Blackbox(folder / "logs", lambda: WALL))


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
def test_what_is_no_file_is_said_as_it_is(path, error):
    files = VehicleFiles(lambda: TABLE_NOW, lambda _kind: (), NoFiles())
    with pytest.raises(error):
        files.open(path)


def test_a_file_is_no_folder():
    files = VehicleFiles(lambda: TABLE_NOW, lambda _kind: (), NoFiles())
    with pytest.raises(NotADirectoryError):
        files.entries("@PARAM/param.pck")


# The flight recorder


def test_a_flight_is_recorded_listed_and_downloaded(session):
    session.fly(0.5)
    session.disarm()
    session.ground.list_logs(session.now)
    (log,) = session.wait_for(LogsListed).logs
    assert log.time_utc == WALL
    session.ground.fetch_log(log, session.now)
    data = session.wait_for(LogReceived).data
    (named,) = session.blackbox.logs()
    assert named == Log("00001-20260921-141320.tlog", int(WALL), len(data))
    assert session.read(f"logs/{named.name}").data == data


def test_a_log_is_a_telemetry_log_of_the_flight(session, tmp_path):
    session.fly(1.0)
    session.disarm()
    session.fly(0.5)
    assert not session.blackbox.is_recording
    log = read_tlog(tmp_path / "logs" / session.blackbox.logs()[0].name)
    assert not log.damage
    assert 1.9 <= (int(log.times[-1]) - WALL * 1e6) / 1e6 <= 2.1
    kinds = {log.decode(index).get_type() for index in range(len(log))}
    assert {"HEARTBEAT", "ATTITUDE_QUATERNION", "DARKO_HYBRID_STATE", "STATUSTEXT"} <= kinds


def test_a_log_begins_with_arming_and_ends_with_disarming(tmp_path):
    session = Session(tmp_path, Start())
    session.fly(0.1)
    session.ground.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1.0, now=session.now)
    session.fly(0.2)
    session.disarm()
    log = read_tlog(tmp_path / "logs" / session.blackbox.logs()[0].name)
    texts = [log.decode(index).text for index in log.rows("STATUSTEXT")]
    assert texts[0] == "Armed"
    assert "Disarmed" in texts


def test_the_ground_alone_is_not_recorded(tmp_path):
    session = Session(tmp_path, Start())
    session.fly(0.2)
    assert session.blackbox.logs() == []
    session.ground.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1.0, now=session.now)
    session.fly(0.1)
    assert session.blackbox.is_recording


def flights(box, count, seconds=1.0, picture=None):
    """Arm and disarm; the recorder sees a vehicle that stands still."""
    for number in range(count):
        for step in range(round(seconds * 10)):
            box.follow(1000.0 * number + step / 10, Instant(lambda: picture).message, armed=True)
        for later in (0.0, recorder.AFTER):
            box.follow(1000.0 * number + seconds + later, Instant(lambda: picture).message, armed=False)


def test_logs_are_bounded_in_number_and_size(session, tmp_path, monkeypatch):
    picture = session.node.picture()
    monkeypatch.setattr(recorder, "MOST_FILES", 4)
    box = Blackbox(tmp_path / "box", lambda: WALL)
    flights(box, 7, picture=picture)
    assert [log.name[:5] for log in box.logs()] == ["00004", "00005", "00006", "00007"]
    monkeypatch.setattr(recorder, "LARGEST", 20_000)
    monkeypatch.setattr(recorder, "MOST_BYTES", 90_000)
    flights(box, 1, 30.0, picture=picture)
    sizes = [path.stat().st_size for path in (tmp_path / "box").iterdir()]
    assert sum(sizes) <= 90_000
    assert max(sizes) < 20_000 + 300
    assert sorted(path.name for path in (tmp_path / "box").iterdir()) == [log.name for log in box.logs()]


def test_a_restart_goes_on_counting_whatever_the_clock_says(session, tmp_path):
    picture = session.node.picture()
    flights(Blackbox(tmp_path / "box", lambda: WALL), 2, picture=picture)
    again = Blackbox(tmp_path / "box", lambda: -5.0)
    flights(again, 1, picture=picture)
    assert [log.name for log in again.logs()] == [
        "00001-20260921-141320.tlog",
        "00002-20260921-141320.tlog",
        "00003-19700101-000000.tlog",
    ]


@pytest.mark.parametrize("clock", [-1e18, 1e18])
def test_a_clock_that_is_far_off_dates_a_log_wrongly_and_costs_none_of_it(session, tmp_path, clock):
    box = Blackbox(tmp_path / "box", lambda: clock)
    flights(box, 2, picture=session.node.picture())
    assert box.complaints() == []
    readers = [read_tlog(tmp_path / "box" / log.name) for log in box.logs()]
    assert [len(reader.rows("ATTITUDE")) for reader in readers] == [12, 12]
    assert not any(len(reader.backward) for reader in readers)


def test_erasing_spares_the_flight_under_way(session):
    flights(session.blackbox, 2, picture=session.node.picture())
    session.fly(0.1)
    session.ground.send(mavlink.MAVLink_log_erase_message(1, 1))
    session.fly(0.1)
    assert [log.name[:5] for log in session.blackbox.logs()] == ["00003"]
    assert "2 logs erased" in session.texts()


def test_a_folder_that_cannot_be_written_is_said_and_the_flight_goes_on(tmp_path):
    (tmp_path / "logs").write_text("in the way")
    session = Session(tmp_path)
    session.fly(0.5)
    assert "Flight not recorded" in session.texts()
    assert session.node.craft.vehicle.time == pytest.approx(0.5)


def test_a_full_disk_ends_the_log_and_is_said_once(session, tmp_path):
    session.fly(0.1)
    session.blackbox._writer._stream = open("/dev/full", "wb", buffering=0)  # noqa: PTH123, SIM115
    session.fly(3.0)
    assert session.texts().count("recording stopped") == 1
    assert not session.blackbox.is_recording


def test_a_log_that_grows_stays_as_it_was_when_it_was_opened(session):
    session.fly(1.5)
    (log,) = session.blackbox.logs()
    file = session.blackbox.open(log.name)
    session.fly(1.5)
    assert session.blackbox.logs()[0].size > file.size == log.size
    file.close()
