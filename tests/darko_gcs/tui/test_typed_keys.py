"""Keys that arrive together, as over a slow link or from a paste."""

import pytest
from textual import events

from darko_gcs.tui.app import GroundStationApp
from darko_gcs.tui.key_footer import BURST_GAP
from darko_gcs.tui.screens.flight_screen import FlightScreen
from darko_gcs.tui.screens.mission_screen import MissionScreen
from tests.support.gcs.screens import FakeFeed, screen_text, until
from tests.support.gcs.snapshots import HOVERING


@pytest.fixture
def feed():
    return FakeFeed(HOVERING)


NAMES = {"\t": "tab", "\r": "enter", ".": "full_stop", "/": "slash", "-": "minus"}


def type_at_once(app, text):
    """Give the app all keys of a text in one go, as a terminal does that has read them together."""
    for character in text:
        app._driver.send_message(events.Key(NAMES.get(character, character), character))


async def test_a_form_gets_the_keys_typed_ahead_of_it_each_in_its_field(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        type_at_once(app, "g30\t20\t5\r")
        await until(pilot, lambda: feed.requests == [("go_to", 30.0, 20.0, 5.0)])
        await until(pilot, lambda: isinstance(app.screen, FlightScreen))


async def test_a_number_of_several_digits_and_a_sign_arrives_whole(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        type_at_once(app, "g-12.5\t-3\t14.25\r")
        await until(pilot, lambda: feed.requests == [("go_to", -12.5, -3.0, 14.25)])


@pytest.mark.parametrize(
    "pasted",
    ["/home/pilot/plans/survey.plan\r", "hy", "dy\r", "v\t\ry", "muy", "mc\r"],
)
async def test_a_paste_is_never_a_command(feed, pasted):
    feed.station.snapshot = feed.snapshot
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24), notifications=True) as pilot:
        type_at_once(app, pasted)
        await until(pilot, lambda: "were ignored" in " ".join(screen_text(app).split()))
        await pilot.pause(0.1)
        assert feed.requests == []
        assert app.draft.plan.items in {(), HOVERING.mission}


async def test_a_key_right_after_escape_is_taken(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("m")
        await until(pilot, lambda: isinstance(app.screen, MissionScreen))
        app._driver.send_message(events.Key("escape", "\x1b"))
        app._driver.send_message(events.Key("l", "l"))
        await until(pilot, lambda: "Land here?" in screen_text(app))


async def test_escape_between_keys_of_a_paste_does_not_part_them(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24), notifications=True) as pilot:
        for key, character in (("x", "x"), ("escape", "\x1b"), ("l", "l")):
            app._driver.send_message(events.Key(key, character))
        await until(pilot, lambda: "were ignored" in " ".join(screen_text(app).split()))
        assert "Land here?" not in screen_text(app)


async def test_a_marked_paste_reaches_no_key(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        app._driver.send_message(events.Paste("alhy"))
        await pilot.press("t")
        await until(pilot, lambda: "Height above home" in screen_text(app))
        assert feed.requests == []


async def test_a_question_is_answered_only_after_it_was_asked(feed):
    feed.snapshot = HOVERING
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        type_at_once(app, "ly")
        await until(pilot, lambda: "Land here?" in screen_text(app))
        assert feed.requests == []
        await pilot.pause(2 * BURST_GAP)  # or this y would have come together with the other
        await pilot.press("y")
        await until(pilot, lambda: feed.requests == [("land",)])


async def test_keys_work_even_if_nobody_hands_them_out(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        app._keys.stop()
        await pilot.press("l")
        await until(pilot, lambda: "Land here?" in screen_text(app))


async def test_an_answer_typed_before_its_question_was_there_does_not_count(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        early = events.Key("y", "y")  # as from a machine that is too busy to show the question
        await pilot.press("l")
        await until(pilot, lambda: "Land here?" in screen_text(app))
        app._driver.send_message(early)
        await pilot.pause(0.1)
        assert feed.requests == []
        await pilot.press("y")
        await until(pilot, lambda: feed.requests == [("land",)])
