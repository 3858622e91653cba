"""The last line: which keys it shows, and what the mouse does there."""

import pytest
from textual import events
from textual.app import App
from textual.binding import Binding
from textual.widgets import Static

from darko_gcs.tui.key_footer import KeyFooter
from tests.support.gcs.screens import screen_text, until


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


async def test_the_wheel_shows_the_rest_of_a_line_that_is_too_wide_and_no_more(app):
    async with app.run_test(size=(20, 10)) as pilot:
        await until(pilot, shown(app))
        footer = app.query_one(KeyFooter)

        def turn(kind):
            footer.post_message(kind(footer, 1, 0, 0, 1, 0, False, False, False))

        turn(events.MouseScrollUp)
        await pilot.pause()
        assert line(app) == "a Arm b Begin c Cut"
        turn(events.MouseScrollDown)
        await until(pilot, lambda: line(app).startswith("Arm b"))
        await pilot.click(KeyFooter, offset=(4, 0))
        assert app.noted == ["b"]
        for _ in range(20):
            turn(events.MouseScrollDown)
        await until(pilot, lambda: line(app).endswith("l Last"))
        await pilot.resize_terminal(80, 10)
        await until(pilot, shown(app))
