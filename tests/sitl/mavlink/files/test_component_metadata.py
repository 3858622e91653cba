"""Component metadata: ground stations find the description of every parameter."""

import json
import lzma

import pytest

from protocol.dialect import mavlink
from protocol.engines.ftp_packet import crc32
from sitl.mavlink.ftp_files import GENERAL_URI, metadata_files
from sitl.vehicle.parameters import PARAMETERS
from tests.support.vehicle.file_session import FileSession


@pytest.fixture
def session(tmp_path):
    return FileSession(tmp_path)


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
        {"value": 0, "description": "the hybrid controller"}, {"value": 1, "description": "INDI"},
    ]  # fmt: skip
    assert "values" not in described["SIM_WIND_SPD"]
    integers = {name: entry for name, entry in described.items() if entry["type"] == "Int32"}
    for name, entry in integers.items():
        numbers = [row["value"] for row in entry["values"]]
        assert entry["min"] == numbers[0] < numbers[-1] == entry["max"], name
        assert entry["default"] in numbers, name
