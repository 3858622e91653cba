"""The flight screen beyond its numbers: what a vast one has, the map by mouse and keys, ages, and what is kept."""

import pytest
from textual.events import MouseScrollUp

from darko_gcs.preferences import Preferences, PreferencesFile
from darko_gcs.state.values import Doubt, Truth
from darko_gcs.tui.app import GroundStationApp
from darko_gcs.tui.map_panel import MapPanel
from darko_gcs.tui.screens.dialogs import ChooseScreen, ConfirmScreen
from darko_gcs.tui.screens.flight_plan_screen import FlightPlanScreen
from darko_gcs.tui.screens.flight_screen import OPTIONAL_PANELS, FlightScreen
from protocol.dialect import mavlink
from tests.support.gcs.planned_snapshots import planned
from tests.support.gcs.screens import FakeFeed, notices, screen_text, until
from tests.support.gcs.snapshots import FORWARD, HOVERING, snapshot_with

SMALL, WIDE, VAST = (80, 24), (120, 40), (200, 60)
TRUE = Truth(
    time=60.0, p=(2.5, 1.0, -3.0), v=(0.5, 0.0, 0.0), q=HOVERING.attitude.q, rates=(0.0,) * 3, wind=(0.0, 2.5, 0.0)
)
TOLD = snapshot_with(
    HOVERING,
    estimates={"truth": TRUE, "test_ratio": 0.4, "doubt": Doubt((0.1, 0.1, 0.2), 0.05, 0.01)},
    position={"time": 60.0},
    attitude={"time": 60.0},
)


@pytest.fixture
def feed():
    return FakeFeed(HOVERING)


async def shown_map(app, pilot):
    """The map, once it shows the snapshot."""
    panel = app.screen.query_one(MapPanel)
    await until(pilot, lambda: panel.size and panel.snapshot is app.feed.snapshot)
    return panel


# Room


async def test_a_vast_screen_holds_the_estimate_against_the_truth_and_asks_for_it(feed):
    feed.snapshot = TOLD
    app = GroundStationApp(feed)
    async with app.run_test(size=VAST) as pilot:
        await until(pilot, lambda: "Estimate against truth" in screen_text(app))
        assert "north              -0.50 m      0.10      5.0 > 3" in screen_text(app)
        await until(pilot, lambda: ("want_truth", ("wanted", True)) in feed.requests)
        await pilot.resize_terminal(*SMALL)
        await until(pilot, lambda: feed.requests[-1] == ("want_truth", ("wanted", False)))


async def test_a_smaller_screen_asks_for_no_truth(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=WIDE) as pilot:
        await until(pilot, lambda: "altitude" in screen_text(app) and "height m" in screen_text(app))
        assert "Estimate against truth" not in screen_text(app)
        assert feed.requests == []


async def test_another_autopilot_is_asked_for_no_truth(feed):
    feed.snapshot = snapshot_with(HOVERING, hybrid={"state": None}, actuation={"servos": (1500, 1500)})
    app = GroundStationApp(feed)
    async with app.run_test(size=VAST) as pilot:
        await until(pilot, lambda: app.screen.has_class("-foreign"))
        assert "Estimate against truth" not in screen_text(app)
        assert feed.requests == []


async def test_a_vast_screen_has_the_blocks_of_the_plan_and_a_click_opens_it(feed):
    _, feed.snapshot = planned()
    app = GroundStationApp(feed)
    async with app.run_test(size=VAST) as pilot:
        await until(pilot, lambda: "Flight plan" in screen_text(app) and "Standby" in screen_text(app))
        assert app.screen.focused is None
        await pilot.click("#flown-plan-blocks", offset=(4, 2))
        await until(pilot, lambda: isinstance(app.screen, FlightPlanScreen))


# Map


async def test_arrows_move_the_map_and_z_follows_the_vehicle(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=WIDE) as pilot:
        panel = await shown_map(app, pilot)
        await pilot.press("plus", "shift+right", "shift+up")
        await until(pilot, lambda: panel.middle is not None and panel.middle[0] > 2.0 and panel.middle[1] > 1.0)
        scale = panel.scale
        await pilot.press("z")
        await until(pilot, lambda: panel.middle is None)
        assert panel.scale == scale
        await pilot.press("0")
        await until(pilot, lambda: panel.scale is None)


async def test_the_mouse_drags_the_map_and_the_wheel_zooms_where_it_points(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=WIDE) as pilot:
        panel = await shown_map(app, pilot)
        cell = (10, 8)
        under = panel.place_at(cell)
        await pilot.mouse_down(panel, offset=(11, 9))  # of the border
        await pilot.hover(panel, offset=(16, 13))
        await pilot.mouse_up(panel, offset=(16, 13))
        assert panel.place_at((15, 12)) == pytest.approx(under)
        before, under = panel.scale, panel.place_at(cell)
        panel.on_mouse_scroll_up(wheel(panel, cell))
        assert panel.scale < before
        assert panel.place_at(cell) == pytest.approx(under)
        assert feed.requests == []
        assert isinstance(app.screen, FlightScreen)


async def test_turns_of_the_wheel_that_come_at_once_are_one_drawing(feed, monkeypatch):
    app = GroundStationApp(feed)
    async with app.run_test(size=WIDE) as pilot:
        panel = await shown_map(app, pilot)
        drawings, before, draw = [], panel.place_at((10, 8)), panel.draw
        monkeypatch.setattr(app, "pull", lambda: None)
        monkeypatch.setattr(panel, "draw", lambda *args: drawings.append(args) or draw(*args))
        for _ in range(8):
            panel.on_mouse_scroll_up(wheel(panel, (10, 8)))
        scale = panel.scale
        await until(pilot, lambda: drawings)
        assert len(drawings) == 1
        assert panel.scale == scale
        assert panel.place_at((10, 8)) == pytest.approx(before)


def wheel(panel, cell):
    """A turn of the wheel over a cell of a panel."""
    x, y = cell[0] + 1, cell[1] + 1
    region = panel.region
    return MouseScrollUp(panel, x, y, 0, 0, 0, False, False, False, region.x + x, region.y + y)


@pytest.mark.parametrize(("key", "sent"), [("y", 1), ("n", 0)])
async def test_a_click_on_the_map_asks_before_the_vehicle_goes_there(feed, key, sent):
    app = GroundStationApp(feed)
    async with app.run_test(size=WIDE) as pilot:
        panel = await shown_map(app, pilot)
        north, east = panel.place_at((10, 8))
        await pilot.click(panel, offset=(11, 9))
        await until(pilot, lambda: isinstance(app.screen, ConfirmScreen) and app.screen.is_mounted)
        asked = " ".join(screen_text(app).split())
        assert f"Go to {north:.1f} m north, {east:.1f} m east" in asked.replace("█ █ ", "")
        await pilot.press(key)
        await until(pilot, lambda: isinstance(app.screen, FlightScreen))
        assert len(feed.requests) == sent
        if sent:
            assert feed.requests[0] == ("go_to", pytest.approx(north), pytest.approx(east), pytest.approx(3.0))


@pytest.mark.long(after=1)
@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"status": {"landed_state": mavlink.MAV_LANDED_STATE_ON_GROUND}}, "not in the air"),
        ({"link": {"lost": True}}, "vehicle is silent"),
        ({"identity": {"source": None}}, "No vehicle"),
    ],
)
async def test_a_click_without_a_vehicle_in_the_air_sends_nothing_and_says_why(feed, changed, words):
    feed.snapshot = snapshot_with(HOVERING, **changed)
    app = GroundStationApp(feed)
    async with app.run_test(size=WIDE, notifications=True) as pilot:
        panel = await shown_map(app, pilot)
        await pilot.click(panel, offset=(11, 9))
        await until(pilot, lambda: words in notices(app))
        assert feed.requests == []


# Ages


async def test_values_and_panels_whose_messages_stopped_tell_their_age(feed):
    arrivals = {"LOCAL_POSITION_NED": 100.4, "VFR_HUD": 95.0, "DARKO_HYBRID_STATE": 90.2, "DARKO_ENERGY": 100.0}
    feed.snapshot = snapshot_with(FORWARD, link={"heartbeat_at": 100.0, "arrivals": arrivals})
    app = GroundStationApp(feed)
    async with app.run_test(size=WIDE) as pilot:
        await until(pilot, lambda: "stopped: 10 s old" in screen_text(app))
        assert "1.0 m airspeed 13.5 (5 s)" in screen_text(app)  # with its unit, and whole
        assert "LINK LOST" not in screen_text(app)
        feed.now = 101.6  # the snapshot stays
        await until(pilot, lambda: "stopped: 11 s old" in screen_text(app) and "13.5 (6 s)" in screen_text(app))
        feed.now = 102.5
        await until(pilot, lambda: "power         54 W (2 s)" in screen_text(app))


# What is kept


@pytest.mark.long
async def test_panels_and_theme_are_kept_for_the_next_time(feed, tmp_path):
    file = tmp_path / "gcs.toml"
    app = GroundStationApp(feed, PreferencesFile(file))
    async with app.run_test(size=WIDE) as pilot:
        await until(pilot, lambda: "Decision" in screen_text(app))
        await pilot.press("P")
        await until(pilot, lambda: isinstance(app.screen, ChooseScreen) and "Hide decision" in screen_text(app))
        await pilot.press("down", "enter")
        await until(pilot, lambda: isinstance(app.screen, FlightScreen) and "─ Decision" not in screen_text(app))
        app.theme = "textual-light"
        await until(pilot, lambda: "textual-light" in file.read_text())
    kept = Preferences(hidden_panels=frozenset({"decision"}), theme="textual-light")
    assert PreferencesFile(file).load() == kept
    app = GroundStationApp(feed, PreferencesFile(file))
    async with app.run_test(size=WIDE) as pilot:
        await until(pilot, lambda: "Flight" in screen_text(app) and app.theme == "textual-light")
        assert "─ Decision" not in screen_text(app)
        await pilot.press("P")
        await until(pilot, lambda: "Show decision" in screen_text(app))


@pytest.mark.long(after=1)
@pytest.mark.parametrize(
    ("text", "words"),
    [("theme = 'plaid'", "no theme 'plaid'"), ("hidden_panels = ['map']", "no panel 'map'"), ("[", "not TOML")],
)
async def test_a_wrong_preference_is_told_and_left_alone(feed, tmp_path, text, words):
    file = tmp_path / "gcs.toml"
    file.write_text(text)
    app = GroundStationApp(feed, PreferencesFile(file))
    async with app.run_test(size=VAST, notifications=True) as pilot:
        await until(pilot, lambda: words in notices(app))
        app.theme = "textual-light"
        await pilot.pause()
    assert file.read_text() == text


async def test_the_palette_names_every_action_by_a_sentence_and_none_twice(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=SMALL):
        titles = [entry.title for entry in app.palette_entries(app.screen)]
    assert len(set(titles)) == len(titles)
    assert all(title[0].isupper() and " " in title for title in titles), titles
    assert {"Show or hide panels of the flight screen", "Change the colour theme"} < set(titles)


def test_every_optional_panel_is_one():
    assert set(OPTIONAL_PANELS) == {"actuators", "decision", "truth", "flight-plan"}
