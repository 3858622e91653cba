"""The station's colours on each theme's background, and theme and panels as the operator chose them."""

import pytest
from textual.color import Color
from textual.theme import BUILTIN_THEMES

from darko_gcs.tui.app import GroundStationApp
from darko_gcs.tui.kept_look import MIN_CONTRAST, contrast, readable
from darko_gcs.tui.widgets.panel import PANEL_STYLES
from darko_gcs.tui.widgets.status_bar import StatusBar
from tests.support.gcs.screens import FakeFeed, settled
from tests.support.gcs.snapshots import HOVERING

THEMES = [name for name in BUILTIN_THEMES if not name.startswith("ansi")]  # those have the terminal's own colours
DRAWN = {name for name in PANEL_STYLES if name.startswith(("sky", "ground"))}  # areas, not text


def colour(rich):
    return Color(*rich.triplet)


def test_the_ratio_is_that_of_the_standard():
    assert contrast(Color(0, 0, 0), Color(255, 255, 255)) == pytest.approx(21.0)
    assert contrast(Color.parse("#777777"), Color(255, 255, 255)) == pytest.approx(4.48, abs=0.005)
    assert contrast(Color(9, 9, 9), Color(9, 9, 9)) == 1.0


def test_a_colour_that_reads_stays_and_another_is_moved_no_farther_than_it_must():
    ground = [Color.parse("#121212")]
    assert readable(Color.parse("#4EBF71"), ground) == Color.parse("#4EBF71")
    moved = readable(Color.parse("#B93C5B"), ground)
    assert MIN_CONTRAST <= contrast(moved, ground[0]) < MIN_CONTRAST + 0.4
    own = Color.parse("ansi_red")
    assert readable(own, ground) == own


@pytest.mark.long
async def test_every_style_of_a_panel_and_every_key_of_the_footer_reads_on_every_theme():
    app = GroundStationApp(FakeFeed(HOVERING))
    worst = {}
    async with app.run_test(size=(80, 24)) as pilot:
        for theme in THEMES:
            app.theme = theme
            await pilot.pause()
            screen = app.screen
            grounds = [screen.query_one("#map").background_colors[1], screen.query_one(StatusBar).background_colors[1]]
            for name in PANEL_STYLES:
                if name not in DRAWN:
                    style = app.get_component_styles(f"panel--{name}").partial_rich_style
                    behind = grounds if style.bgcolor is None else [colour(style.bgcolor)]
                    worst[theme, name] = min(contrast(colour(style.color), ground) for ground in behind)
            footer = screen.query_one("KeyFooter")
            for name in ("key-footer--key", "key-footer--description"):
                style = footer.get_component_rich_style(name)
                worst[theme, name] = contrast(colour(style.color), footer.background_colors[1])
    assert len(worst) == len(THEMES) * (len(PANEL_STYLES) - len(DRAWN) + 2)
    assert {key: value for key, value in worst.items() if value < MIN_CONTRAST} == {}


MIN_CHART = 3.0  # of lines and borders, WCAG 2.2, success criterion 1.4.11
SHOWN = ("", "m", "p", "C", "E", "e", "d", "?", "g", "i", "F")  # keys of the screens and dialogs


def is_of(text, first, last):
    """Whether a text is of one range of characters, with blanks."""
    return all(character == " " or first <= character <= last for character in text)


def unreadable(app, theme, key):
    """Texts and curves on the screen whose contrast is too low, with it.

    Left out: what is disabled or below a dialog, borders, and the horizon, whose areas are told apart by their place.
    """
    found, screen = {}, app.screen
    horizon = [panel.region for panel in screen.query("#attitude")]
    dialogs = [dialog.region for dialog in screen.query(".dialog")]
    for y, strip in enumerate(screen._compositor.render_strips()):
        x = 0
        for text, style, _ in strip:
            x += len(text)
            if any(region.contains(x - 1, y) for region in horizon):
                continue
            if dialogs and not any(region.contains(x - 1, y) for region in dialogs):
                continue
            if not text.strip() or not style or style.dim or not style.color or is_of(text, "\u2500", "\u259f"):
                continue
            behind = style.bgcolor.get_truecolor() if style.bgcolor else screen.background_colors[1].rgb
            ratio = contrast(Color(*style.color.get_truecolor()), Color(*behind))
            if ratio < (MIN_CHART if is_of(text, "\u2800", "\u28ff") else MIN_CONTRAST):
                found[theme, key, text.strip()[:24]] = round(ratio, 2)
    return found


@pytest.mark.long
@pytest.mark.parametrize("theme", THEMES)
async def test_every_text_and_every_line_on_the_screens_reads(theme):
    app = GroundStationApp(FakeFeed(HOVERING))
    found = {}
    async with app.run_test(size=(120, 40)) as pilot:
        app.theme = theme
        for key in SHOWN:
            await pilot.press(*key)
            await settled(pilot)
            found |= unreadable(app, theme, key)
            while len(app.screen_stack) > 2:
                await app.pop_screen()
    assert found == {}


def test_themes_of_the_terminal_s_own_colours_are_not_offered():
    """They blend nothing: a dialog would blank the flight behind it."""
    assert not any(theme.ansi for theme in GroundStationApp(FakeFeed(HOVERING)).available_themes.values())
