"""The vehicle's parameters: fetched, explained by the vehicle itself, filtered and changed."""

import json
import lzma
import math
from dataclasses import replace

import pytest
from textual.widgets import Input

from darko_gcs.app import GroundStation
from darko_gcs.meanings import Meaning, read_meanings, read_parameter_path
from darko_gcs.screens.dialogs import AskScreen
from darko_gcs.screens.parameters import ParametersScreen, differs, matching, row
from darko_gcs.station import Station
from protocol.codec import Codec
from protocol.dialect import mavlink
from protocol.errors import FileError
from protocol.events import FileReceived
from tests.darko_gcs.screens import FLYING, FakeFeed, screen_text, until
from tests.support.station_pair import Pair

GAIN = Meaning("Position gain", "N/m", 0.1, 3.0, 1.2)
LAW = Meaning("Integral in the linear law", "", 0.0, 1.0, 1.0, is_whole=True)
TUNED = replace(
    FLYING,
    parameters={"DRK_KPP": 1.5, "DRK_LQI": 1, "SIM_[red]": 2.0}, parameter_count=3,
    meanings={"DRK_KPP": GAIN, "DRK_LQI": LAW},
)  # fmt: skip


@pytest.fixture
def pair(tmp_path):
    made = Pair(tmp_path)
    made.run(2.5)
    return made


@pytest.fixture
def feed():
    return FakeFeed(TUNED)


def test_the_vehicle_explains_every_one_of_its_parameters(pair):
    pair.station.fetch_parameters(pair.now)
    pair.station.fetch_meanings(pair.now)
    pair.run(4.0)
    s = pair.snapshot
    assert set(s.meanings) == set(s.parameters)
    assert len(s.parameters) == s.parameter_count > 40
    assert all(meaning.text and meaning.bounds for meaning in s.meanings.values())
    assert s.meanings["DRK_KPP"].unit == "N/m"
    assert not [name for name in s.parameters if differs(s, name)]
    assert "request message" not in " ".join(line.text for line in s.messages)


def test_a_parameter_is_changed_confirmed_and_marked(pair):
    pair.station.fetch_parameters(pair.now)
    pair.station.fetch_meanings(pair.now)
    pair.run(4.0)
    pair.station.set_parameter("DRK_KPP", 1.25, pair.now)
    pair.run(1.0)
    assert pair.snapshot.parameters["DRK_KPP"] == 1.25
    assert [name for name in pair.snapshot.parameters if differs(pair.snapshot, name)] == ["DRK_KPP"]
    assert any(line.text == "Parameter DRK_KPP is 1.25" for line in pair.snapshot.messages)


def test_what_the_vehicle_refuses_is_said_in_its_words(pair):
    pair.station.set_parameter("DRK_KPP", 99.0, pair.now)
    pair.run(3.0)
    said = " ".join(line.text for line in pair.snapshot.messages)
    assert "Parameter DRK_KPP: value out of range" in said
    assert "99 is outside 0.1..3" in said
    assert pair.snapshot.parameters["DRK_KPP"] != 99.0


def test_another_program_on_the_vehicle_is_asked_again(pair):
    pair.station.fetch_meanings(pair.now)
    pair.run(3.0)
    pair.station._begin_anew(pair.now)
    assert pair.snapshot.meanings == {}
    pair.station.fetch_meanings(pair.now)
    pair.run(3.0)
    assert pair.snapshot.meanings


def test_values_of_a_vehicle_that_casts_are_read_as_floats():
    station, codec = Station(), Codec(1, 1)
    beat = mavlink.MAVLink_heartbeat_message(2, mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA, 1, 0, 4, 3)
    value = mavlink.MAVLink_param_value_message(b"RTL_ALT", 1500.0, mavlink.MAV_PARAM_TYPE_INT32, 900, 3)
    for message in (beat, value):
        station.receive(codec.encode(message), 1.0, 0)
    assert station.snapshot.parameters == {"RTL_ALT": 1500.0}


def metadata(**entry):
    return {"parameters": [{"name": "A", **entry}]}


@pytest.mark.parametrize(
    ("entry", "meaning"),
    [
        ({}, Meaning()),
        ({"shortDesc": "x\x1b[2J", "units": 3, "min": "low", "max": True}, Meaning("x?[2J")),
        ({"type": "Uint8", "min": 0, "rebootRequired": True}, Meaning("", "", 0.0, is_whole=True, needs_reboot=True)),
        ({"max": 10**400}, Meaning()),
    ],
)
def test_what_is_not_as_the_schema_has_it_is_passed_over(entry, meaning):
    assert repr(read_meanings(metadata(**entry))["A"]) == repr(meaning)  # NaN is like NaN there


def test_only_files_of_the_vehicle_itself_are_asked_for():
    def general(uri):
        return {"metadataTypes": [7, {"type": 2, "uri": "mftp:///other"}, {"type": 1, "uri": uri}]}

    assert read_parameter_path(general("mftp:///a/b.json")) == "/a/b.json"
    assert read_parameter_path(general("mftp://[;comp=1]/a/b.json")) == "/a/b.json"
    for uri in ("https://example.org/a.json", "", None, ["mftp:///a"]):
        assert read_parameter_path(general(uri)) == ""
    assert read_parameter_path({"metadataTypes": {"type": 1}}) == ""
    with pytest.raises(FileError, match="no list 'parameters'"):
        read_meanings({"parameters": {}})


@pytest.mark.parametrize(
    "data", [b"", b"{", b"[]", b"{}", b"\xfd7zXZ\x00rubbish", b"[" * 100_000, lzma.compress(b" " * 50_000_000)]
)
def test_a_file_that_describes_nothing_is_said_by_its_name(data):
    station = Station()
    station.meanings._awaited = "/p.json"
    text = station.meanings.follow(FileReceived("/p.json", data), 1.0)
    assert text.startswith("Descriptions of the parameters: /p.json: ")
    assert station.meanings.known == {}


def test_a_filter_looks_in_names_and_meanings():
    assert matching(TUNED, "") == ("DRK_KPP", "DRK_LQI", "SIM_[red]")
    assert matching(TUNED, "gain drk") == ("DRK_KPP",)
    assert matching(TUNED, "linear") == ("DRK_LQI",)
    assert matching(TUNED, "nothing") == ()
    assert matching(TUNED, "", only_changed=True) == ("DRK_KPP",)


def test_a_row_says_value_unit_range_and_what_was_changed():
    assert [str(cell) for cell in row(TUNED, "DRK_KPP")] == ["*", "DRK_KPP", "1.5", "N/m", "0.1..3", "Position gain"]
    assert [str(cell) for cell in row(TUNED, "SIM_[red]")] == [" ", "SIM_[red]", "2", "", "", ""]


@pytest.mark.parametrize(
    ("meaning", "value", "words"),
    [
        (GAIN, 3.0, None), (GAIN, 3.1, "3.1 is not within 0.1..3 N/m"), (LAW, 0.5, "0.5 is not a whole number"),
        (Meaning(minimum=1.0), 0.0, "0 is not within 1.."), (Meaning(), 1e30, None),
    ],
)  # fmt: skip
def test_a_value_out_of_bounds_is_refused_in_words(meaning, value, words):
    assert meaning.complaint(value) == words


async def test_a_parameter_is_found_by_typing_and_changed(feed):
    app = GroundStation(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("p")
        await until(pilot, lambda: isinstance(app.screen, ParametersScreen) and "3 of 3 parameters" in screen_text(app))
        await until(pilot, lambda: feed.station.asked == [("fetch_meanings",)])
        assert "SIM_[red]" in screen_text(app)
        await pilot.press(*"position")
        await until(pilot, lambda: "1 of 3 parameters shown, 1 (*)" in screen_text(app))
        assert "DRK_KPP: Position gain, 0.1..3 N/m, default 1.2" in screen_text(app)
        await pilot.press("enter")
        await until(pilot, lambda: isinstance(app.screen, AskScreen) and isinstance(app.focused, Input))
        app.focused.value = "9"
        await pilot.press("enter")
        await until(pilot, lambda: "DRK_KPP: 9 is not within 0.1..3 N/m" in screen_text(app))
        app.focused.value = "2.5"
        await pilot.press("enter")
        await until(pilot, lambda: feed.station.asked[-1] == ("set_parameter", "DRK_KPP", 2.5))
        feed.snapshot = replace(TUNED, parameters={**TUNED.parameters, "DRK_KPP": 2.5})
        await until(pilot, lambda: "DRK_KPP    2.5 " in screen_text(app))
        await pilot.press("escape")
        await until(pilot, lambda: "3 of 3 parameters" in screen_text(app))
        await pilot.press("escape")
        await until(pilot, lambda: not isinstance(app.screen, ParametersScreen))


async def test_parameters_of_a_recording_are_shown_and_not_changed(feed):
    feed.station, feed.snapshot = None, replace(TUNED, meanings={})
    app = GroundStation(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("p")
        await until(pilot, lambda: "the vehicle does not say what it means" in screen_text(app))
        await pilot.press("enter")
        await pilot.pause()
        assert isinstance(app.screen, ParametersScreen)


def test_metadata_without_numbers_says_nan():
    meaning = read_meanings(json.loads(json.dumps(metadata())))["A"]
    assert math.isnan(meaning.default)
    assert meaning.bounds == ""
