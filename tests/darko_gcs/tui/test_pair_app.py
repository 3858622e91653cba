"""Two recordings side by side, driven by keys."""

import pytest

from darko_gcs.feed.pair_feed import Alignment, PairFeed
from darko_gcs.feed.replay_feed import ReplayFeed
from darko_gcs.state.map_overlay import OverlayShape
from darko_gcs.tui.replay_app import PairApp
from darko_gcs.tui.screens.dialogs import HelpScreen
from darko_gcs.tui.widgets.pair_panels import TimeBar
from protocol.tlog import TlogReader, read_tlog
from tests.support.gcs.screens import screen_text, settled, until
from tests.support.logs import quadplane_log
from tests.support.paths import DATA

SIZES = [(80, 24), (120, 40), (200, 60)]


def recorded():
    return ReplayFeed(read_tlog(DATA / "square-flight.tlog"), "square-flight.tlog")


@pytest.fixture
def feed():
    """A flight beside itself, two seconds later."""
    return PairFeed(recorded(), recorded(), shift=2.0)


@pytest.mark.long(after=1)
@pytest.mark.parametrize("size", SIZES)
async def test_both_flights_are_in_every_panel(feed, size):
    app = PairApp(feed)
    async with app.run_test(size=size) as pilot:
        await pilot.press("space", "5")
        await until(pilot, lambda: "A MISSION ARMED" in screen_text(app))
        shown = screen_text(app)
        assert "B MISSION ARMED" in shown.splitlines()[0]
        assert all(title in shown for title in ("Values", "Map", "V of the law in force", "Height"))
        assert "by takeoff +2 s" in shown
        for letter in "AB":
            assert any(f"{arrow}{letter}" in shown for arrow in "↑↗→↘↓↙←↖")
        heights = [-flight.feed.snapshot.position.from_home[2] for flight in feed.flights]
        assert f"{heights[1] - heights[0]:+.1f}" in shown


async def test_each_flight_has_its_own_marks(feed):
    app = PairApp(feed)
    async with app.run_test(size=(120, 40)) as pilot:
        await pilot.press("space")
        first, second, legend = (
            "".join(text for text, _ in line) for line in app.screen.query_one(TimeBar).draw(feed.snapshot, 120, 3)
        )
    assert (first[:3], second[:3]) == ("⏸ A", "  B")
    assert "waypoint" in legend
    assert "◆" in first
    assert second[4:].count("◆") == first.count("◆")
    assert second.index("◆") > first.index("◆")  # two seconds later


@pytest.mark.long
async def test_the_alignment_is_changed_by_key(feed):
    app = PairApp(feed)
    async with app.run_test(size=(120, 40)) as pilot:
        await pilot.press("space", "5", "greater_than_sign", "greater_than_sign", "less_than_sign", "left_parenthesis")
        assert feed.shift == pytest.approx(1.1)
        await until(pilot, lambda: "by takeoff +1.1 s" in screen_text(app))
        await pilot.press("o")
        assert (feed.alignment, feed.shift) == (Alignment.START, 0.0)
        await until(pilot, lambda: "by start, t =" in screen_text(app))
        await pilot.press("question_mark")
        await until(pilot, lambda: isinstance(app.screen, HelpScreen) and "Align by take-off" in screen_text(app))


async def test_the_players_keys_move_both(feed):
    app = PairApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("space", "home")
        await pilot.press("j")
        jump = feed.now
        assert jump == next(mark.time for mark in feed.marks if mark.kind.value == "jump" and mark.time > 0.0)
        assert [flight.feed.now for flight in feed.flights] == pytest.approx(
            [flight.feed.timeline.position for flight in feed.flights]
        )
        await pilot.press("full_stop")
        assert feed.now > jump
        await pilot.click(TimeBar, offset=(30, 0))
        assert 0.3 * feed.duration < feed.now < 0.7 * feed.duration


async def test_another_autopilot_is_compared_by_what_both_tell():
    app = PairApp(PairFeed(recorded(), ReplayFeed(TlogReader(quadplane_log()), "quadplane"), begin=38.0))
    async with app.run_test(size=(120, 40)) as pilot:
        await pilot.press("space")
        await until(pilot, lambda: "B QLOITER ARMED" in screen_text(app))
        assert "differs" in screen_text(app)
        assert "each around its own home" in screen_text(app)


async def test_the_overlay_lies_on_the_map_of_both(feed):
    feed.seek(20.0)
    app = PairApp(feed)
    app.overlay = (OverlayShape("hangar", (feed.flights[0].feed.snapshot.position.home,)),)
    async with app.run_test(size=(120, 40)) as pilot:
        await pilot.press("space", "5")
        await until(pilot, lambda: "•hangar" in screen_text(app))


@pytest.mark.long(after=1)
@pytest.mark.parametrize("size", SIZES)
def test_the_screen_matches_its_snapshot(snap_compare, size):
    feed = PairFeed(recorded(), recorded(), shift=2.0, begin=20.0)
    feed.playing = False

    async def settle(pilot):
        await until(pilot, lambda: "B - A" in screen_text(pilot.app))
        await settled(pilot)

    assert snap_compare(PairApp(feed), terminal_size=size, run_before=settle)


@pytest.mark.long(after=1)
@pytest.mark.parametrize(("key", "moved"), [("shift+right", 30.0), ("shift+left", -30.0), ("shift+up", 0.0)])
async def test_shift_and_an_arrow_seek_or_do_nothing(feed, key, moved):
    app = PairApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("space", "5")
        before = feed.now
        await pilot.press(key)
        assert feed.now == pytest.approx(min(max(before + moved, 0.0), feed.duration))
        await pilot.press("question_mark")
        await until(pilot, lambda: isinstance(app.screen, HelpScreen))
        assert "Map: zoom in" not in str(app.screen._sections)
        keys = [key for _, rows in app.screen._sections for keys, _ in rows for key in keys.split()]
        assert len(keys) == len(set(keys))
