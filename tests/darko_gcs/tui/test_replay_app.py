"""The player of recorded flights, driven by keys."""

from darko_gcs.feed.replay_feed import ReplayFeed
from darko_gcs.tui.replay_app import ReplayApp
from darko_gcs.tui.screens.flight_screen import FlightScreen
from protocol.tlog import read_tlog
from tests.support.paths import DATA


async def test_a_recording_pauses_seeks_and_cannot_be_commanded():
    feed = ReplayFeed(read_tlog(DATA / "square-flight.tlog"), "square-flight.tlog")
    app = ReplayApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("space")
        assert not feed.playing
        await pilot.press("end")
        assert feed.snapshot.reached == {0, 1, 2, 3, 4, 5}
        assert len(feed.snapshot.track) > 50
        await pilot.press("home")
        assert feed.snapshot.reached == frozenset()
        await pilot.press("right_square_bracket")
        assert feed.speed == 2.0
        await pilot.press("a")
        assert isinstance(app.screen, FlightScreen)
