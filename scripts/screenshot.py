"""Pictures of docs/station.md from the application, at a moment of the recorded square.

``python scripts/screenshot.py``; with names (``charts fence``), only these. Some show that moment as of a vehicle that
is there: a recording has no keys for what they show.
"""

from __future__ import annotations

import asyncio
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from darko_gcs.feed.replay_feed import ReplayFeed
from darko_gcs.state.map_overlay import Overlay, OverlayShape
from darko_gcs.state.message_log import add_line
from darko_gcs.state.parts import SessionStatus
from darko_gcs.state.values import Alert
from darko_gcs.station.station import Station
from darko_gcs.tui.app import GroundStationApp
from darko_gcs.tui.replay_app import ReplayApp
from darko_gcs.tui.view_controls import without_fetched_fonts
from protocol.dialect import mavlink
from protocol.frames import LocalFrame
from protocol.tlog import read_tlog
from sitl.defaults import HOME

ROOT = Path(__file__).resolve().parent.parent
FLIGHT = ROOT / "tests" / "data" / "square-flight.tlog"
MOMENT = 2.05  # of the recording: on the second leg of the square [s]
SETTLED = 0.5  # after a key [s]


@dataclass(frozen=True, kw_only=True)
class Picture:
    """A screen: keys that lead to it, whether a vehicle is there, and what is other than it was recorded."""

    keys: str = ""
    is_live: bool = False
    status: dict[str, Any] = field(default_factory=dict)
    alerts: tuple[tuple[str, str], ...] = ()  # kinds and words
    told: str = ""  # by the vehicle, after the last key
    overlay: Overlay = ()


def _shape(name: str, *places: tuple[float, float], top: float | None = None) -> OverlayShape:
    """A shape of places north and east of home [m]; with a top, a building."""
    to_geodetic = LocalFrame(HOME).to_geodetic
    return OverlayShape(name, tuple(to_geodetic((*place, 0.0)) for place in places), is_area=top is not None, top=top)


SITE = (_shape("Hangar", (16.0, 8.0), (16.0, 30.0), (30.0, 30.0), (30.0, 8.0), top=9.0), _shape("Gate", (-22.0, -30.0)))
GROUNDED = {"armed": False, "prearm_ok": False, "landed_state": mavlink.MAV_LANDED_STATE_ON_GROUND}
PICTURES = {
    "screenshot": Picture(),
    "inspector": Picture(keys="E h y b r i d"),
    "charts": Picture(keys="C 0 left"),
    "fence": Picture(keys="m G i enter", is_live=True, overlay=SITE),
    "alerts": Picture(keys="e", is_live=True, alerts=(("battery", "battery low: 12 % left"),)),
    "by-hand": Picture(keys="y y up", is_live=True, status={"mode": "POSCTL"}),
    "pre-flight": Picture(
        keys="i", is_live=True, status=GROUNDED, told="Pre-arm: not upright (80 deg from the vertical)"
    ),
    "palette": Picture(keys="ctrl+p f e n c e"),
}


class StillVehicle(ReplayFeed):
    """The moment as of a vehicle that is there, and hears nothing."""

    def advance(self, elapsed: float) -> None:
        """It stands still."""


def _set(feed: ReplayFeed, picture: Picture) -> None:
    """The moment as the picture shows it."""
    feed.station = Station()
    alerts = tuple(Alert(kind, text, feed.now) for kind, text in picture.alerts)
    s = feed.snapshot
    feed.snapshot = s._replace(session=SessionStatus(alerts=alerts), status=s.status._replace(**picture.status))
    for alert in alerts:
        feed.snapshot = add_line(feed.snapshot, feed.now, mavlink.MAV_SEVERITY_CRITICAL, f"Alert: {alert.text}")


async def export(path: Path, picture: Picture) -> None:
    """Write a picture as SVG."""
    feed = (StillVehicle if picture.is_live else ReplayFeed)(read_tlog(FLIGHT), FLIGHT.name, begin=MOMENT)
    feed.playing = False
    app = GroundStationApp(feed) if picture.is_live else ReplayApp(feed)
    app.overlay = picture.overlay
    async with app.run_test(size=(120, 36)) as pilot:
        await pilot.pause(SETTLED)
        if picture.is_live:
            _set(feed, picture)
        for key in picture.keys.split():
            await pilot.press(key)
            await pilot.pause(SETTLED)
        if picture.told:
            feed.snapshot = add_line(feed.snapshot, feed.now, mavlink.MAV_SEVERITY_WARNING, picture.told)
            await pilot.pause(SETTLED)
        drawn = without_fetched_fonts(app.export_screenshot(title="DarkO ground station"))
        path.write_text(drawn, encoding="utf-8")


if __name__ == "__main__":
    for name in sys.argv[1:] or PICTURES:
        asyncio.run(export(ROOT / "docs" / f"{name}.svg", PICTURES[name]))
