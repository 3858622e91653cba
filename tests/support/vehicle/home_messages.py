"""Places in messages, and requests for another home, as a ground station sends them."""

import math

from protocol.dialect import mavlink
from protocol.plans.plan import MissionItem
from tests.support.vehicle.fake_station import FRAME

NAN = math.nan
SET_HOME = mavlink.MAV_CMD_DO_SET_HOME
SEA, RELATIVE = mavlink.MAV_FRAME_GLOBAL, mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT


def e7(north, east, up=0.0, frame=FRAME):
    """Latitude and longitude [1e-7 deg] and altitude [m] of a place in a local frame [m]."""
    place = frame.to_geodetic((north, east, -up))
    return round(place.lat_deg * 1e7), round(place.lon_deg * 1e7), place.alt


def global_waypoint(north, east, height):
    """A waypoint whose height is above home [m]."""
    lat, lon, _ = e7(north, east)
    params = (0.0, 0.0, 0.0, NAN)
    return MissionItem(command=mavlink.MAV_CMD_NAV_WAYPOINT, frame=RELATIVE, params=params, x=lat, y=lon, z=height)


def set_home(station, north, east, altitude, *, frame=SEA, here=0.0, command=SET_HOME):
    """Request home at a place; the result."""
    x, y, _ = e7(north, east)
    station.send(mavlink.MAVLink_command_int_message(1, 1, frame, command, 0, 0, here, NAN, NAN, NAN, x, y, altitude))
    return station.last("COMMAND_ACK").result


def set_origin(station, place):
    """Ask for the origin of the local frame at a place."""
    lat, lon, alt = round(place.lat_deg * 1e7), round(place.lon_deg * 1e7), round(place.alt * 1e3)
    station.send(mavlink.MAVLink_set_gps_global_origin_message(1, lat, lon, alt))


def request_message(station, message_id):
    """A message, as it is sent on request."""
    station.command(mavlink.MAV_CMD_REQUEST_MESSAGE, message_id)
    return station.heard[-1]
