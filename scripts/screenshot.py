"""Export a picture of docs/station.md from the application, at a moment of the recorded square.

``python scripts/screenshot.py docs/screenshot.svg``; keys that lead to another screen follow:
``docs/inspector.svg E h y b r i d``, ``docs/charts.svg C 0 left``.
"""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Sequence
from pathlib import Path

from darko_gcs.feed.replay_feed import ReplayFeed
from darko_gcs.tui.app import without_fetched_fonts
from darko_gcs.tui.replay_app import ReplayApp
from protocol.tlog import read_tlog

FLIGHT = Path(__file__).resolve().parent.parent / "tests" / "data" / "square-flight.tlog"
MOMENT = 2.05  # of the recording: on the second leg of the square [s]


async def export(path: Path, keys: Sequence[str]) -> None:
    """Write the screen after some keys as SVG."""
    feed = ReplayFeed(read_tlog(FLIGHT), FLIGHT.name, begin=MOMENT)
    feed.playing = False
    app = ReplayApp(feed)
    async with app.run_test(size=(120, 36)) as pilot:
        await pilot.pause(0.5)
        for key in keys:
            await pilot.press(key)
            await pilot.pause(0.5)
        picture = without_fetched_fonts(app.export_screenshot(title="DarkO ground station"))
        path.write_text(picture, encoding="utf-8")


if __name__ == "__main__":
    asyncio.run(export(Path(sys.argv[1]), sys.argv[2:]))
