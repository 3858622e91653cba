"""HOME_POSITION messages, and snapshots after them."""

import math

from darko_gcs.state.reduce import reduce
from darko_gcs.state.snapshot import EMPTY_SNAPSHOT
from protocol.dialect import mavlink
from protocol.frames import LocalFrame
from sitl.defaults import HOME
from tests.support.gcs.messages import arrived, heartbeat

ORIGIN = LocalFrame(HOME)
UNKNOWN_PLACE = (math.nan,) * 3


def home_position(north, east, up, *, local=None):
    """HOME_POSITION of a place in the local frame [m]; ``local`` overrides its local coordinates (NED)."""
    place = ORIGIN.to_geodetic((north, east, -up))
    x, y, z = local or (north, east, -up)
    return mavlink.MAVLink_home_position_message(
        latitude=round(place.lat_deg * 1e7),
        longitude=round(place.lon_deg * 1e7),
        altitude=round(place.alt * 1e3),
        x=x,
        y=y,
        z=z,
        q=[1, 0, 0, 0],
        approach_x=0,
        approach_y=0,
        approach_z=0,
    )


def snapshot_after(*messages):
    """The snapshot after a heartbeat and some messages."""
    s = EMPTY_SNAPSHOT
    for message in (heartbeat(), *messages):
        s = reduce(s, arrived(message), 0.0)
    return s
