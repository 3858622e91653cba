"""Panels paint rows that changed, and nothing else."""

import pytest
from textual.app import App
from textual.pilot import Pilot

from darko_gcs.snapshot import EMPTY
from darko_gcs.store import note
from darko_gcs.widgets.panel import Panel, text_line
from tests.darko_gcs.screens import until


class Words(Panel):
    """A row per word of the newest message."""

    def __init__(self):
        self.painted = []
        super().__init__("", id="words")

    def draw(self, s, width, height):  # noqa: ARG002 - cut by the panel
        return [text_line((word, "good")) for word in s.messages[-1].text.split()] if s.messages else []

    def refresh(self, *regions, **options):
        self.painted += [region.y for region in regions]
        return super().refresh(*regions, **options)


class OnePanel(App[None]):
    CSS = "Panel { height: 4; & > .panel--good { color: red; } } .-off Panel > .panel--good { color: blue; }"

    def compose(self):
        yield Words()


@pytest.fixture
async def panel():
    app = OnePanel()
    async with app.run_test(size=(20, 6)):
        yield app.query_one(Words)


def said(text):
    return note(EMPTY, 1.0, 6, text)


async def test_only_rows_that_differ_are_painted(panel):
    panel.snapshot = said("one two three")
    panel.painted.clear()
    panel.snapshot = said("one 2 three")
    assert panel.painted == [1]


async def test_what_is_drawn_the_same_is_not_painted(panel):
    panel.snapshot = said("one two three")
    panel.painted.clear()
    panel.snapshot = said("one  two  three")
    assert panel.painted == []


async def test_rows_that_are_gone_are_painted_over(panel):
    panel.snapshot = said("one two three")
    panel.painted.clear()
    panel.snapshot = said("one")
    assert panel.painted == [1, 2]
    assert panel.render_line(2).text.strip() == ""


async def test_rows_are_as_wide_as_the_panel(panel):
    panel.snapshot = said("x" * 50)
    assert [panel.render_line(y).cell_length for y in range(4)] == [20] * 4


async def test_a_class_on_an_ancestor_changes_the_colours(panel):
    panel.snapshot = said("one")
    before = next(iter(panel.render_line(0))).style.color
    panel.app.screen.add_class("-off")
    await until(Pilot(panel.app), lambda: next(iter(panel.render_line(0))).style.color != before)
