"""Parameters and their metadata, from the real vehicle node and from files with errors."""

import lzma
import math

import pytest

from darko_gcs.state.parameters import ParameterMetadata, is_changed
from darko_gcs.station.parameter_requests import parameter_file_path, parse_parameter_file
from darko_gcs.station.station import Station
from protocol.dialect import mavlink
from protocol.errors import FileError
from protocol.events import FileReceived
from protocol.wire.codec import Codec
from tests.support.gcs.linked_station import LinkedStation
from tests.support.gcs.messages import heartbeat


@pytest.fixture
def link(tmp_path):
    linked = LinkedStation(tmp_path)
    linked.run(2.5)
    return linked


def test_the_vehicle_describes_every_one_of_its_parameters(link):
    link.station.fetch_parameters(link.now)
    link.station.fetch_parameter_metadata(link.now)
    link.run(4.0)
    s = link.snapshot
    assert set(s.parameter_metadata) == set(s.parameters)
    assert len(s.parameters) == s.parameter_count > 40
    assert all(metadata.text and metadata.bounds for metadata in s.parameter_metadata.values())
    assert s.parameter_metadata["DRK_KPP"].unit == "N/m"
    assert not [name for name in s.parameters if is_changed(s, name)]
    assert s.parameter_metadata["NAV_DLL_ACT"].shown(2.0) == "return (2)"
    assert "request message" not in link.text


def test_a_changed_parameter_is_confirmed_and_marked(link):
    link.station.fetch_parameters(link.now)
    link.station.fetch_parameter_metadata(link.now)
    link.run(4.0)
    link.station.set_parameter("DRK_KPP", 1.25, link.now)
    link.run(1.0)
    assert link.snapshot.parameters["DRK_KPP"] == 1.25
    assert [name for name in link.snapshot.parameters if is_changed(link.snapshot, name)] == ["DRK_KPP"]
    assert "Parameter DRK_KPP is 1.25" in link.lines


def test_a_value_that_does_not_fit_another_is_never_shown_as_set(link):
    link.station.fetch_parameters(link.now)
    link.run(4.0)
    for name, value in (("DRK_V_ENTER", 20.0), ("DRK_V_LEAVE", 50.0), ("DRK_V_ENTER", 60.0)):
        link.station.set_parameter(name, value, link.now)
        link.run(2.0)
    assert link.snapshot.parameters["DRK_V_ENTER"] == 20.0
    assert "must stay below DRK_V_LEAVE" in link.text
    assert "Parameter DRK_V_LEAVE is 50" in link.lines
    assert "Parameter DRK_V_ENTER is 60" not in link.lines
    assert "Parameter DRK_V_ENTER: value out of range" in link.lines


def test_a_vehicle_that_takes_an_echoed_value_back_is_reported():
    codec = Codec(1, 1)

    def told(value):
        return codec.encode(mavlink.MAVLink_param_value_message(b"A", value, mavlink.MAV_PARAM_TYPE_REAL32, 1, 0))

    station = Station()
    station.receive(codec.encode(heartbeat()), 0.0, 0)
    station.set_parameter("A", 60.0, 0.0)
    for now, value in ((0.1, 20.0), (0.2, 60.0), (0.3, 20.0)):
        station.receive(told(value), now, 0)
        station.tick(now)
    station.tick(0.8)
    texts = [line.text for line in station.snapshot.messages]
    assert "Parameter A stays 20: the vehicle refused 60" in texts
    station.tick(2.0)
    assert not [text for text in texts if text.startswith("Parameter A is")]


def test_a_refused_value_is_reported_with_the_vehicles_reason(link):
    link.station.set_parameter("DRK_KPP", 99.0, link.now)
    link.run(3.0)
    assert "Parameter DRK_KPP: value out of range" in link.text
    assert "99 is outside 0.1..3" in link.text
    assert link.snapshot.parameters["DRK_KPP"] != 99.0
    assert link.snapshot.parameter_changes["DRK_KPP"].words == "refused: DRK_KPP = 99 refused: 99 is outside 0.1..3"


def test_after_a_restart_the_metadata_is_fetched_again(link):
    link.station.fetch_parameter_metadata(link.now)
    link.run(3.0)
    link.station._handle_restart(link.now)
    assert link.snapshot.parameter_metadata == {}
    link.station.fetch_parameter_metadata(link.now)
    link.run(3.0)
    assert link.snapshot.parameter_metadata


def file_with(**entry):
    return {"parameters": [{"name": "A", **entry}]}


@pytest.mark.parametrize(
    ("entry", "metadata"),
    [
        ({}, ParameterMetadata()),
        ({"shortDesc": "x\x1b[2J", "units": 3, "min": "low", "max": True}, ParameterMetadata(text="x?[2J")),
        (
            {"type": "Uint8", "min": 0, "rebootRequired": True},
            ParameterMetadata(minimum=0.0, is_integer=True, needs_reboot=True),
        ),
        ({"max": 10**400}, ParameterMetadata()),
        (
            {"values": [{"value": 1, "description": "on"}, {"value": "x", "description": "y"}, {"value": 2}, 3]},
            ParameterMetadata(values=((1.0, "on"),)),
        ),
        (
            {"bitmask": [{"index": 0, "description": "GPS"}, {"index": 32, "description": "none"}], "longDesc": "z"},
            ParameterMetadata(bits=((0, "GPS"),), long_text="z"),
        ),
        ({"values": 7, "bitmask": {"index": 1}}, ParameterMetadata()),
    ],
)
def test_fields_that_do_not_follow_the_schema_are_ignored(entry, metadata):
    assert repr(parse_parameter_file(file_with(**entry))["A"]) == repr(metadata)  # NaN is not equal to itself


def test_metadata_without_numbers_has_nan_and_no_range():
    metadata = parse_parameter_file(file_with())["A"]
    assert math.isnan(metadata.default)
    assert metadata.bounds == ""


def test_only_files_on_the_vehicle_are_fetched():
    def general(uri):
        return {"metadataTypes": [7, {"type": 2, "uri": "mftp:///other"}, {"type": 1, "uri": uri}]}

    assert parameter_file_path(general("mftp:///a/b.json")) == "/a/b.json"
    assert parameter_file_path(general("mftp://[;comp=1]/a/b.json")) == "/a/b.json"
    for uri in ("https://example.org/a.json", "", None, ["mftp:///a"]):
        assert parameter_file_path(general(uri)) == ""
    assert parameter_file_path({"metadataTypes": {"type": 1}}) == ""
    with pytest.raises(FileError, match="no list 'parameters'"):
        parse_parameter_file({"parameters": {}})


@pytest.mark.parametrize(
    "data",
    [b"", b"{", b"[]", b"{}", b"\xfd7zXZ\x00rubbish", b"[" * 100_000, lzma.compress(b" " * 50_000_000, preset=0)],
)
def test_a_file_without_metadata_is_reported_with_its_name(data):
    station = Station()
    station.parameter_metadata._awaited_path = "/p.json"
    text = station.parameter_metadata.follow(FileReceived("/p.json", data), 1.0)
    assert text.startswith("No parameter descriptions: /p.json: ")
    assert station.parameter_metadata.known == {}
