"""The net that the vehicle flies under: told by it, drawn on every map, in numbers in the palette and before arming."""

import math
from types import SimpleNamespace

import pytest

from darko_gcs.state.arena import net_corners, net_words
from darko_gcs.state.reduce import after_restart, reduce
from darko_gcs.tui.app import GroundStationApp
from darko_gcs.tui.map_content import EditedMission, LoadedFlightPlan, flight_content
from protocol.dialect import mavlink
from sitl.autopilot.world import ARENAS
from sitl.mavlink.telemetry.navigation import arena
from sitl.mavlink.telemetry.telemetry_service import BUILDERS, STREAMS
from tests.support.gcs.messages import arrived
from tests.support.gcs.screens import FakeFeed, screen_text, until
from tests.support.gcs.snapshots import HOVERING, snapshot_with

VOLIERE = ARENAS["voliere"]


def told(found=VOLIERE, s=HOVERING, **changes):
    """The snapshot after the message of a vehicle in an arena."""
    message = arena(SimpleNamespace(arena=found))
    for name, value in changes.items():
        setattr(message, name, value)
    return reduce(s, arrived(message), 1.0)


def test_a_vehicle_under_a_net_tells_it_and_one_without_does_not():
    assert BUILDERS[mavlink.MAVLINK_MSG_ID_DARKO_ARENA] is arena
    assert [stream.rate for stream in STREAMS if stream.build is arena] == [0.2]
    assert arena(SimpleNamespace(arena=ARENAS["open"])) == []
    s = told()
    assert (s.arena.name, s.arena.length, s.arena.width, s.arena.height) == ("voliere", 10.0, 10.0, 7.0)
    assert after_restart(s, 2.0).arena == s.arena


@pytest.mark.parametrize("course", [0.0, 0.4, -1.2])
def test_its_corners_are_where_the_vehicle_has_them(course):
    turned = VOLIERE._replace(north=2.0, west=-3.0, course=course, half_length=6.0)
    expected = [turned.outside(a, b) for a, b in ((6.0, 5.0), (6.0, -5.0), (-6.0, -5.0), (-6.0, 5.0))]
    for corner, (north, west, _) in zip(net_corners(told(turned)), expected, strict=True):
        assert corner == pytest.approx((north, -west), abs=1e-5)


def test_its_words_have_the_limits_by_which_the_vehicle_refuses():
    words = net_words(told())
    assert words == (
        "voliere: net 10 x 10 m, 7 m high. Targets: 3.8 m north to 3.8 m south, 3.8 m east to 3.8 m west, 0 to 5.8 m up"
    )
    assert "(limit 3.8 m)" in VOLIERE.refuse((0.0, -4.6, 1.0))
    assert VOLIERE.refuse((3.79, 3.79, 5.79)) is None
    moved = net_words(told(VOLIERE._replace(north=1.0)))
    assert "4.8 m north to 2.8 m south" in moved
    assert "3.8 m from its centre along 30 deg" in net_words(told(VOLIERE._replace(course=-math.radians(30.0))))
    assert net_words(HOVERING) == ""


@pytest.mark.parametrize("changes", [{"length": 0.0}, {"height": -1.0}, {"width": math.nan}, {"x": math.inf}])
def test_a_net_that_cannot_be_is_not_taken(changes):
    assert told(**changes).arena is None


def test_every_map_has_the_net_like_a_fence_with_its_height():
    s, edited = told(), EditedMission()
    for content in (flight_content(s), edited.content(s, 0), LoadedFlightPlan().content(s, 0)):
        assert (net_corners(s), "fence") in content.areas
        assert ("net 7 m high", net_corners(s)[-1], "fence") in content.labels
    assert not edited.is_empty(s)
    assert edited.is_empty(HOVERING)
    assert not flight_content(HOVERING).areas


@pytest.mark.parametrize("size", [(80, 24), (120, 40), (200, 60)])
async def test_it_is_seen_at_every_size_and_the_palette_finds_it(size):
    s = told(
        s=snapshot_with(HOVERING, position={"p": (0.0, 0.0, -2.0), "track": ()}, plans={"mission": (), "fence": ()})
    )
    app = GroundStationApp(FakeFeed(s))
    async with app.run_test(size=size) as pilot:
        await until(pilot, lambda: "net 7 m" in screen_text(app))
        entries = app.palette_entries(app.screen)
        for word in ("arena", "net", "walls", "wall"):
            best = max(entries, key=lambda entry, word=word: entry.score(word))
            assert best.help == net_words(s), word
        await pilot.press("i")
        await until(pilot, lambda: "Targets: 3.8 m north to" in screen_text(app))
