"""Snapshots at three sizes of what has none beside its behaviour: fence, dialogs, alerts, a lost link, a recording."""

import pytest

from darko_gcs.feed.replay_feed import ReplayFeed
from darko_gcs.state.message_log import add_line
from darko_gcs.state.snapshot import EMPTY_SNAPSHOT
from darko_gcs.state.values import Alert
from darko_gcs.tui.app import GroundStationApp
from darko_gcs.tui.replay_app import ReplayApp
from protocol.dialect import mavlink
from protocol.tlog import read_tlog
from tests.support.gcs.parameters_screen import TUNED
from tests.support.gcs.screens import FakeFeed, screen_text, settled, until
from tests.support.gcs.snapshots import FORWARD, HOVERING, snapshot_with
from tests.support.paths import DATA

SIZES = [(80, 24), (120, 40), (200, 60)]
ALERTED = snapshot_with(
    add_line(FORWARD, 99.0, mavlink.MAV_SEVERITY_CRITICAL, "Battery low: 12 % left"),
    session={"alerts": (Alert("battery", "battery low: 12 % left", 99.0),)},
)
WAITING = snapshot_with(EMPTY_SNAPSHOT, session={"port": 14661})
LOST = snapshot_with(FORWARD, link={"lost": True})
LOOKS = {  # flight, keys, words that show that the last of them was taken
    "waiting": (WAITING, (), ["waiting for a vehicle"]),
    "alert": (ALERTED, (), ["!battery"]),
    "lost": (LOST, (), ["LINK LOST"]),
    "fence": (HOVERING, ("m", "F", "i", "enter"), ["inside 1/4"]),
    "rally": (HOVERING, ("m", "F", "F"), ["Rally"]),
    "areas": (HOVERING, ("m", "F", "i"), ["Put into the fence"]),
    "item": (HOVERING, ("m", "down", "e"), ["Latitude"]),
    "insert": (HOVERING, ("m", "i"), ["Jump to an item"]),
    "differences": (HOVERING, ("m", "D", "equals_sign"), ["Differences"]),
    "file": (HOVERING, ("m", "w"), ["Save the plan"]),
    "bits": (TUNED, ("p", "down", "enter"), ["17 becomes 17"]),
    "value": (TUNED, ("p", "down", "down", "enter"), ["now, default"]),
    "failure": (HOVERING, ("F",), ["What shall fail"]),
    "failures": (HOVERING, ("F", "enter"), ["comes and goes"]),
    "speed": (HOVERING, ("c",), ["air or ground speed"]),
    "question": (HOVERING, ("d",), ["will fall"]),
    "go-to": (HOVERING, ("g",), ["Height above home"]),
    "chart": (FORWARD, ("C", "a"), ["Add to the chart"]),
    "palette": (FORWARD, ("ctrl+p",), ["Arm the vehicle"]),
    "quit": (HOVERING, ("q",), ["Quit anyway?"]),
}


async def shown(pilot, keys, words):
    """Press keys one after another, each when the screen stands still; then wait for words."""
    for key in keys:
        await settled(pilot)
        await pilot.press(key)
    await until(pilot, lambda: all(word in screen_text(pilot.app) for word in words))
    await settled(pilot)


@pytest.mark.long(after=1)
@pytest.mark.parametrize("size", SIZES, ids=lambda size: "x".join(map(str, size)))
@pytest.mark.parametrize("name", LOOKS)
def test_each_matches_its_snapshot(snap_compare, name, size):
    flight, keys, words = LOOKS[name]
    app = GroundStationApp(FakeFeed(flight))
    assert snap_compare(app, terminal_size=size, run_before=lambda pilot: shown(pilot, keys, words))


@pytest.mark.long(after=1)
@pytest.mark.parametrize("size", SIZES, ids=lambda size: "x".join(map(str, size)))
def test_a_recording_matches_its_snapshot(snap_compare, size):
    feed = ReplayFeed(read_tlog(DATA / "square-flight.tlog"), "square-flight.tlog", begin=2.05)
    feed.playing = False
    assert snap_compare(ReplayApp(feed), terminal_size=size, run_before=lambda pilot: shown(pilot, (), ["0:02.0"]))
