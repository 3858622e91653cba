"""An error of the station's own code while a vehicle flies, on the ground, and what is left of it."""

import asyncio

import pytest
from textual.events import Key
from textual.message import Message
from textual.widget import Widget
from textual.widgets import Label, OptionList

from darko_gcs.tui.app import GroundStationApp, run_screens
from darko_gcs.tui.containment import EXIT_CRASHED, MAX_ERRORS, ContainingApp, ContainingPump, ErrorLog, on
from darko_gcs.tui.map_panel import MapPanel
from darko_gcs.tui.screens.dialogs import ChooseScreen
from darko_gcs.tui.screens.flight_screen import FlightScreen
from darko_gcs.tui.screens.mission_screen import MissionScreen
from protocol.dialect import mavlink
from tests.support.gcs.screens import FakeFeed, screen_text, until
from tests.support.gcs.snapshots import HOVERING, snapshot_with

CONTAIN, END_BY = ContainingApp.contain, ContainingApp.end_by  # as they are outside of the tests
ON_GROUND = snapshot_with(HOVERING, status={"armed": False, "landed_state": mavlink.MAV_LANDED_STATE_ON_GROUND})


def broken(*_args, **_options):
    raise ZeroDivisionError("a test divides by zero")


class UnheardOf(Message):
    """No widget has a handler of it."""


@pytest.fixture
def app(monkeypatch, tmp_path):
    return watched(monkeypatch, tmp_path, HOVERING)


def watched(monkeypatch, tmp_path, snapshot):
    monkeypatch.setattr(ContainingApp, "contain", CONTAIN)
    monkeypatch.setattr(ContainingApp, "end_by", END_BY)
    app = GroundStationApp(FakeFeed(snapshot))
    app.errors = ErrorLog(tmp_path)
    return app


async def test_what_still_comes_when_the_screens_have_gone_is_no_error(app, tmp_path):
    async with app.run_test() as pilot:
        await pilot.pause()
    assert not app.screen_stack
    app.on_key(Key("a", "a"))
    assert (app.crash, list(tmp_path.iterdir())) == ("", [])


async def test_an_error_in_a_panel_shows_in_it_and_in_the_log_and_the_rest_goes_on(app, monkeypatch, tmp_path):
    async with app.run_test(size=(120, 40)) as pilot:
        monkeypatch.setattr(MapPanel, "draw", broken)
        app.feed.snapshot = snapshot_with(HOVERING, status={"mode": "LAND"})
        await until(pilot, lambda: "Not drawn: ZeroDivisionError" in screen_text(app))
        await until(pilot, lambda: "LAND" in screen_text(app).splitlines()[0])
        for _ in range(5):
            app.feed.snapshot = snapshot_with(app.feed.snapshot, link={"boot": app.feed.snapshot.link.boot + 1.0})
            app.pull()
        lines = [request for request in app.feed.requests if request[0] == "add_line"]
        assert len(lines) == 1
        assert "panel Map: ZeroDivisionError: a test divides by zero (test_containment.py" in str(lines[0])
        (file,) = tmp_path.iterdir()
        assert str(file) in str(lines[0])
        assert file.read_text().count("Traceback") == 1
        monkeypatch.undo()
        monkeypatch.setattr(ContainingApp, "contain", CONTAIN)
        app.feed.snapshot = snapshot_with(HOVERING, status={"mode": "HOLD"})
        await until(pilot, lambda: "Not drawn" not in screen_text(app))
    assert app.crash == ""


@pytest.mark.long(after=1)
@pytest.mark.parametrize(
    ("kind", "name"), [(GroundStationApp, "show_messages"), (MissionScreen, "show_draft"), (FlightScreen, "action_pan")]
)
async def test_an_error_in_a_key_or_a_screen_does_not_end_the_station_of_a_flying_vehicle(app, kind, name, monkeypatch):
    monkeypatch.setattr(kind, name, broken)
    async with app.run_test(size=(80, 24), notifications=True) as pilot:
        for key in ("e", "escape", "m", "escape", "escape", "shift+up"):
            await pilot.press(key)
        await until(pilot, lambda: isinstance(app.screen, FlightScreen))
        app.feed.snapshot = snapshot_with(HOVERING, status={"mode": "LAND"})
        await until(pilot, lambda: "LAND" in screen_text(app).splitlines()[0])
        await until(pilot, lambda: "ZeroDivisionError" in screen_text(app))
    assert app.crash == ""


async def test_a_dialog_whose_widget_has_ended_is_closed(app, monkeypatch):
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("P")
        await until(pilot, lambda: isinstance(app.screen, ChooseScreen))
        monkeypatch.setattr(OptionList, "on_unheard_of", broken, raising=False)
        app.screen.query_one(OptionList).post_message(UnheardOf())
        async with asyncio.timeout(30.0):
            while not isinstance(app.screen, FlightScreen):  # the pilot would wait for the widget that has ended
                await asyncio.sleep(0.01)
        await pilot.press("m")
        await until(pilot, lambda: isinstance(app.screen, MissionScreen))
    assert app.crash == ""


async def test_a_widget_lives_on_and_its_other_handlers_are_called_after_an_error_in_one(app):
    heard = []

    class Sound(ContainingPump, Widget):
        def on_unheard_of(self, message):
            heard.append(message)

    class Brittle(Sound):
        @on(UnheardOf)
        async def fail_at_once(self):
            broken()

        def on_unheard_of(self, message):
            broken(message)

    async with app.run_test(size=(80, 24)) as pilot:
        widget = Brittle()
        await app.screen.mount(widget)
        for count in (1, 2):
            widget.post_message(UnheardOf())
            await until(pilot, lambda count=count: len(heard) == count)
        assert widget.is_running
    told = [str(request) for request in app.feed.requests if request[0] == "add_line"]
    assert [text.split("Error of the ground station in ")[1].split(": ")[0] for text in told] == [
        "Brittle",
        "Brittle, UnheardOf",
    ]


async def test_a_feed_that_fails_ten_times_a_second_is_told_once_and_the_screen_lives(app, monkeypatch):
    monkeypatch.setattr(FakeFeed, "advance", broken)
    async with app.run_test(size=(80, 24)) as pilot:
        for _ in range(5):
            app.pull()
        await pilot.press("m")
        await until(pilot, lambda: isinstance(app.screen, MissionScreen))
    assert sum(request[0] == "add_line" for request in app.feed.requests) == 1


@pytest.mark.long
async def test_an_error_in_an_upper_screen_leaves_the_flight_below_it_up_to_date(app, monkeypatch):
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("m")
        await until(pilot, lambda: isinstance(app.screen, MissionScreen))
        monkeypatch.setattr(MissionScreen, "_follow", broken)
        app.feed.snapshot = snapshot_with(HOVERING, status={"mode": "LAND"}, plans={"mission": ()})
        app.pull()
        app.pop_screen()
        await until(pilot, lambda: "LAND" in screen_text(app).splitlines()[0])
        assert not app.crash


def test_an_error_on_the_ground_ends_it_by_an_exit_code_and_one_line(monkeypatch, tmp_path, capsys):
    app = watched(monkeypatch, tmp_path, ON_GROUND)
    monkeypatch.setattr(GroundStationApp, "first_screen", broken)
    monkeypatch.setattr(app, "run", lambda: GroundStationApp.run(app, headless=True))
    assert run_screens(app) == EXIT_CRASHED == 1
    (line,) = capsys.readouterr().err.splitlines()
    (file,) = tmp_path.iterdir()
    assert line.startswith("darko-gcs: ended by an error of its own: ZeroDivisionError: a test divides by zero")
    assert str(file) in line
    assert "Traceback" in file.read_text()
    assert app.feed.closed
    assert app.feed.notes == ["The ground station ended by an error"]


@pytest.mark.parametrize(
    ("restart", "words"),
    [(broken, "was stopped with the ground station"), (None, "flies on and acts on the lost link")],
)
def test_a_crash_in_flight_says_what_becomes_of_the_vehicle(restart, words, monkeypatch, tmp_path, capsys):
    app = watched(monkeypatch, tmp_path, HOVERING)
    app.feed.restart = restart
    monkeypatch.setattr(app, "must_go_on", lambda: False)
    monkeypatch.setattr(GroundStationApp, "first_screen", broken)
    monkeypatch.setattr(app, "run", lambda: GroundStationApp.run(app, headless=True))
    assert run_screens(app) == EXIT_CRASHED
    assert words in capsys.readouterr().err.splitlines()[1]


async def test_a_press_on_a_widget_that_has_left_the_screen_does_nothing(monkeypatch, tmp_path):
    app = watched(monkeypatch, tmp_path, ON_GROUND)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("t")
        await until(pilot, lambda: "take off" in screen_text(app))
        label = Label("on no screen")
        monkeypatch.setattr(type(app.screen), "get_widget_and_offset_at", lambda *_: (label, label.region.offset))
        await pilot.mouse_down(offset=(40, 12))
        monkeypatch.undo()
    assert app.crash == ""


def test_a_folder_that_cannot_be_written_costs_the_traceback_and_an_error_is_written_once(tmp_path):
    (tmp_path / "file").touch()
    log = ErrorLog(tmp_path / "file" / "errors")
    assert log.add(ValueError("x"), "here")
    assert not log.add(ValueError("x"), "here")
    assert "cannot be written" in log.words
    assert sum(log.add(ValueError("x"), f"place {n}") for n in range(100)) == MAX_ERRORS - 1
