"""Every screen and dialog at 40 sizes of the terminal, from 10x4 up, resized in flight and in a replay."""

import random
from collections.abc import Callable
from dataclasses import dataclass

import pytest

from darko_gcs.feed.pair_feed import PairFeed
from darko_gcs.feed.replay_feed import ReplayFeed
from darko_gcs.tui.app import GroundStationApp
from darko_gcs.tui.replay_app import PairApp, ReplayApp
from darko_gcs.tui.screens.flight_screen import FlightScreen
from protocol.dialect import mavlink
from protocol.tlog import read_tlog
from tests.support.gcs.fleet_feed import FleetFeed, numbered
from tests.support.gcs.planned_snapshots import planned
from tests.support.gcs.screens import FakeFeed, screen_text
from tests.support.gcs.snapshots import FORWARD, snapshot_with
from tests.support.paths import DATA

HEIGHTS = {10: (4, 5, 8, 60), 20: (4, 6, 8, 12, 18), 40: (5, 7, 12, 17, 24), 60: (9, 17, 20, 36), 80: (4, 8, 12, 17, 18,
    19, 20, 21, 24, 60), 110: (10, 18, 36), 120: (4, 14, 19, 40), 180: (17, 52), 200: (6, 18, 60)}  # fmt: skip
SIZES = [(width, height) for width, heights in HEIGHTS.items() for height in heights]
FEW_SIZES = [(10, 4), (80, 17), (20, 8), (120, 6), (10, 60)]


def recorded():
    return ReplayFeed(read_tlog(DATA / "square-flight.tlog"), "square-flight.tlog")


@dataclass
class Case:
    """A screen: who shows it, which keys lead there, and a word that is on it at every size."""

    app: Callable[[], GroundStationApp]
    keys: str = ""
    word: str = "ARMED"
    number: str = ""  # the height


def live(snapshot=FORWARD):
    return GroundStationApp(FakeFeed(snapshot))


def fleet():
    return GroundStationApp(FleetFeed(*(numbered(system) for system in range(1, 8))))


def pair():
    return PairApp(PairFeed(recorded(), recorded(), shift=2.0))


STANDING = snapshot_with(FORWARD, status={"landed_state": mavlink.MAV_LANDED_STATE_ON_GROUND})
SCREENS = {
    "flight": Case(live, number="3.0"),
    "mission": Case(live, "m"),
    "mission map": Case(live, "m tab"),
    "flight plan": Case(lambda: live(planned()[1]), "b"),
    "parameters": Case(live, "p"),
    "messages": Case(live, "e"),
    "inspector": Case(live, "E"),
    "inspector of a replay": Case(lambda: ReplayApp(recorded()), "space 5 E enter", ""),
    "charts": Case(live, "C"),
    "charts of a replay": Case(lambda: ReplayApp(recorded()), "space 5 C 0 left"),
    "fleet": Case(fleet),
    "replay": Case(lambda: ReplayApp(recorded()), "space 5"),
    "pair": Case(pair, "space 5", "A MISSION"),
}
DIALOGS = {
    "help": Case(live, "question_mark", "Keys"),
    "take off": Case(lambda: live(STANDING), "t", "Take"),
    "go to": Case(live, "g", "Go"),
    "disarm": Case(live, "d", "Disarm"),
    "quit": Case(live, "q", "The"),
    "panels": Case(live, "P", "Panels"),
    "speed": Case(live, "c", "Change"),
    "fleet": Case(fleet, "f", "Comma"),
    "palette": Case(live, "ctrl+p", ""),
    "insert": Case(live, "m i", "Insert"),
    "open": Case(live, "m o", "Open"),
    "edit": Case(live, "m e", "Item"),
    "differences": Case(live, "m equals_sign", "Diff"),
    "clear": Case(live, "m c", "Delete"),
    "help of two logs": Case(pair, "question_mark", "Record"),
}


async def resized(case, sizes):
    app = case.app()
    async with app.run_test(size=sizes[0]) as pilot:
        for key in case.keys.split():
            await pilot.press(key)
        for width, height in sizes:
            await pilot.resize_terminal(width, height)
            app.pull()
            await pilot.pause()
            shown = screen_text(app)
            assert case.word in shown, (width, height, shown)
            assert not case.number or case.number in shown, (width, height, shown)


@pytest.mark.long
@pytest.mark.parametrize("name", SCREENS)
async def test_a_screen_shows_what_matters_most_at_every_size(name):
    assert len(SIZES) == 40
    await resized(SCREENS[name], random.Random(name).sample(SIZES, len(SIZES)))


@pytest.mark.long
@pytest.mark.parametrize("name", DIALOGS)
async def test_a_dialog_shows_its_question_at_every_size(name):
    await resized(DIALOGS[name], FEW_SIZES)


@pytest.mark.long
@pytest.mark.parametrize("start", [live, fleet, lambda: ReplayApp(recorded()), pair])
async def test_random_keys_and_sizes_end_nothing(start, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # keys may save a plan
    draw = random.Random(20260731)
    keys = [*"adthlrgvxcksmbpeECAznwofjiu0123+-=<>()[].,PHOSZDI", "tab", "shift+tab", "enter", "escape", "space", "up",
            "down", "left", "right", "shift+left", "shift+up", "ctrl+left", "pageup", "home", "end", "f2", "f7",
            "delete", "question_mark", "ctrl+p", "backspace"]  # fmt: skip
    app = start()
    async with app.run_test(size=(80, 24)) as pilot:
        for _ in range(5):
            await pilot.press(*draw.choices(keys, k=8))
            await pilot.resize_terminal(*draw.choice(SIZES))
            app.pull()
        await pilot.press("escape", "escape", "escape")
        assert any(isinstance(screen, FlightScreen) for screen in app.screen_stack)
