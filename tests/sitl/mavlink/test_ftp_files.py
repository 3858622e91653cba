"""Files on offer over MAVLink FTP: what is there, and that no path leads out of the tree."""

import json
import lzma
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocol.dialect import mavlink
from protocol.engines.file_transfer import NoFiles, crc32
from protocol.engines.table_values import Parameter
from protocol.plans import load
from protocol.plans.plan import MissionItem
from sitl.mavlink.flight_recorder import FlightRecorder
from sitl.mavlink.ftp_files import GENERAL_URI, VehicleFiles, default_values, metadata_files, pack_parameters, pack_plan
from sitl.simulation.tuning import Tuning
from sitl.vehicle.parameters import PARAMETERS, Configuration
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


# Component metadata: ground stations find the description of every parameter.


def test_component_metadata_leads_to_the_parameters(session):
    told = session.message(mavlink.MAVLINK_MSG_ID_COMPONENT_METADATA)
    assert told.uri == GENERAL_URI
    packed = session.read(told.uri.removeprefix("mftp://")).data
    assert crc32(packed) == told.file_crc
    (kind,) = json.loads(lzma.decompress(packed))["metadataTypes"]
    parameters = session.read(kind["uri"].removeprefix("mftp://")).data
    assert (kind["type"], kind["fileCrc"]) == (1, crc32(parameters))
    described = {entry["name"]: entry for entry in json.loads(lzma.decompress(parameters))["parameters"]}
    assert list(described) == list(PARAMETERS)
    wind = described["SIM_WIND_SPD"]
    assert (wind["type"], wind["units"], wind["min"], wind["max"], wind["default"]) == ("Float", "m/s", 0, 30, 0)
    assert all(d["min"] <= d["default"] <= d["max"] and d["shortDesc"] for d in described.values())
    assert described["DRK_LIN_DESIGN"]["type"] == "Int32"


def test_metadata_keeps_to_the_schema():
    general = json.loads(metadata_files()["general.json"])
    assert set(general) <= {"version", "vendorName", "modelName", "firmwareVersion", "hardwareVersion", "metadataTypes"}
    known = {"name", "type", "shortDesc", "longDesc", "units", "default", "decimalPlaces", "min", "max", "increment",
             "rebootRequired", "group", "category", "volatile", "values", "bitmask", "readOnly"}  # fmt: skip
    parameters = json.loads(metadata_files()["parameter.json"])
    assert parameters["version"] >= 3
    assert all(set(parameter) <= known for parameter in parameters["parameters"])


def test_a_switch_tells_the_names_of_its_values():
    described = {entry["name"]: entry for entry in json.loads(metadata_files()["parameter.json"])["parameters"]}
    assert described["DRK_CONTROLLER"]["values"] == [
        {"value": 0, "description": "the report's switched laws"}, {"value": 1, "description": "INDI"},
        {"value": 2, "description": "a robust PI law, hovering only"},
        {"value": 3, "description": "the hybrid controller: INDI, a proved law for the calm hover, one that "
         "catches falls"},
    ]  # fmt: skip
    assert "values" not in described["SIM_WIND_SPD"]
    integers = {name: entry for name, entry in described.items() if entry["type"] == "Int32"}
    for name, entry in integers.items():
        numbers = [row["value"] for row in entry["values"]]
        assert entry["min"] == numbers[0] < numbers[-1] == entry["max"], name
        assert entry["default"] in numbers, name


# Parameters and plans as single files: MAVProxy reads back what was packed.


def decoder():
    return pytest.importorskip("MAVProxy.modules.lib.param_ftp").ftp_param_decode


def test_mavproxy_reads_the_parameters(tmp_path):
    decoded = decoder()(FileSession(tmp_path).read("@PARAM/param.pck").data)
    told = {name.decode(): value for name, value, _ in decoded.params}
    assert told == {p.name: pytest.approx(p.value, rel=1e-6) for p in TABLE_NOW}
    assert decoded.defaults is None


def test_mavproxy_reads_defaults_beside_changed_values():
    changed = Configuration(tuning=Tuning(kpp=2.0, integral=0)).wire_table()
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
    kind = mavlink.MAV_PARAM_TYPE_INT32
    table = [Parameter(name=name, type=kind, value=n) for n, name in enumerate(names)]
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
