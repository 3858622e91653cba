"""The map panel, and a map whose numbered points are chosen and moved, by arrow keys or by the mouse."""

import math

import pytest

from darko_gcs.state.reduce import reduce
from darko_gcs.tui.map_content import PREDICTED_TIME, other_vehicles, predicted_path, waypoints
from darko_gcs.tui.map_panel import MapPanel
from darko_gcs.tui.widgets.flight_panel import FlightPanel
from protocol.dialect import mavlink
from protocol.frames import LocalFrame
from protocol.plans import MissionItem
from sitl.defaults import HOME
from tests.support.gcs.globe import home_at, no_fix, on_globe, origin_at
from tests.support.gcs.home import ORIGIN, home_position, snapshot_after
from tests.support.gcs.messages import arrived, position
from tests.support.gcs.screens import line_text
from tests.support.gcs.snapshots import HOVERING, snapshot_with


def at(north, east):
    """A waypoint in the vehicle's local frame [m]."""
    place = ORIGIN.to_geodetic((north, east, 0.0))
    return MissionItem(
        command=mavlink.MAV_CMD_NAV_WAYPOINT,
        frame=mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT,
        params=(0.0,) * 4,
        x=round(place.lat_deg * 1e7),
        y=round(place.lon_deg * 1e7),
        z=3.0,
    )


def reduced(s, *messages):
    """A snapshot after some messages more."""
    for message in messages:
        s = reduce(s, arrived(message), 1.0)
    return s


def find(lines, symbol):
    """Row and column of the lowest occurrence of a symbol."""
    texts = [line_text(line) for line in lines]
    return next((row, texts[row].index(symbol)) for row in reversed(range(len(texts))) if symbol in texts[row])


def test_distances_are_from_the_moved_home_and_the_map_stays_where_it_is():
    s = snapshot_after(position(1000, 8.0, 2.0), home_position(5.0, -1.0, 2.0))
    assert s.position.from_home == pytest.approx((3.0, 3.0, -1.0))
    assert s.position.track == ((8.0, 2.0),)
    ((_, north, east, _),) = waypoints(snapshot_with(s, plans={"mission": (at(20.0, 4.0),)}))
    assert (north, east) == pytest.approx((20.0, 4.0), abs=0.02)
    panel = MapPanel("Map", id="map")
    panel.scale = 1.0  # metres per row, and per two columns
    vehicle, home = (find(panel.draw(s, 40, 16), symbol) for symbol in ("↑", "H"))
    assert (home[0] - vehicle[0], home[1] - vehicle[1]) == (3, -6)
    numbers = str(FlightPanel("Flight", id="flight").draw(s, 40, 10))
    assert numbers.count("3.0") == 2
    assert "8.0" not in numbers


def on_screen(s, *, scale=1.0):
    """Rows of the map, each as text."""
    panel = MapPanel("Map", id="map")
    panel.scale = scale
    return [line_text(line) for line in panel.draw(s, 60, 24)]


def test_a_vehicle_that_tells_its_place_on_the_globe_alone_has_a_map():
    places = [on_globe(1000 + 100 * k, 10.0 + k, up=5.0, speed=1.0, heading=0) for k in range(8)]
    s = snapshot_after(no_fix(900), *places)
    assert "H" not in "".join(on_screen(s))  # nobody knows where
    assert s.position.p == pytest.approx((7.0, 0.0, -5.0), abs=0.02)
    assert len(s.position.track) == 8
    s = reduced(snapshot_with(s, plans={"mission": (at(20.0, 0.0),)}), home_at(8.0))
    assert s.position.from_home == pytest.approx((9.0, 0.0, -5.0), abs=0.02)
    ((_, north, east, _),) = waypoints(s)
    assert (north, east) == pytest.approx((10.0, 0.0), abs=0.02)
    lines = on_screen(s)
    home, vehicle, item = (next(row for row, text in enumerate(lines) if symbol in text[:50]) for symbol in "H↑0")
    assert (home - vehicle, vehicle - item) == (8, 3)  # rows of 1 m; between two of them, 8.6 rounds down
    shifted = reduced(s, no_fix(3000), on_globe(3100, 18.0))
    assert shifted.position.p[:2] == pytest.approx((8.0, 0.0), abs=0.02)


def test_a_target_in_the_vehicles_own_frame_is_on_the_map_once_that_frame_is_known():
    target = mavlink.MAVLink_position_target_local_ned_message(2000, 1, 0, 30.0, 0.0, -3.0, *[0.0] * 8)
    s = snapshot_after(on_globe(1000, 10.0), target)
    assert s.goal is None
    assert reduced(s, origin_at(0.0)).goal == pytest.approx((20.0, 0.0, -3.0), abs=0.02)


def test_a_local_position_ends_the_map_from_the_first_place():
    s = snapshot_after(on_globe(1000, 10.0), on_globe(1100, 12.0), position(1200, 1.0), on_globe(1300, 80.0))
    assert (s.position.start, s.position.p, s.position.track) == (None, (1.0, 0.0, -3.0), ((1.0, 0.0),))


def test_a_map_that_follows_stands_still_until_the_vehicle_is_well_off_its_middle():
    panel = MapPanel("Map", id="map")
    panel.scale = 1.0  # 40 m high
    s = snapshot_after(home_position(0.0, -10.0, 0.0), position(1000, 0.0))
    rows = []
    for k, north in enumerate((0.0, 4.0, 9.0, 11.0, 15.0, 20.0)):
        s = reduced(s, position(1100 + 100 * k, north))
        rows.append(find(panel.draw(s, 80, 40), "H")[0])
    assert rows == [20, 20, 20, 31, 31, 31]


def test_home_is_on_the_map_once_it_is_known():
    s = snapshot_after(position(1000, 5.0))
    assert "H" not in "".join(on_screen(s))
    assert "H" in "".join(on_screen(reduced(s, home_position(0.0, -3.0, 0.0))))


@pytest.mark.parametrize("turn", [-0.3, 0.0, 0.3])
def test_the_predicted_path_goes_on_with_the_circle_that_is_flown(turn):
    speed, s = 12.0, HOVERING

    def on_the_way(t):  # from the origin to the north, clockwise
        return (math.sin(turn * t) / turn, (1 - math.cos(turn * t)) / turn) if turn else (t, 0.0)

    track = tuple((speed * n, speed * e) for n, e in (on_the_way(k * 0.1) for k in range(31)))
    course = turn * 3.0
    s = snapshot_with(
        s,
        position={
            "p": (*track[-1], -20.0),
            "v": (speed * math.cos(course), speed * math.sin(course), 0.0),
            "track": track,
        },
    )
    path = predicted_path(s)
    assert path[0] == track[-1]
    expected = [speed * part for part in on_the_way(3.0 + PREDICTED_TIME)]
    assert path[-1] == pytest.approx(expected, abs=2.0)  # of 72 m
    slow = snapshot_with(s, position={"v": (1.0, 0.0, 0.0)})
    assert predicted_path(slow)[-1] == pytest.approx((track[-1][0] + PREDICTED_TIME, track[-1][1]))
    assert predicted_path(snapshot_with(s, position={"v": (0.1, 0.0, 0.0)})) == ()


def test_the_other_vehicles_near_it_are_on_the_map_with_their_ids():
    place = LocalFrame(HOME).to_geodetic
    here = snapshot_with(HOVERING, identity={"source": (1, 1)}, position={"geodetic": place((2.0, 1.0, -3.0))})
    near = snapshot_with(
        HOVERING,
        identity={"source": (7, 1)},
        position={"geodetic": place((20.0, 30.0, -3.0))},
        attitude={"heading": 1.6},
    )
    far = snapshot_with(HOVERING, identity={"source": (9, 1)}, position={"geodetic": place((9000.0, 0.0, -3.0))})
    ((system, north, east, heading),) = other_vehicles(
        here, (here, near, far, snapshot_with(near, position={"geodetic": None}))
    )
    assert (system, heading) == (7, 1.6)
    assert (north, east) == pytest.approx((20.0, 30.0), abs=0.01)
    panel = MapPanel("Map", id="map")
    panel.fleet = (here, near, far)
    assert "→7" in "\n".join(line_text(line) for line in panel.draw(here, 60, 20))
