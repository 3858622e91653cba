"""The map stays where it is when home moves."""

from dataclasses import replace

import pytest

from darko_gcs.tui.maps.map_panel import MapPanel, waypoints
from darko_gcs.tui.widgets.flight_panel import FlightPanel
from protocol.dialect import mavlink
from protocol.plans import MissionItem
from tests.support.gcs.home import ORIGIN, home_position, snapshot_after
from tests.support.gcs.messages import position
from tests.support.gcs.screens import line_text


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


def find(lines, symbol):
    """Row and column of the lowest occurrence of a symbol."""
    texts = [line_text(line) for line in lines]
    return next((row, texts[row].index(symbol)) for row in reversed(range(len(texts))) if symbol in texts[row])


def test_distances_are_from_the_moved_home_and_the_map_stays_where_it_is():
    s = snapshot_after(position(1000, 8.0, 2.0), home_position(5.0, -1.0, 2.0))
    assert s.from_home == pytest.approx((3.0, 3.0, -1.0))
    assert s.track == ((8.0, 2.0),)
    ((_, north, east, _),) = waypoints(replace(s, mission=(at(20.0, 4.0),)))
    assert (north, east) == pytest.approx((20.0, 4.0), abs=0.02)
    panel = MapPanel("Map", id="map")
    panel.scale = 1.0  # metres per row, and per two columns
    vehicle, home = (find(panel.draw(s, 40, 16), symbol) for symbol in ("↑", "H"))
    assert (home[0] - vehicle[0], home[1] - vehicle[1]) == (3, -6)
    numbers = str(FlightPanel("Flight", id="flight").draw(s, 40, 10))
    assert numbers.count("3.0") == 2
    assert "8.0" not in numbers
