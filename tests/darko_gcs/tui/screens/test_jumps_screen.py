"""The list of the supervisor's jumps."""

from darko_gcs.tui.app import GroundStationApp
from darko_gcs.tui.screens.jumps_screen import JumpsScreen
from protocol.dialect.vocabulary import Law, Reason
from tests.support.gcs.screens import FakeFeed, screen_text, until
from tests.support.gcs.snapshots import HOVERING, snapshot_with

LATER = HOVERING.hybrid.jumps[0]._replace(
    time=62.5, number=3, source=Law.HOVER_LINEAR, target=Law.INDI, reason=Reason.LYAPUNOV_ABOVE
)


def lines(app):
    return [line for line in screen_text(app).splitlines() if "threshold" in line]


async def test_every_jump_has_a_line_newest_first_and_the_list_follows_the_vehicle():
    feed = FakeFeed(HOVERING)
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("V")
        await until(pilot, lambda: isinstance(app.screen, JumpsScreen) and lines(app))
        (line,) = lines(app)
        assert line.split() == ["0:48.0", "50", "hover", "zero-moment", "hover", "linear", "V", "below", "threshold"]
        assert "hover linear in force (V 0.8 below 100: the law stays); 1 jump of 2" in screen_text(app)
        feed.snapshot = snapshot_with(HOVERING, hybrid={"jumps": (*HOVERING.hybrid.jumps, LATER)})
        await until(pilot, lambda: len(lines(app)) == 2)
        assert "INDI" in lines(app)[0]
        await pilot.press("escape")
        await until(pilot, lambda: not isinstance(app.screen, JumpsScreen))


async def test_the_palette_finds_it_by_jump_and_by_law():
    app = GroundStationApp(FakeFeed(HOVERING))
    async with app.run_test(size=(80, 24)):
        for query in ("jump", "law"):
            ranked = sorted(app.palette_entries(app.screen), key=lambda entry: -entry.score(query))
            assert ranked[0].title == "List the jumps from law to law"
