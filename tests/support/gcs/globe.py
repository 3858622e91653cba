"""Messages of a vehicle that tells its place on the globe, and not in a local frame."""

from protocol import units
from protocol.dialect import mavlink
from tests.support.gcs.home import ORIGIN

GROUND = round(1000 * ORIGIN.origin.alt)  # above mean sea level [mm]
UNKNOWN_HEADING = 0xFFFF


def e7(north, east=0.0):
    """Latitude and longitude of a place [m] on the wire."""
    place = ORIGIN.to_geodetic((north, east, 0.0))
    return units.to_e7(place.lat_deg), units.to_e7(place.lon_deg)


def on_globe(ms, north, *, east=0.0, up=0.0, speed=0.0, heading=UNKNOWN_HEADING):
    """The vehicle at a place [m], flying northwards [m/s]."""
    height, (lat, lon) = round(1000 * up), e7(north, east)
    fields = (height + GROUND, height, round(100 * speed), 0, 0, heading)
    return mavlink.MAVLink_global_position_int_message(ms, lat, lon, *fields)


def no_fix(ms):
    """The vehicle does not know its place."""
    return mavlink.MAVLink_global_position_int_message(ms, 0, 0, 2000, 500, 0, 0, 0, UNKNOWN_HEADING)


def home_at(north, x=0.0):
    """Home at a place [m]; ``x`` is what it says of it in its local frame."""
    lat, lon = e7(north)
    return mavlink.MAVLink_home_position_message(lat, lon, GROUND, x, 0, 0, [1, 0, 0, 0], 0, 0, 0)


def origin_at(north):
    """Zero of the local frame at a place [m]."""
    lat, lon = e7(north)
    return mavlink.MAVLink_gps_global_origin_message(lat, lon, GROUND)
