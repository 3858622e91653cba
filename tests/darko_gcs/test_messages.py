"""The log of messages: older ones can be read, newer ones come in below."""

from dataclasses import replace

import pytest

from darko_gcs.app import GroundStation
from darko_gcs.screens.messages import MessagesScreen
from darko_gcs.store import note
from tests.darko_gcs.screens import FLYING, FakeFeed, screen_text, until


@pytest.fixture
def feed():
    s = FLYING
    for number in range(60):
        s = note(s, 40.0 + number, number % 8, f"message {number} [bold]")
    return FakeFeed(s)


async def test_older_messages_are_read_by_scrolling_and_stay_in_sight(feed):
    app = GroundStation(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("e")
        await until(pilot, lambda: isinstance(app.screen, MessagesScreen) and "message 59 [bold]" in screen_text(app))
        assert "message 1 " not in screen_text(app)
        await pilot.press("home")
        await until(pilot, lambda: "message 1 " in screen_text(app))
        feed.snapshot = note(feed.snapshot, 100.0, 4, "a new one")
        await pilot.pause(0.3)
        assert "message 1 " in screen_text(app)
        await pilot.press("end")
        await until(pilot, lambda: "a new one" in screen_text(app))
        feed.snapshot = note(feed.snapshot, 100.1, 4, "the newest")
        await until(pilot, lambda: "the newest" in screen_text(app))
        await pilot.press("e")
        await until(pilot, lambda: not isinstance(app.screen, MessagesScreen))


async def test_messages_of_a_recording_have_its_time(feed):
    feed.station, feed.snapshot = None, replace(FLYING, messages=())
    feed.snapshot = note(feed.snapshot, 83.25, 4, "Landed")
    app = GroundStation(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("e")
        await until(pilot, lambda: "1:23.2  Landed" in screen_text(app))
