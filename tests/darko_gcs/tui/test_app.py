"""The flight screen and its actions, driven by keys on a feed that needs no network."""

import io
import math
import socket
from pathlib import Path

import pytest
from rich.console import Console

from darko_gcs.errors import LinkError
from darko_gcs.feed.live_feed import LiveFeed
from darko_gcs.state.message_log import add_line
from darko_gcs.state.values import SigningState
from darko_gcs.station.station import Station
from darko_gcs.tui.app import GroundStationApp
from darko_gcs.tui.map_panel import MapPanel
from darko_gcs.tui.screens.dialogs import AskScreen, HelpScreen, QuitScreen
from darko_gcs.tui.screens.flight_screen import FlightScreen
from darko_gcs.tui.screens.mission_screen import MissionScreen
from darko_gcs.tui.view_controls import save_screenshot
from protocol.dialect import mavlink
from protocol.dialect.vocabulary import DecisionReason, LegMode
from tests.support.gcs.screens import FakeFeed, confirm, notices, screen_text, settled, until
from tests.support.gcs.snapshots import FORWARD, HOVERING, snapshot_with

TO_FORWARD, TO_HOVER = mavlink.MAV_VTOL_STATE_TRANSITION_TO_FW, mavlink.MAV_VTOL_STATE_TRANSITION_TO_MC
IN_HOVER, IN_FORWARD = mavlink.MAV_VTOL_STATE_MC, mavlink.MAV_VTOL_STATE_FW


@pytest.fixture
def feed():
    return FakeFeed(HOVERING)


async def test_telemetry_continues_beneath_a_dialog(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("d")
        feed.snapshot = snapshot_with(HOVERING, status={"mode": "LAND"})
        below = next(screen for screen in app.screen_stack if isinstance(screen, FlightScreen))
        await until(pilot, lambda: below.snapshot.status.mode == "LAND")


async def test_a_covered_screen_draws_nothing_and_is_up_to_date_when_it_is_seen_again(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        below = app.screen
        await pilot.press("m")
        await until(pilot, lambda: isinstance(app.screen, MissionScreen))
        feed.snapshot = snapshot_with(HOVERING, status={"mode": "LAND"})
        app.pull()
        assert below.snapshot.status.mode != "LAND"
        await pilot.press("escape")
        await until(pilot, lambda: app.screen is below and "LAND" in screen_text(app).splitlines()[0])


async def test_a_snapshot_that_comes_while_the_station_ends_meets_no_screen_without_widgets(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("m")
        await until(pilot, lambda: isinstance(app.screen, MissionScreen))
        screen = app.screen
        app._running = False  # as its own shutdown begins
        await screen.query("*").remove()
        feed.snapshot = snapshot_with(HOVERING, plans={"mission": ()})
        app.pull()
        assert screen.snapshot.plans.mission == HOVERING.plans.mission
        app._running = True


async def test_a_screen_knows_the_vehicle_from_its_first_key_on(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        for show in (app.show_mission, app.show_flight_plan, app.show_parameters, app.show_messages):
            show()
            assert app.screen.snapshot is feed.snapshot
            await until(pilot, lambda: app.screen.query("KeyFooter"))
            await pilot.press("escape")
            await until(pilot, lambda: isinstance(app.screen, FlightScreen))


@pytest.mark.long(after=1)
@pytest.mark.parametrize("size", [(80, 24), (100, 30), (140, 45), (200, 60)])
async def test_the_important_values_are_on_the_screen_at_every_size(feed, size):
    app = GroundStationApp(feed)
    async with app.run_test(size=size) as pilot:
        await until(pilot, lambda: "ARMED" in screen_text(app) and "172 W" in screen_text(app))
        text = screen_text(app)
        for words in (
            "ARMED",
            "HOLD",
            "HOVER LINEAR",
            "V 0.8",
            "687 rad/s",
            "nose +90°",
            "hover leave 100",
            "motor R",
            "172 W",
        ):
            assert words in text, words


@pytest.mark.parametrize("size", [(80, 24), (120, 36)])
async def test_forward_flight_is_on_the_screen_at_every_size(feed, size):
    feed.snapshot = FORWARD
    app = GroundStationApp(feed)
    async with app.run_test(size=size) as pilot:
        await until(pilot, lambda: "in air, forward" in screen_text(app) and "54 W" in screen_text(app))
        text = screen_text(app)
        for words in (
            "FORWARD LINEAR",
            "V 12",
            "hover -- (50/100)  fwd 12 (20/60)",
            "forward leave 60",
            "nose +8°  bank +11°",
            "off track  -1.7",
            "saturated: yaw, pitch",
            "leg to 3",
        ):
            assert words in text, words


async def test_a_tall_screen_shows_the_whole_decision_the_air_and_the_energy_by_law(feed):
    feed.snapshot = FORWARD
    app = GroundStationApp(feed)
    async with app.run_test(size=(140, 45)) as pilot:
        await until(pilot, lambda: "FORWARD  less energy" in screen_text(app) and "600 J" in screen_text(app))
        text = screen_text(app)
        for words in (
            "29.2 s     4983 J",
            "12.1 s     1757 J",
            "65 % less energy, 59 % less time",
            "leg to 3  100 m  climb +10 m",
            "tail wind -1.2  cross wind 0.5",
            "wind         2.2 m/s from 243°",
            "true wind    2.1 m/s from 235°",
            "airspeed    13.4 m/s in truth",
            "align                    110 J",
            "forward line-of-sight    600 J",
        ):
            assert words in text, words


async def test_a_small_screen_has_the_same_numbers_in_pages(feed):
    feed.snapshot = FORWARD
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        seen = ""
        for page in (1, 2, 3, 4, 5, 6):
            await until(pilot, lambda wanted=page: f"Flight {wanted}/6" in screen_text(app))
            seen += screen_text(app)
            await pilot.press("n")
        await until(pilot, lambda: "Flight 1/6" in screen_text(app))
        for words in (
            "power         54 W",
            "true wind    2.1 m/s from 235°",
            "front transition         900 J",
            "65 % less energy, 59 % less time",
        ):
            assert words in seen, words


async def test_a_larger_screen_counts_its_pages_again_without_a_new_snapshot(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: "Flight 1/" in screen_text(app))
        await pilot.resize_terminal(140, 45)
        await until(pilot, lambda: app.screen.has_class("-tall") and "Flight ─" in screen_text(app))


async def test_the_attitude_view_follows_the_vtol_state(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        views = ((IN_HOVER, True), (TO_FORWARD, True), (IN_FORWARD, False), (TO_HOVER, False), (IN_HOVER, True))
        for vtol, is_hover_view in views:
            feed.snapshot = snapshot_with(HOVERING, status={"vtol_state": vtol})
            await until(pilot, lambda wanted=is_hover_view: ("nose-up is level" in screen_text(app)) == wanted)
            assert ("tilt" in screen_text(app)) == is_hover_view


async def test_a_saturated_axis_is_shown_for_a_second(feed):
    feed.snapshot = FORWARD
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: "saturated:" in screen_text(app))
        feed.snapshot = snapshot_with(FORWARD, link={"boot": 61.2})
        await until(pilot, lambda: "saturated:" not in screen_text(app))
        assert "at limit: motor R" in screen_text(app)


async def test_impossible_forward_flight_is_shown_as_such(feed):
    decision = FORWARD.guidance.decision._replace(
        forward_time=math.inf, leg_mode=LegMode.HOVER, reason=DecisionReason.NO_TRIM
    )
    feed.snapshot = snapshot_with(FORWARD, guidance={"decision": decision})
    app = GroundStationApp(feed)
    async with app.run_test(size=(140, 45)) as pilot:
        await until(pilot, lambda: "impossible" in screen_text(app))
        assert "HOVER  no trim in transition" in screen_text(app)
        assert "HOVER  no trim in transition" in screen_text(app)


@pytest.mark.parametrize(("unrecorded", "loss"), [(False, 0.0), (True, 0.09)])
async def test_battery_mode_a_bad_link_and_recording_are_always_in_sight(feed, unrecorded, loss):
    feed.snapshot = snapshot_with(
        HOVERING,
        status={"mode": "MISSION", "critical": True},
        session={"unrecorded": unrecorded},
        operator={"in_control": 255},
        link={"signing": SigningState.OPEN, "rate": 165.0, "loss": loss},
    )
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: "ARMED" in screen_text(app))
        top = screen_text(app).splitlines()[0]
        link = "loss 9.0 %" if loss else "165/s"
        for words in ("MISSION", "FAILSAFE", "battery 94 %", link, "NOT RECORDING" if unrecorded else " REC"):
            assert words in top, words


async def test_a_silent_vehicle_is_shown_with_its_age(feed):
    feed.now = 104.0
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: "LINK LOST" in screen_text(app))
        assert "silent for 4 s" in screen_text(app)


async def test_zooming_the_map_changes_its_scale_and_fits_again(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(140, 45)) as pilot:
        panel = app.screen.query_one(MapPanel)
        await until(pilot, lambda: panel.size and panel.snapshot is feed.snapshot)
        await pilot.press("plus")
        near = panel.scale
        await pilot.press("minus", "minus")
        assert panel.scale == 4 * near
        await pilot.press("0")
        assert panel.scale is None


@pytest.mark.long
async def test_the_whole_help_is_reached_by_key_on_the_smallest_screen(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("question_mark")
        await until(pilot, lambda: "Arm: start the motors" in screen_text(app) and "Esc: close" in screen_text(app))
        assert "danger" not in screen_text(app)
        await pilot.press("end")
        await until(pilot, lambda: "danger: armed" in screen_text(app))
        await pilot.press("home", "pagedown", "pagedown")
        await until(pilot, lambda: "its Lyapunov function" in screen_text(app))


async def test_a_long_text_of_the_help_keeps_to_its_column(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("question_mark", "end")
        await until(pilot, lambda: "typed ahead" in screen_text(app))
        rows = screen_text(app).splitlines()
        row = next(number for number, text in enumerate(rows) if "typed ahead" in text)
        assert rows[row + 1].index("question: it") == rows[row].index("keys reach")


async def test_the_palette_finds_flight_commands_with_their_keys(feed):
    feed.snapshot = snapshot_with(HOVERING, status={"landed_state": mavlink.MAV_LANDED_STATE_ON_GROUND})
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("ctrl+p")
        await until(pilot, lambda: app.screen.is_modal)
        await pilot.press(*"take off")
        await until(
            pilot, lambda: "Take off to a height above home" in screen_text(app) and "Key t" in screen_text(app)
        )
        await pilot.press("enter")
        await until(pilot, lambda: isinstance(app.screen, AskScreen))


async def test_while_a_dialog_is_open_the_footer_offers_nothing_that_does_not_work(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: "m Plan" in screen_text(app))
        await pilot.press("g")
        await until(pilot, lambda: isinstance(app.screen, AskScreen) and "m Plan" not in screen_text(app))
        await pilot.press("escape")
        await until(pilot, lambda: "m Plan" in screen_text(app))


@pytest.mark.long
async def test_help_lists_every_key(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(100, 90)) as pilot:
        await pilot.press("question_mark")
        assert isinstance(app.screen, HelpScreen)
        for words in ("Arm", "Take off", "Go to", "Transition", "speed", "Mission", "Confirmations and exits"):
            await until(pilot, lambda wanted=words: wanted in screen_text(app))
        await pilot.press("escape")
        assert isinstance(app.screen, FlightScreen)


@pytest.mark.long(after=1)
@pytest.mark.parametrize("key", ["q", "ctrl+q", "ctrl+c"])
async def test_every_way_out_asks_while_the_vehicle_is_armed(feed, key):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press(key)
        await until(pilot, lambda: isinstance(app.screen, QuitScreen))
        await pilot.press(key)  # does not pile up questions, and is no answer
        await pilot.press("n")
        await until(pilot, lambda: isinstance(app.screen, FlightScreen))
        assert app.is_running
        await confirm(pilot, key)
    assert app.return_value == 0
    assert feed.notes == ["The operator quit, vehicle armed"]


async def test_the_palettes_quit_asks_too_and_there_is_one(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        titles = {entry.title: entry.run for entry in app.palette_entries(app.screen)}
        (quit_,) = [callback for title, callback in titles.items() if "quit" in title.lower()]
        quit_()
        await until(pilot, lambda: "Quit anyway?" in screen_text(app))


async def test_a_closed_terminal_ends_it_at_once_and_is_recorded(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)):
        app.end_at_once("The terminal was closed")
    assert feed.notes == ["The terminal was closed, vehicle armed"]
    assert feed.closed


async def test_a_screenshot_says_where_it_is_or_why_not(feed, tmp_path):
    (tmp_path / "file").write_text("")
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24), notifications=True) as pilot:
        app.action_screenshot("a.svg", str(tmp_path / "new"))
        assert (tmp_path / "new" / "a.svg").read_text(encoding="utf-8").startswith("<svg")
        app.action_screenshot("a.svg", str(tmp_path / "file"))
        await until(pilot, lambda: "cannot be written" in " ".join(screen_text(app).split()))


async def test_a_taken_port_ends_the_app_with_its_reason():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        port = taken.getsockname()[1]
        app = GroundStationApp(LiveFeed(Station(), "127.0.0.1", port, None))
        async with app.run_test(size=(80, 24)):
            pass
    assert f"127.0.0.1:{port}" in str(app.failure)
    assert app.return_value == LinkError.exit_code


@pytest.mark.long(after=2)
@pytest.mark.parametrize("size", [(80, 24), (120, 40), (200, 60)], ids=["80x24", "120x40", "200x60"])
@pytest.mark.parametrize(("flight", "power"), [(HOVERING, "172 W"), (FORWARD, "54 W")], ids=["hover", "forward"])
def test_the_flight_screen_matches_its_snapshot(snap_compare, size, flight, power):
    feed = FakeFeed(add_line(flight, 99.0, mavlink.MAV_SEVERITY_NOTICE, "Take-off complete: holding"))

    async def settle(pilot):
        narrow = size[0] < 120
        await until(pilot, lambda: pilot.app.screen.has_class("-narrow" if narrow else "-wide"))
        await until(pilot, lambda: power in screen_text(pilot.app))
        await settled(pilot)

    assert snap_compare(GroundStationApp(feed), terminal_size=size, run_before=settle)


@pytest.mark.long(after=3)
@pytest.mark.parametrize(
    ("key", "words", "size"),
    [
        ("?", "Esc: close", (80, 24)), ("?", "Esc: close", (120, 40)), ("?", "Esc: close", (200, 60)),
        ("g", "Height above home", (80, 24)), ("d", "will fall", (80, 24)),
    ],
    ids=["help-80x24", "help-120x40", "help-200x60", "form-80x24", "question-80x24"],
)  # fmt: skip
def test_help_form_and_question_match_their_snapshots(snap_compare, key, words, size):
    async def settle(pilot):
        await until(pilot, lambda: "172 W" in screen_text(pilot.app))
        await pilot.press(key)
        await until(pilot, lambda: words in screen_text(pilot.app))
        await settled(pilot)

    assert snap_compare(GroundStationApp(FakeFeed(HOVERING)), terminal_size=size, run_before=settle)


async def test_a_long_message_is_shown_whole(feed):
    long = "Go-to denied: 2000.0 m north is outside the arena 'open' (limit 1500 m)"
    feed.snapshot = add_line(HOVERING, 99.0, mavlink.MAV_SEVERITY_WARNING, long)
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: "m)" in screen_text(app) and "limit" in screen_text(app))
        assert "Go-to denied" in screen_text(app)


@pytest.mark.long(after=2)
@pytest.mark.parametrize(
    ("query", "title"),
    [
        ("upload", "Plan: Send the plan to the vehicle, and read it back"),
        ("undo", "Plan: Undo the last edit"),
        ("clear", "Plan: Delete a plan on the vehicle"),
        ("wind", "Show the parameters"),
        ("rtl", "Return home and land"),
        ("diff", "Plan: What differs from vehicle and file"),
        ("screenshot", "Save a picture of the screen"),
        ("download", "Plan: Fetch the vehicle's plans"),
    ],
)
async def test_the_palette_finds_an_action_by_another_word_for_it(feed, query, title):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("ctrl+p")
        await until(pilot, lambda: app.screen.is_modal)
        await pilot.press(*query)
        await until(pilot, lambda: title in screen_text(app))


async def test_a_key_of_another_screen_is_not_pressed_unseen_but_told(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24), notifications=True) as pilot:
        (upload,) = [e for e in app.palette_entries(app.screen) if "Send the plan" in e.title]
        await upload.run()
        await until(pilot, lambda: isinstance(app.screen, MissionScreen))
        await until(pilot, lambda: "u: Send the plan" in notices(app))
        assert feed.requests == []
        (upload,) = [e for e in app.palette_entries(app.screen) if "Send the plan" in e.title]
        await upload.run()
        await until(pilot, lambda: "has this plan already" in screen_text(app))


def test_a_saved_picture_fetches_no_font(tmp_path):
    console = Console(record=True, file=io.StringIO())
    console.print("text")
    drawn = console.export_svg()
    assert "url(" in drawn
    save_screenshot(drawn, "a.svg", str(tmp_path))
    saved = (tmp_path / "a.svg").read_text()
    assert "@font-face" not in saved
    assert "url(" not in saved.replace("url(#", "")
    assert "@font-face" not in (Path(__file__).parents[3] / "docs" / "screenshot.svg").read_text()
