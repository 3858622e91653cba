"""Keys: the last line of a screen, and each key handled to its end before the next one is looked at."""

import pytest
from textual import events
from textual.app import App
from textual.binding import Binding
from textual.widgets import Static

from darko_gcs.tui.app import GroundStationApp
from darko_gcs.tui.key_footer import BURST_GAP, KeyFooter
from darko_gcs.tui.screens.flight_screen import FlightScreen
from darko_gcs.tui.screens.mission_screen import MissionScreen
from tests.support.gcs.screens import FakeFeed, screen_text, until
from tests.support.gcs.snapshots import HOVERING


class Keys(App):
    """An app that notes which of its keys were pressed, and how often it was to ring the bell."""

    BINDINGS = [  # noqa: RUF012 - declared so by Textual
        Binding("a", "note('a')", "Arm", tooltip="Let the motors turn"),
        Binding("b,f5", "note('b')", "Begin", key_display="b"),
        Binding("c", "refused('c')", "Cut"),
        Binding("h", "note('h')", "Hidden", show=False),
        Binding("l", "note('l')", "Last"),
    ]

    def __init__(self):
        super().__init__()
        self.noted, self.rung = [], 0

    def compose(self):
        yield Static("above")
        yield KeyFooter()

    def check_action(self, action, _parameters):
        return None if action == "refused" else True

    def action_note(self, key):
        self.noted.append(key)

    action_refused = action_note

    def bell(self):
        self.rung += 1


def line(app):
    return screen_text(app).splitlines()[-1].rstrip()


def styles(app):
    """The style of each cell of the line."""
    strip = app.query_one(KeyFooter).render_line(0)
    return [style for text, style, _ in strip for _ in text]


@pytest.fixture
def app():
    return Keys()


def shown(app):
    return lambda: "a Arm" in line(app)


@pytest.mark.parametrize(("width", "rest"), [(80, " h Hidden"), (35, ""), (36, " h Hidden")])
async def test_each_action_has_its_first_key_and_seldom_ones_are_shown_where_there_is_room(app, width, rest):
    async with app.run_test(size=(width, 10)) as pilot:
        await until(pilot, shown(app))
        assert line(app) == f"a Arm b Begin c Cut l Last{rest}"
        await pilot.resize_terminal(30, 10)
        await until(pilot, lambda: line(app) == "a Arm b Begin c Cut l Last")


async def test_it_shows_what_works_now_and_is_painted_only_when_that_changes(app):
    async with app.run_test(size=(80, 10)) as pilot:
        await until(pilot, shown(app))
        footer, painted = app.query_one(KeyFooter), []
        footer.refresh = lambda *_, **__: painted.append(1) or footer
        app.screen.refresh_bindings()
        await pilot.pause()
        assert not painted
        app.bind("x", "note('x')", description="Extra")
        app.screen.refresh_bindings()
        await until(pilot, lambda: painted)
        assert "Extra" in [key.description for key in footer._shown]


async def test_without_the_terminals_focus_it_stays(app):
    async with app.run_test(size=(80, 10)) as pilot:
        await until(pilot, shown(app))
        app.bind("x", "note('x')", description="Extra")
        app.app_focus = False
        app.screen.refresh_bindings()
        await pilot.pause()
        assert "Extra" not in line(app)
        app.app_focus = True
        app.screen.refresh_bindings()
        await until(pilot, lambda: "x Extra" in line(app))


@pytest.mark.parametrize(("x", "pressed"), [(0, ["a"]), (4, ["a"]), (5, []), (6, ["b"]), (12, ["b"]), (13, [])])
async def test_a_click_is_the_key_and_between_the_keys_is_nothing(app, x, pressed):
    async with app.run_test(size=(80, 10)) as pilot:
        await until(pilot, shown(app))
        await pilot.click(KeyFooter, offset=(x, 0))
        await pilot.pause()
        assert (app.noted, app.rung) == (pressed, 0)


async def test_a_key_that_does_nothing_now_is_dim_and_a_click_rings_the_bell(app):
    async with app.run_test(size=(80, 10)) as pilot:
        await until(pilot, shown(app))
        await pilot.click(KeyFooter, offset=(15, 0))
        assert (app.noted, app.rung) == ([], 1)
        assert [cell for cell, style in enumerate(styles(app)) if style.dim] == list(range(14, 19))


async def test_the_key_under_the_mouse_is_lit_and_says_more(app):
    async with app.run_test(size=(80, 10)) as pilot:
        await until(pilot, shown(app))
        footer, before = app.query_one(KeyFooter), styles(app)
        await pilot.hover(KeyFooter, offset=(1, 0))
        await until(pilot, lambda: footer.tooltip == "Let the motors turn")
        assert [cell for cell, (was, now) in enumerate(zip(before, styles(app), strict=True)) if was != now] == [
            *range(5)
        ]
        await pilot.hover(KeyFooter, offset=(7, 0))
        await until(pilot, lambda: footer.tooltip is None)
        await pilot.hover(Static)
        await until(pilot, lambda: styles(app) == before)


async def test_the_wheel_shows_the_rest_of_a_line_that_is_too_wide_which_its_ends_tell(app):
    async with app.run_test(size=(20, 10)) as pilot:
        await until(pilot, shown(app))
        footer = app.query_one(KeyFooter)

        def turn(kind):
            footer.post_message(kind(footer, 1, 0, 0, 1, 0, False, False, False))

        turn(events.MouseScrollUp)
        await pilot.pause()
        assert line(app) == "a Arm b Begin c Cut›"
        turn(events.MouseScrollDown)
        await until(pilot, lambda: line(app) == "‹rm b Begin c Cut l›")
        await pilot.click(KeyFooter, offset=(4, 0))
        assert app.noted == ["b"]
        for _ in range(20):
            turn(events.MouseScrollDown)
        await until(pilot, lambda: line(app).endswith("l Last"))
        await pilot.resize_terminal(80, 10)
        await until(pilot, shown(app))


@pytest.fixture
def feed():
    return FakeFeed(HOVERING)


NAMES = {"\t": "tab", "\r": "enter", ".": "full_stop", "/": "slash", "-": "minus"}


def type_at_once(app, text):
    """Give the app all keys of a text in one go, as a terminal does that has read them together."""
    for character in text:
        app.post_message(events.Key(NAMES.get(character, character), character))


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


@pytest.mark.long(after=1)
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
        assert app.draft.plan.items in {(), HOVERING.plans.mission}


async def test_a_key_right_after_escape_is_taken(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("m")
        await until(pilot, lambda: isinstance(app.screen, MissionScreen))
        app.post_message(events.Key("escape", "\x1b"))
        app.post_message(events.Key("l", "l"))
        await until(pilot, lambda: "Land here?" in screen_text(app))


async def test_escape_between_keys_of_a_paste_does_not_part_them(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24), notifications=True) as pilot:
        for key, character in (("x", "x"), ("escape", "\x1b"), ("l", "l")):
            app.post_message(events.Key(key, character))
        await until(pilot, lambda: "were ignored" in " ".join(screen_text(app).split()))
        assert "Land here?" not in screen_text(app)


async def test_keys_that_are_ignored_are_told_once_while_the_notice_is_shown(feed, monkeypatch):
    told = []
    monkeypatch.setattr(GroundStationApp, "_tell_ignored_keys", lambda _app: told.append(1))
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        for moment in (0.0, 1.0, 4.9, 5.2):
            for _ in range(2):  # the second one came together with the first
                key = events.Key("x", "x")
                key.time = 1000.0 + moment
                app.post_message(key)
        await until(pilot, lambda: len(told) == 2)


async def test_a_marked_paste_reaches_no_key(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        app.post_message(events.Paste("alhy"))
        await pilot.press("g")
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
        app.post_message(early)
        await pilot.pause(0.1)
        assert feed.requests == []
        await pilot.press("y")
        await until(pilot, lambda: feed.requests == [("land",)])
