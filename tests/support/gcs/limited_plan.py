"""A plan file with a fence and rally points around the volière."""

import json

from sitl.defaults import HOME
from tests.support.paths import DATA

NORTH, EAST = 1 / 111_195.0, 1 / 80_560.0  # one metre at the volière [deg]


def place(north, east):
    """Latitude and longitude [deg] of a point relative to home [m]."""
    return [HOME.lat_deg + north * NORTH, HOME.lon_deg + east * EAST]


SQUARE = {"inclusion": True, "polygon": [place(30, -30), place(30, 30), place(-30, 30), place(-30, -30)], "version": 1}
HOLE = {"circle": {"center": place(15, 15), "radius": 5.0}, "inclusion": False, "version": 1}


def write_limited_plan(folder, **parts):
    """Write the square mission with a fence of a polygon and a circle and two rally points, or with other parts."""
    limits = {
        "geoFence": {"version": 2, "polygons": [SQUARE], "circles": [HOLE]},
        "rallyPoints": {"version": 2, "points": [[*place(-5, -5), 10.0], [*place(5, -5), 12.0]]},
    }
    content = json.loads((DATA / "square.plan").read_text()) | limits | parts
    (folder / "limits.plan").write_text(json.dumps(content))
    return folder / "limits.plan"
