"""Parameters of the vehicle: their descriptions, fetched over MAVFTP and kept on disk, and changes that are judged."""

import lzma
import math

import pytest

from darko_gcs.feed.replay_feed import ReplayFeed
from darko_gcs.state.parameters import ChangeState, ParameterMetadata, is_changed, refused_changes
from darko_gcs.station.parameter_requests import (
    MAX_OPEN_CHANGES,
    KnownParameters,
    parameter_file_path,
    parse_parameter_file,
)
from darko_gcs.station.station import Station
from protocol.dialect import mavlink
from protocol.errors import FileError
from protocol.events import FileReceived
from protocol.tlog import TlogReader, read_tlog
from protocol.wire.codec import Codec
from tests.support.gcs.linked_station import LinkedStation
from tests.support.gcs.messages import heartbeat
from tests.support.logs import bare, log_of
from tests.support.paths import DATA


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
    assert set(s.parameters.metadata) == set(s.parameters.values)
    assert len(s.parameters.values) == s.parameters.total > 40
    assert all(metadata.text and metadata.bounds for metadata in s.parameters.metadata.values())
    assert s.parameters.metadata["DRK_KPP"].unit == "N/m"
    assert not [name for name in s.parameters.values if is_changed(s, name)]
    assert s.parameters.metadata["NAV_DLL_ACT"].shown(2.0) == "return (2)"
    assert "request message" not in link.text


def test_a_changed_parameter_is_confirmed_and_marked(link):
    link.station.fetch_parameters(link.now)
    link.station.fetch_parameter_metadata(link.now)
    link.run(4.0)
    link.station.set_parameter("DRK_KPP", 1.25, link.now)
    link.run(1.0)
    assert link.snapshot.parameters.values["DRK_KPP"] == 1.25
    assert [name for name in link.snapshot.parameters.values if is_changed(link.snapshot, name)] == ["DRK_KPP"]
    assert "Parameter DRK_KPP is 1.25" in link.lines


@pytest.mark.long
def test_a_value_that_does_not_fit_another_is_never_shown_as_set(link):
    link.station.fetch_parameters(link.now)
    link.run(4.0)
    for name, value in (("DRK_V_ENTER", 20.0), ("DRK_V_LEAVE", 50.0), ("DRK_V_ENTER", 60.0)):
        link.station.set_parameter(name, value, link.now)
        link.run(2.0)
    assert link.snapshot.parameters.values["DRK_V_ENTER"] == 20.0
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
    texts = [line.text for line in station.snapshot.log.lines]
    assert "Parameter A stays 20: the vehicle refused 60" in texts
    station.tick(2.0)
    assert not [text for text in texts if text.startswith("Parameter A is")]


def test_a_refused_value_is_reported_with_the_vehicles_reason(link):
    link.station.set_parameter("DRK_KPP", 99.0, link.now)
    link.run(3.0)
    assert "Parameter DRK_KPP: value out of range" in link.text
    assert "99 is outside 0.1..3" in link.text
    assert link.snapshot.parameters.values["DRK_KPP"] != 99.0
    assert link.snapshot.parameters.changes["DRK_KPP"].words == "refused: DRK_KPP = 99 refused: 99 is outside 0.1..3"


@pytest.mark.long
def test_after_a_restart_the_metadata_is_fetched_again(link):
    link.station.fetch_parameter_metadata(link.now)
    link.run(3.0)
    link.station._handle_restart(link.now)
    assert link.snapshot.parameters.metadata == {}
    link.station.fetch_parameter_metadata(link.now)
    link.run(3.0)
    assert link.snapshot.parameters.metadata


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


FILE = b'{"parameters": [{"name": "DRK_KPP", "type": "Float", "shortDesc": "a gain", "default": 2.0}]}'


def test_what_the_vehicle_told_names_the_parameters_of_a_recording_of_it(tmp_path):
    known = KnownParameters(tmp_path / "state" / "parameters.json")
    assert known.load() == {}
    known.keep(FILE)
    meanings = known.load()
    assert meanings["DRK_KPP"].text == "a gain"
    own = ReplayFeed(read_tlog(DATA / "square-flight.tlog"), "x", parameters=meanings)
    own.seek(own.duration)
    assert own.snapshot.parameters.metadata == meanings
    other = ReplayFeed(TlogReader(log_of([bare(heartbeat())])), "x", parameters=meanings)
    assert other.snapshot.parameters.metadata == {}


def test_a_broken_file_or_a_folder_that_cannot_be_written_costs_only_the_names(tmp_path):
    (tmp_path / "broken").write_bytes(b"{")
    assert KnownParameters(tmp_path / "broken").load() == {}
    KnownParameters(tmp_path / "broken" / "below").keep(FILE)


REAL = mavlink.MAV_PARAM_TYPE_REAL32


class Vehicle:
    """A vehicle that takes values up to a limit, and "LOW" only below "HIGH"; its texts say why not."""

    def __init__(self, station, **values):
        self.station, self.codec, self.values, self.now = station, Codec(1, 1), values, 0.0
        self.told, self.sent, self.most_at_once = [], [], 0
        self._send(heartbeat())
        station.fetch_parameters(0.0)

    def run(self, seconds):
        end = self.now + seconds
        while self.now < end:
            self.now += 0.05
            requests = [m for data in self.station.outgoing(self.now, 0) for m in self.codec.decode(data)]
            sets = [m for m in requests if m.get_type() == "PARAM_SET"]
            self.most_at_once = max(self.most_at_once, len(sets))
            for message in requests:
                if message.get_type() in {"PARAM_REQUEST_LIST", "PARAM_REQUEST_READ"}:
                    for name in self.values:
                        self._tell(name)
            for message in sets:
                self._set(message.param_id, message.param_value)
            self._send(heartbeat())
            self.station.tick(self.now)

    def _set(self, name, value):
        self.sent.append((name, value))
        before, self.values[name] = self.values[name], value
        self._tell(name)  # some vehicles echo first and refuse then
        if value > 100 or (name in {"LOW", "HIGH"} and self.values["LOW"] >= self.values["HIGH"]):
            self.values[name] = before
            self._tell(name)
            if name not in self.told:  # nobody repeats the same text all the time
                self._send(mavlink.MAVLink_statustext_message(4, f"{name} = {value:g} does not fit".encode()))
            self.told.append(name)

    def _tell(self, name):
        index = list(self.values).index(name)
        self._send(mavlink.MAVLink_param_value_message(name.encode(), self.values[name], REAL, len(self.values), index))

    def _send(self, message):
        self.station.receive(self.codec.encode(message), self.now, 0)


@pytest.fixture
def station():
    return Station()


def states(station):
    return {name: change.state for name, change in station.snapshot.parameters.changes.items()}


def test_each_of_several_changes_is_told_by_itself(station):
    vehicle = Vehicle(station, A=1.0, B=2.0)
    vehicle.run(0.3)
    station.set_parameters({"A": 5.0, "B": 500.0}, vehicle.now)
    assert states(station) == {"A": ChangeState.WAITING, "B": ChangeState.WAITING}
    vehicle.run(0.3)
    assert ChangeState.SET not in states(station).values()  # it may still be refused
    vehicle.run(3.0)
    assert states(station) == {"A": ChangeState.SET, "B": ChangeState.REFUSED}
    assert station.snapshot.parameters.values == {"A": 5.0, "B": 2.0}
    refused = refused_changes(station.snapshot.parameters.changes)
    assert {name: change.words for name, change in refused.items()} == {"B": "refused: B = 500 does not fit"}
    lines = [line.text for line in station.snapshot.log.lines]
    assert "Parameter A is 5" in lines
    assert "Parameter B is 500" not in lines
    assert lines.count("Parameter B stays 2: the vehicle refused 500") == 1


def test_a_value_that_fits_only_with_the_others_is_tried_again_after_them(station):
    vehicle = Vehicle(station, HIGH=20.0, LOW=10.0)
    vehicle.run(0.3)
    station.set_parameters({"LOW": 30.0, "HIGH": 40.0}, vehicle.now)
    vehicle.run(3.0)
    assert states(station) == {"HIGH": ChangeState.SET, "LOW": ChangeState.SET}
    assert vehicle.values == {"HIGH": 40.0, "LOW": 30.0}
    assert vehicle.sent.count(("LOW", 30.0)) == 2


def test_the_reason_of_the_first_refusal_is_told_after_the_second(station):
    vehicle = Vehicle(station, A=1.0, B=2.0)
    vehicle.run(0.3)
    station.set_parameters({"B": 500.0, "A": 5.0}, vehicle.now)
    vehicle.run(3.0)
    assert vehicle.told == ["B", "B"]
    assert station.snapshot.parameters.changes["B"].words == "refused: B = 500 does not fit"


def test_a_single_refused_value_is_not_tried_again(station):
    vehicle = Vehicle(station, A=1.0)
    vehicle.run(0.3)
    station.set_parameter("A", 500.0, vehicle.now)
    vehicle.run(3.0)
    assert states(station) == {"A": ChangeState.REFUSED}
    assert vehicle.sent.count(("A", 500.0)) == 1


def test_a_long_file_is_sent_a_few_at_a_time(station):
    vehicle = Vehicle(station, **{f"P{number}": 0.0 for number in range(40)})
    vehicle.run(0.3)
    station.set_parameters(dict.fromkeys(vehicle.values, 1.0), vehicle.now)
    vehicle.run(3.0)
    assert set(states(station).values()) == {ChangeState.SET}
    assert 1 < vehicle.most_at_once <= MAX_OPEN_CHANGES


def test_without_a_vehicle_a_change_is_refused_at_once(station):
    station.set_parameter("A", 1.0, 0.0)
    assert states(station) == {"A": ChangeState.REFUSED}
    assert station.snapshot.parameters.changes["A"].reason
