"""The message log: older messages can be read while newer ones arrive."""

import pytest

from darko_gcs.state.message_log import add_line
from darko_gcs.tui.app import GroundStationApp
from darko_gcs.tui.screens.messages_screen import MessagesScreen
from protocol.dialect import mavlink
from tests.support.gcs.screens import FakeFeed, screen_text, settled, until
from tests.support.gcs.snapshots import HOVERING, snapshot_with

WARNING = mavlink.MAV_SEVERITY_WARNING


@pytest.fixture
def feed():
    s = HOVERING
    for number in range(60):
        s = add_line(s, 40.0 + number, number % 8, f"message {number} [bold]")
    return FakeFeed(s)


@pytest.mark.long
async def test_older_messages_stay_in_view_when_newer_ones_arrive(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("e")
        await until(pilot, lambda: isinstance(app.screen, MessagesScreen) and "message 59 [bold]" in screen_text(app))
        assert "message 1 " not in screen_text(app)
        await pilot.press("home")
        await until(pilot, lambda: "message 1 " in screen_text(app))
        feed.snapshot = add_line(feed.snapshot, 100.0, WARNING, "a new one")
        await pilot.pause(0.3)
        assert "message 1 " in screen_text(app)
        await pilot.press("end")
        await until(pilot, lambda: "a new one" in screen_text(app))
        feed.snapshot = add_line(feed.snapshot, 100.1, WARNING, "the newest")
        await until(pilot, lambda: "the newest" in screen_text(app))
        await pilot.press("e")
        await until(pilot, lambda: not isinstance(app.screen, MessagesScreen))


async def test_messages_of_a_recording_have_its_playing_time(feed):
    feed.station, feed.snapshot = None, snapshot_with(HOVERING, log={"lines": ()})
    feed.snapshot = add_line(feed.snapshot, 83.25, WARNING, "Landed")
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("e")
        await until(pilot, lambda: "1:23.2  warn   Landed" in screen_text(app))


@pytest.mark.long(after=1)
@pytest.mark.parametrize("size", [(80, 24), (120, 40), (200, 60)], ids=["80x24", "120x40", "200x60"])
def test_the_screen_matches_its_snapshot(snap_compare, feed, size):
    feed.station = None  # with the times of a recording, which are not of this day

    async def settle(pilot):
        await until(pilot, lambda: "172 W" in screen_text(pilot.app))
        await pilot.press("e")
        await until(pilot, lambda: "message 59 [bold]" in screen_text(pilot.app))
        await settled(pilot)

    assert snap_compare(GroundStationApp(feed), terminal_size=size, run_before=settle)


@pytest.mark.long
async def test_lines_are_chosen_by_their_words_and_by_their_severity(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 40)) as pilot:
        await pilot.press("e")
        await until(pilot, lambda: "message 59 " in screen_text(app))
        await pilot.press("slash", *"SAGE 3")
        await until(pilot, lambda: "message 39 " in screen_text(app) and "message 59 " not in screen_text(app))
        await pilot.press("enter", "w")
        await until(pilot, lambda: "message 39 " not in screen_text(app) and "message 36 " in screen_text(app))
        await pilot.press("w", "escape")
        await until(pilot, lambda: "message 59 " in screen_text(app))
        await pilot.press("escape")
        await until(pilot, lambda: not isinstance(app.screen, MessagesScreen))


async def test_an_empty_list_says_what_shows_messages_again(feed):
    feed.snapshot = add_line(snapshot_with(HOVERING, log={"lines": ()}), 100.0, mavlink.MAV_SEVERITY_INFO, "Landed")
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("e")
        await until(pilot, lambda: "Landed" in screen_text(app))
        await pilot.press("w")
        await until(pilot, lambda: "no warning so far: w shows all" in screen_text(app))
        await pilot.press("w", "slash", *"xyz")
        await until(pilot, lambda: "no message has this text" in screen_text(app))


async def test_a_long_line_goes_on_below_its_text(feed):
    text = "Flight plan: GetPosHeight() @GT 1.5 (line 43): Takeoff -> Standby, and so on to the end of the line"
    feed.snapshot = add_line(feed.snapshot, 99.0, mavlink.MAV_SEVERITY_INFO, text)
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("e")
        await until(pilot, lambda: "so on to" in screen_text(app))
        lines = screen_text(app).splitlines()
        first, second = (next(line for line in lines if words in line) for words in ("GetPosHeight", "end of the line"))
        assert second.index(second.strip()[0]) == first.index("Flight plan")
