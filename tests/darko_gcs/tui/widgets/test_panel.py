"""Panels paint the rows that changed, and nothing else."""

import pytest
from textual.app import App
from textual.geometry import Region
from textual.pilot import Pilot

from darko_gcs.state.message_log import add_line
from darko_gcs.state.snapshot import EMPTY_SNAPSHOT
from darko_gcs.state.values import LogLine
from darko_gcs.tui.widgets.panel import PANEL_STYLES, MessagePanel, Panel, styled_line
from protocol.dialect import mavlink
from tests.support.gcs.screens import until


class WordPanel(Panel):
    """A row per word of the newest message; remembers which rows were painted."""

    def __init__(self):
        self.painted = []
        super().__init__("", id="words")

    def draw(self, s, width, height):  # noqa: ARG002 - cut by the panel
        return [styled_line((word, "good")) for word in s.log.lines[-1].text.split()] if s.log.lines else []

    def refresh(self, *regions, **options):
        self.painted += [region.y for region in regions]
        return super().refresh(*regions, **options)


class OnePanelApp(App[None]):
    CSS = "Panel { height: 4; } App > .panel--good { color: $foreground; }"
    COMPONENT_CLASSES = {f"panel--{name}" for name in PANEL_STYLES}  # noqa: RUF012 - declared so by Textual

    def compose(self):
        yield WordPanel()


@pytest.fixture
async def panel():
    app = OnePanelApp()
    async with app.run_test(size=(20, 6)):
        yield app.query_one(WordPanel)


def with_words(text):
    return add_line(EMPTY_SNAPSHOT, 1.0, mavlink.MAV_SEVERITY_INFO, text)


async def test_only_rows_that_changed_are_painted(panel):
    panel.snapshot = with_words("one two three")
    panel.painted.clear()
    panel.snapshot = with_words("one 2 three")
    assert panel.painted == [1]


async def test_what_a_frame_leaves_out_is_painted_with_the_next(panel):
    panel.snapshot = with_words("one two three")
    panel.painted.clear()
    newer = with_words("one 2 three")
    panel.show_snapshot(newer, 2.0, is_due=False)
    assert panel.painted == []
    panel.show_snapshot(newer, 2.1)
    assert panel.painted == [1]


async def test_unchanged_rows_are_not_painted(panel):
    panel.snapshot = with_words("one two three")
    panel.painted.clear()
    panel.snapshot = with_words("one  two  three")
    assert panel.painted == []


async def test_rows_that_are_gone_are_painted_over(panel):
    panel.snapshot = with_words("one two three")
    panel.painted.clear()
    panel.snapshot = with_words("one")
    assert panel.painted == [1, 2]
    assert panel.render_line(2).text.strip() == ""


async def test_rows_are_as_wide_as_the_panel(panel):
    panel.snapshot = with_words("x" * 50)
    assert [panel.render_line(y).cell_length for y in range(4)] == [20] * 4


async def test_the_colours_of_another_theme_are_painted(panel):
    panel.snapshot = with_words("one")
    before = next(iter(panel.render_line(0))).style.color
    panel.app.theme = "textual-light"
    await until(Pilot(panel.app), lambda: next(iter(panel.render_line(0))).style.color != before)


def painted(panel):
    return [strip.simplify()._segments for strip in panel.render_lines(panel.outer_size.region)]


@pytest.mark.parametrize("words", ["one 2 three", "one", "a b c d e f", "漢字 " + "x" * 50])
async def test_kept_rows_look_like_rows_that_are_painted_anew(panel, words):
    panel.styles.border = ("round", "green")
    panel.snapshot = with_words("one two three")
    before = painted(panel)
    panel.show_snapshot(with_words(words), 2.0)
    kept = painted(panel)
    panel.refresh()
    assert kept == painted(panel) != before


async def test_a_part_of_a_panel_is_cut_out_of_its_rows(panel):
    panel.snapshot = with_words("one two three")
    assert [strip.text for strip in panel.render_lines(Region(1, 1, 4, 2))] == ["wo  ", "hree"]


async def test_a_new_title_is_painted(panel):
    panel.styles.border = ("round", "green")
    painted(panel)
    panel.border_title = "Words"
    assert "Words" in panel.render_lines(panel.outer_size.region)[0].text


def told(*lines, height):
    s = EMPTY_SNAPSHOT._replace(log=EMPTY_SNAPSHOT.log._replace(lines=lines))
    return ["".join(part for part, _ in row) for row in MessagePanel("", id="x").draw(s, 40, height)]


def test_of_a_refusal_the_reason_is_shown_from_its_beginning():
    warning, why = mavlink.MAV_SEVERITY_WARNING, "Speed refused: no lower than 13.9 m/s and no higher in this flight"
    reason, bare = LogLine(1.0, warning, why), LogLine(1.1, warning, "speed 12.0 m/s: temporarily rejected")
    armed = LogLine(0.0, mavlink.MAV_SEVERITY_INFO, "Armed")
    shown = ["Speed refused: no lower than 13.9 m/s", "  and no higher in this flight"]
    assert told(armed, reason, bare, height=2) == shown
    assert told(armed, reason, bare, height=1) == shown[:1]
    assert told(armed, bare, reason, height=3) == ["Armed", *shown]
    assert told(armed, bare, height=2) == ["Armed", bare.text]
    assert told(reason._replace(time=-9.0), armed, bare, height=2) == ["Armed", bare.text]
