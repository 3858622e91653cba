"""Home that moves, as the ground station shows and moves it."""

from dataclasses import replace

import pytest

from darko_gcs.app import GroundStation
from darko_gcs.screens.dialogs import ConfirmScreen
from darko_gcs.snapshot import EMPTY
from darko_gcs.store import reduce
from darko_gcs.widgets.map import MapPanel, waypoints
from darko_gcs.widgets.numbers import FlightPanel
from protocol.dialect import mavlink
from protocol.frames import Geodetic, LocalFrame
from protocol.plans.mission import MissionItem
from tests.darko_gcs.screens import FLYING, FakeFeed, screen_text, until
from tests.support.messages import heartbeat, position, told
from tests.support.station_pair import Pair

ORIGIN = LocalFrame(Geodetic(43.5648, 1.4811, 150.0))


def home(north, east, up, *, local=None):
    """HOME_POSITION of a place in the local frame."""
    place = ORIGIN.to_geodetic((north, east, -up))
    lat, lon, alt = round(place.lat_deg * 1e7), round(place.lon_deg * 1e7), round(place.alt * 1e3)
    return mavlink.MAVLink_home_position_message(
        lat, lon, alt, *(local or (north, east, -up)), [1, 0, 0, 0], 0, 0, 0, 0
    )


def seen(*messages):
    s = EMPTY
    for message in (heartbeat(), *messages):
        s = reduce(s, told(message), 0.0)
    return s


def test_distances_are_shown_from_home_and_the_map_stays_where_it_is():
    s = seen(position(1000, 8.0, 2.0), home(5.0, -1.0, 2.0))
    assert s.from_home == pytest.approx((3.0, 3.0, -1.0))
    assert s.track == ((8.0, 2.0),)
    place = ORIGIN.to_geodetic((20.0, 4.0, 0.0))
    item = MissionItem(16, 3, (0.0,) * 4, round(place.lat_deg * 1e7), round(place.lon_deg * 1e7), 3.0)
    ((_, north, east, _),) = waypoints(replace(s, mission=(item,)))
    assert (north, east) == pytest.approx((20.0, 4.0), abs=0.02)
    panel = MapPanel("Map", id="map")
    panel.scale = 1.0  # metres to a line, and to two columns
    vehicle, mark = (_find(panel.draw(s, 40, 16), symbol) for symbol in ("↑", "H"))
    assert (mark[0] - vehicle[0], mark[1] - vehicle[1]) == (3, -6)
    numbers = str(FlightPanel("Flight", id="flight").draw(s, 40, 10))
    assert numbers.count("3.0") == 2
    assert "8.0" not in numbers


def _find(lines, symbol):
    """Line and column of the last line that shows it."""
    texts = ["".join(text for text, _ in line) for line in lines]
    return next((row, texts[row].index(symbol)) for row in reversed(range(len(texts))) if symbol in texts[row])


def test_a_home_without_a_place_in_the_local_frame_is_taken_to_be_its_origin():
    s = seen(position(1000, 8.0), home(0.0, 0.0, 0.0, local=(float("nan"),) * 3))
    assert s.home is not None
    assert s.from_home == (8.0, 0.0, -3.0)


async def test_moving_home_asks_first_and_says_how_high():
    feed = FakeFeed(FLYING)
    app = GroundStation(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("H")
        await until(pilot, lambda: isinstance(app.screen, ConfirmScreen) and "3.0 m up" in screen_text(app))
        await pilot.press("n")
        assert feed.station.asked == []
        await pilot.press("H", "y")
        await until(pilot, lambda: feed.station.asked == [("set_home",)])


async def test_going_somewhere_is_asked_about_the_moved_home():
    feed = FakeFeed(replace(FLYING, home_p=(1.0, -1.0, -1.0)))
    app = GroundStation(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("g")
        await pilot.press("enter")
        await until(pilot, lambda: feed.station.asked == [("go_to", 1.0, 2.0, 2.0)])


def test_home_is_moved_here_and_points_are_about_it(tmp_path):
    pair = Pair(tmp_path)
    pair.run(2.5)
    pair.station.arm(pair.now)
    pair.run(0.5)
    pair.station.take_off(4.0, pair.now)
    pair.run(9.0)
    pair.station.go_to(3.0, -2.0, 5.0, pair.now)
    pair.run(9.0)
    pair.station.set_home(pair.now)
    pair.run(0.5)
    assert pair.snapshot.from_home == pytest.approx((0.0, 0.0, 0.0), abs=0.2)
    pair.station.go_to(0.0, 2.0, -2.0, pair.now)
    pair.run(9.0)
    assert pair.snapshot.p == pytest.approx((3.0, 0.0, -3.0), abs=0.3)
