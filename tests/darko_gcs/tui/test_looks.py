"""Snapshots at three sizes of every screen and dialog: here of those that have none beside their behaviour."""

import pkgutil
from importlib import import_module
from pathlib import Path

import pytest
from textual.screen import Screen

import darko_gcs.tui
from darko_gcs.feed.replay_feed import ReplayFeed
from darko_gcs.state.message_log import add_line
from darko_gcs.state.snapshot import EMPTY_SNAPSHOT
from darko_gcs.state.values import Alert
from darko_gcs.tui.app import GroundStationApp
from darko_gcs.tui.replay_app import ReplayApp
from protocol.dialect import mavlink
from protocol.tlog import read_tlog
from tests.support.gcs.fleet_feed import FleetFeed, landed, numbered
from tests.support.gcs.parameters_screen import TUNED
from tests.support.gcs.planned_snapshots import planned
from tests.support.gcs.screens import FakeFeed, screen_text, settled, until
from tests.support.gcs.snapshots import FORWARD, HOVERING, snapshot_with
from tests.support.paths import DATA

SIZES = [(80, 24), (120, 40), (200, 60)]
LET_FAIL = snapshot_with(HOVERING, parameters={"values": {"SYS_FAILURE_EN": 1.0}})
ALERTED = snapshot_with(
    add_line(FORWARD, 99.0, mavlink.MAV_SEVERITY_CRITICAL, "Battery low: 12 % left"),
    session={"alerts": (Alert("battery", "battery low: 12 % left", 99.0),)},
)
WAITING = snapshot_with(EMPTY_SNAPSHOT, session={"port": 14661})
LOST = snapshot_with(FORWARD, link={"lost": True})
PLANNED = planned()[1]
PARAMETERS = "DRK_KPP 2\nNAV_DLL_ACT 3\nEKF_AIDS 17\nNOT_HERE 1\n"
LOOKS = {  # flight, keys, words that show that the last of them was taken
    "waiting": (WAITING, (), ["waiting for a vehicle"]),
    "alert": (ALERTED, (), ["!battery"]),
    "lost": (LOST, (), ["LINK LOST"]),
    "fence": (HOVERING, ("m", "G", "i", "enter"), ["inside 1/4", "A square of 80 m"]),
    "rally": (HOVERING, ("m", "G", "G"), ["Rally"]),
    "areas": (HOVERING, ("m", "G", "i"), ["Put into the fence"]),
    "item": (HOVERING, ("m", "down", "e"), ["Latitude"]),
    "insert": (HOVERING, ("m", "i"), ["Jump to an item"]),
    "differences": (HOVERING, ("m", "D", "equals_sign"), ["Differences"]),
    "file": (HOVERING, ("m", "w"), ["Save the plan"]),
    "bits": (TUNED, ("p", "down", "enter"), ["17 becomes 17"]),
    "value": (TUNED, ("p", "down", "down", "enter"), ["now, default"]),
    "failure": (LET_FAIL, ("F",), ["What shall fail"]),
    "failures": (LET_FAIL, ("F", "enter"), ["comes and goes"]),
    "speed": (HOVERING, ("c",), ["air or ground speed"]),
    "question": (HOVERING, ("d",), ["will fall"]),
    "go-to": (HOVERING, ("g",), ["Height above home"]),
    "chart": (FORWARD, ("C", "a"), ["Add to the chart"]),
    "jumps": (HOVERING, ("V",), ["boot time"]),
    "views": (FORWARD, ("C", "o"), ["Open a view"]),
    "view": (FORWARD, ("C", "s"), ["Keep these charts"]),
    "panels": (HOVERING, ("P",), ["Hide decision on the leg"]),
    "comparison": (TUNED, ("p", "f7", "enter"), ["2 of 3 chosen"]),
    "plan-waypoint": (PLANNED, ("b", "tab", "tab", "enter"), ["Move waypoint"]),
    "plan-variable": (PLANNED, ("b", "tab", "tab", "tab", "enter"), ["laps", "Value"]),
    "plan-file": (PLANNED, ("b", "ctrl+o"), ["Names (.toml), if any"]),
    "fleet": (HOVERING, ("f",), ["Command all vehicles"]),
    "palette": (FORWARD, ("ctrl+p",), ["Arm the vehicle"]),
    "quit": (HOVERING, ("q",), ["Quit anyway?"]),
}


SCREENS = {  # by class: what of the above shows it, or the beginning of the names of other snapshots
    "AskScreen": "go-to", "ChooseBitsScreen": "bits", "ChooseScreen": "failure", "ChooseValueScreen": "value",
    "ComparisonScreen": "comparison", "ConfirmScreen": "question", "DifferenceScreen": "differences",
    "FileDialog": "file", "QuitScreen": "quit",
    "ChartsScreen": "screens/__snapshots__/test_charts_screen/",
    "FlightPlanScreen": "screens/__snapshots__/test_flight_plan_screen/",
    "FlightScreen": "__snapshots__/test_app/test_the_flight_screen",
    "HelpScreen": "__snapshots__/test_app/test_help_form_and_question_match_their_snapshots[[]help",
    "InspectorScreen": "screens/__snapshots__/test_inspector_screen/",
    "JumpsScreen": "jumps",
    "MessagesScreen": "screens/__snapshots__/test_messages_screen/",
    "MissionScreen": "screens/__snapshots__/test_mission_editing/test_the_screen",
    "PairScreen": "__snapshots__/test_pair_app/",
    "ParametersScreen": "screens/__snapshots__/test_parameters_screen/",
    "PilotScreen": "screens/__snapshots__/test_pilot_screen/test_the_screens_match_their_snapshots[[]by-hand",
    "PreflightScreen": "screens/__snapshots__/test_pilot_screen/test_the_screens_match_their_snapshots[[]pre-flight",
    "ReplayScreen": "__snapshots__/test_looks/test_a_recording",
}  # fmt: skip
BASES = {"StationScreen", "Dialog"}


@pytest.fixture(autouse=True)
def home(tmp_path, monkeypatch):
    """A folder that holds a file of parameters, and a user without files of their own."""
    for name in ("XDG_CONFIG_HOME", "XDG_STATE_HOME"):
        monkeypatch.setenv(name, str(tmp_path / "own"))
    (tmp_path / "mine.parm").write_text(PARAMETERS)
    monkeypatch.chdir(tmp_path)


def station(name, flight):
    """The ground station of a look."""
    return GroundStationApp(FleetFeed(numbered(1), landed(2)) if name == "fleet" else FakeFeed(flight))


async def shown(pilot, keys, words):
    """Press keys one after another, each when the screen stands still; then wait for words."""
    for key in keys:
        await settled(pilot)
        await pilot.press(key)
    await until(pilot, lambda: all(word in screen_text(pilot.app) for word in words))
    await settled(pilot)


@pytest.mark.long(after=1)
@pytest.mark.parametrize("size", SIZES, ids=lambda size: "x".join(map(str, size)))
@pytest.mark.parametrize("name", LOOKS)
def test_each_matches_its_snapshot(snap_compare, name, size):
    flight, keys, words = LOOKS[name]
    app = station(name, flight)
    assert snap_compare(app, terminal_size=size, run_before=lambda pilot: shown(pilot, keys, words))


@pytest.mark.long(after=1)
@pytest.mark.parametrize("size", SIZES, ids=lambda size: "x".join(map(str, size)))
def test_a_recording_matches_its_snapshot(snap_compare, size):
    feed = ReplayFeed(read_tlog(DATA / "square-flight.tlog"), "square-flight.tlog", begin=20.05)
    feed.playing = False
    assert snap_compare(ReplayApp(feed), terminal_size=size, run_before=lambda pilot: shown(pilot, (), ["0:20.0"]))


def _screens(of=Screen):
    for screen in of.__subclasses__():
        yield screen
        yield from _screens(screen)


def test_every_screen_and_dialog_has_snapshots_at_three_sizes():
    for module in pkgutil.walk_packages(darko_gcs.tui.__path__, "darko_gcs.tui."):
        import_module(module.name)
    ours = {screen.__name__ for screen in _screens() if screen.__module__.startswith("darko_gcs.")}
    assert ours - BASES == set(SCREENS)
    for name, where in SCREENS.items():
        path = f"__snapshots__/test_looks/test_each_matches_its_snapshot[[]{where}-" if where in LOOKS else where
        assert len(list(Path(__file__).parent.glob(f"{path}*.svg"))) >= len(SIZES), name


@pytest.mark.long(after=1)
@pytest.mark.parametrize(("screen", "name"), [pair for pair in SCREENS.items() if pair[1] in LOOKS])
async def test_a_look_that_stands_for_a_screen_shows_it(screen, name):
    flight, keys, words = LOOKS[name]
    app = station(name, flight)
    async with app.run_test(size=(120, 40)) as pilot:
        await shown(pilot, keys, words)
        assert type(app.screen).__name__ == screen
