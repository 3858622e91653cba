"""The player of recorded flights, driven by keys."""

import pytest
from textual.widgets import Input

from darko_gcs.commands import replay
from darko_gcs.feed.links import OutwardAddress
from darko_gcs.feed.replay_feed import ReplayFeed
from darko_gcs.tui.replay_app import ReplayApp
from darko_gcs.tui.screens.dialogs import HelpScreen
from darko_gcs.tui.screens.flight_screen import FlightScreen
from darko_gcs.tui.screens.mission_screen import MissionScreen
from darko_gcs.tui.widgets.pair_panels import TimeBar
from protocol.tlog import TlogReader, read_tlog
from tests.support.gcs.screens import screen_text, until
from tests.support.logs import quadplane_log
from tests.support.paths import DATA


@pytest.fixture
def feed():
    return ReplayFeed(read_tlog(DATA / "square-flight.tlog"), "square-flight.tlog")


async def test_a_recording_pauses_seeks_and_cannot_be_commanded(feed):
    app = ReplayApp(feed)
    async with app.run_test(size=(80, 24), notifications=True) as pilot:
        await pilot.press("space")
        assert not feed.playing
        await pilot.press("end")
        assert feed.snapshot.mission.reached == {0, 1, 2, 3, 4, 5}
        assert len(feed.snapshot.position.track) > 50
        await pilot.press("home")
        assert feed.snapshot.mission.reached == frozenset()
        await pilot.press("right_square_bracket")
        assert feed.speed == 2.0
        await pilot.press("a")
        await until(pilot, lambda: "This is a recording" in screen_text(app))
        await pilot.press("o")
        await until(pilot, lambda: "--vehicle ID" in screen_text(app))
        assert isinstance(app.screen, FlightScreen)


async def test_it_says_replay_and_shows_its_own_keys(feed):
    app = ReplayApp(feed)
    async with app.run_test(size=(120, 40)) as pilot:
        await pilot.press("space", "1")
        await until(pilot, lambda: "REPLAY" in screen_text(app).splitlines()[0])
        footer = screen_text(app).splitlines()[-1]
        assert all(words in footer for words in ("Pause", "-5 s", "Slow", "Jump", "Warning")), footer
        assert not any(words in footer for words in ("Arm", "Takeoff", "Land", "Goto"))
        await pilot.press("question_mark")
        await until(pilot, lambda: isinstance(app.screen, HelpScreen) and "One message on" in screen_text(app))
        assert "Take off to a height" not in screen_text(app)


@pytest.mark.long
async def test_a_key_sends_what_is_played_and_the_status_line_says_so():
    address = OutwardAddress("udpout", "127.0.0.1", 9)
    app = ReplayApp(ReplayFeed(read_tlog(DATA / "square-flight.tlog"), "square", send_to=address))
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("space", "5", "u")
        await until(pilot, lambda: "recording to 127.0.0.1:9?" in screen_text(app))
        assert app.feed.output.words == ""
        await pilot.press("y")
        await until(pilot, lambda: "REPLAY, SENT TO 127.0.0.1:9" in screen_text(app).splitlines()[0])
        await pilot.press("u")
        await until(pilot, lambda: "SENT" not in screen_text(app).splitlines()[0])


async def test_without_an_address_the_key_says_so(feed):
    app = ReplayApp(feed)
    async with app.run_test(size=(80, 24), notifications=True) as pilot:
        await pilot.press("space", "u")
        await until(pilot, lambda: "no address to send to" in screen_text(app))


async def test_a_pause_is_shown_at_once(feed):
    app = ReplayApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        bar = app.screen.query_one(TimeBar)
        assert "▶" in bar.draw(feed.snapshot, 80, 2)[0][0][0]
        await pilot.press("space")
        await until(pilot, lambda: "⏸" in screen_text(app).splitlines()[-3])


@pytest.mark.long
async def test_marks_are_reached_by_key_in_both_directions(feed):
    app = ReplayApp(feed)
    async with app.run_test(size=(120, 40), notifications=True) as pilot:
        await pilot.press("space", "home")
        jumps = [mark.time for mark in feed.marks if mark.kind.value == "jump"]
        for time in jumps[:2]:
            await pilot.press("j")
            assert feed.now == time
        await pilot.press("J")
        assert feed.now == jumps[0]
        await until(pilot, lambda: "last: jump to" in screen_text(app))
        await pilot.press("end", "j")
        await until(pilot, lambda: "No later jump" in screen_text(app))
        await pilot.press("shift+tab")
        assert feed.now == max(mark.time for mark in feed.marks if mark.time < feed.timeline.duration)


async def test_it_steps_by_message_and_plays_backwards_and_in_a_loop(feed):
    app = ReplayApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("space", "5")
        played = feed.timeline.played
        await pilot.press("full_stop", "full_stop", "comma")
        assert feed.timeline.played == played + 1
        await pilot.press("b", "l")
        assert (feed.backwards, feed.looping) == (True, True)
        await until(pilot, lambda: " loop " in screen_text(app))


async def test_a_click_on_the_bar_seeks(feed):
    app = ReplayApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("space", "home")
        await pilot.click(TimeBar, offset=(3, 0))
        assert feed.now == 0.0
        await pilot.click(TimeBar, offset=(30, 0))
        assert 0.3 * feed.timeline.duration < feed.now < 0.7 * feed.timeline.duration
        await until(pilot, lambda: "◆ waypoint" in screen_text(app) and "since boot" in screen_text(app))


@pytest.mark.parametrize(("text", "seconds"), [("90", 90.0), ("1:30", 90.0), ("1:00:01.5", 3601.5), ("0:05.25", 5.25)])
def test_a_beginning_is_written_as_the_clock_shows_it(text, seconds):
    assert replay.parser({"replay": ""}).parse_args(["x.tlog", "--at", text]).at == seconds


@pytest.mark.parametrize("text", ["a", "1:2:3:4", "-5", "1:x", "nan", "x:30"])
def test_a_beginning_that_is_no_time_is_refused_in_words(text, capsys):
    with pytest.raises(SystemExit):
        replay.parser({"replay": ""}).parse_args(["x.tlog", f"--at={text}"])
    assert "_time" not in capsys.readouterr().err


async def test_another_autopilot_leaves_no_empty_panel_of_the_hybrid_controller():
    app = ReplayApp(ReplayFeed(TlogReader(quadplane_log()), "x", begin=90.0))
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("space")
        await until(pilot, lambda: "S1" in screen_text(app) and "us S5" in screen_text(app))
        assert app.screen.query_one("#hybrid").size.height == 1
        assert "GUIDED" in screen_text(app)


async def test_the_parameter_filter_gets_its_spaces(feed):
    app = ReplayApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("space", "p")
        await until(pilot, lambda: isinstance(app.focused, Input))
        await pilot.press("a", "space", "b")
        await until(pilot, lambda: app.focused.value == "a b")
        assert not feed.playing


async def test_tab_goes_to_the_next_mark_on_the_flight_screen_and_to_the_map_on_that_of_the_mission(feed):
    app = ReplayApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("space", "tab")
        there = feed.now
        assert there > 0.0
        await pilot.press("m")
        await until(pilot, lambda: isinstance(app.screen, MissionScreen) and app.focused is app.screen.table)
        await pilot.press("tab")
        await until(pilot, lambda: app.focused is app.screen.map)
        assert feed.now == there


@pytest.mark.long
@pytest.mark.parametrize("size", [(80, 24), (120, 40), (200, 60)])
async def test_the_mission_of_a_recording_offers_what_works_there_and_the_help(feed, size):
    app = ReplayApp(feed)
    async with app.run_test(size=size) as pilot:
        await pilot.press("space", "end", "m")
        await until(pilot, lambda: isinstance(app.screen, MissionScreen) and app.screen.table.row_count == 6)
        await until(pilot, lambda: "Help" in screen_text(app).splitlines()[-1])
        footer = set(screen_text(app).splitlines()[-1].split())
        assert {"Map", "Save", "Differ", "Back"} <= footer
        assert not footer & {"Edit", "Ins", "Del", "Upload", "Run", "Fetch"}
        await pilot.press("x", "delete")
        assert len(app.draft.plan.items) == 6
        app.screen._editing.remove()  # as a drag on the map would change the plan
        assert len(app.draft.plan.items) == 6
        await until(pilot, lambda: "cannot be edited" in screen_text(app))
