"""The station's colours on each theme's background, and theme and panels as the operator chose them."""

import pytest
from textual.color import Color
from textual.theme import BUILTIN_THEMES

from darko_gcs.tui.app import GroundStationApp
from darko_gcs.tui.kept_look import MIN_CONTRAST, contrast, readable
from darko_gcs.tui.widgets.panel import PANEL_STYLES
from darko_gcs.tui.widgets.status_bar import StatusBar
from tests.support.gcs.screens import FakeFeed
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
