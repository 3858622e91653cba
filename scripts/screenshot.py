"""Export a picture of docs/station.md from the application, at a moment of the recorded square.

``python scripts/screenshot.py docs/screenshot.svg``; keys that lead to another screen follow:
``docs/inspector.svg E h y b r i d``, ``docs/charts.svg C 0 left``. ``--live`` first shows that moment as of a vehicle
that is there, which recordings have no keys for: ``--live docs/by-hand.svg y y up``,
``--live docs/fence.svg m F i enter``.
"""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Sequence
from pathlib import Path

from darko_gcs.feed.replay_feed import ReplayFeed
from darko_gcs.state.parts import SessionStatus
from darko_gcs.station.station import Station
from darko_gcs.tui.app import GroundStationApp
from darko_gcs.tui.replay_app import ReplayApp
from darko_gcs.tui.view_controls import without_fetched_fonts
from protocol.tlog import read_tlog

FLIGHT = Path(__file__).resolve().parent.parent / "tests" / "data" / "square-flight.tlog"
MOMENT = 2.05  # of the recording: on the second leg of the square [s]


class StillVehicle(ReplayFeed):
    """The moment as of a vehicle that is there, and hears nothing."""

    def advance(self, elapsed: float) -> None:
        """It stands still."""


async def export(path: Path, keys: Sequence[str], *, is_live: bool) -> None:
    """Write the screen after some keys as SVG."""
    kind = StillVehicle if is_live else ReplayFeed
    feed = kind(read_tlog(FLIGHT), FLIGHT.name, begin=MOMENT)
    feed.playing = False
    app = GroundStationApp(feed) if is_live else ReplayApp(feed)
    async with app.run_test(size=(120, 36)) as pilot:
        await pilot.pause(0.5)
        if is_live:
            feed.station = Station()
            flown = feed.snapshot.status._replace(mode="POSCTL")
            feed.snapshot = feed.snapshot._replace(session=SessionStatus(), status=flown)
        for key in keys:
            await pilot.press(key)
            await pilot.pause(0.5)
        picture = without_fetched_fonts(app.export_screenshot(title="DarkO ground station"))
        path.write_text(picture, encoding="utf-8")


if __name__ == "__main__":
    live = sys.argv[1] == "--live"
    path, *typed = sys.argv[1 + live :]
    asyncio.run(export(Path(path), typed, is_live=live))
