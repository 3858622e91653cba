"""The end of a flight to a point that this operator commanded: it is told in the log, once.

A point is flown to from the moment on at which the vehicle accepts the command, until it is there or flies otherwise.
"""

from __future__ import annotations

import math

from darko_gcs.state.message_log import add_line
from darko_gcs.state.snapshot import Snapshot
from protocol.dialect import mavlink
from protocol.frames import Vector
from protocol.names import Mode

ARRIVAL_DISTANCE = 1.0  # from the point, at which the vehicle has arrived [m]
MAX_ARRIVAL_SPEED = 0.5  # at which it then hovers [m/s]


def asked_point(s: Snapshot, from_home: Vector) -> Snapshot:
    """The snapshot after the vehicle was sent to a point, down from home [m]; it has not answered yet."""
    return s._replace(operator=s.operator._replace(point_asked=from_home, point_flown_to=None))


def accepted_point(s: Snapshot, command: int) -> Snapshot:
    """The snapshot after the vehicle accepted a MAV_CMD: it flies to the point, or does something else."""
    if command == mavlink.MAV_CMD_DO_REPOSITION:
        point = s.operator.point_asked
        return s._replace(operator=s.operator._replace(point_asked=None, point_flown_to=point))
    if command in {mavlink.MAV_CMD_DO_CHANGE_SPEED, mavlink.MAV_CMD_REQUEST_MESSAGE}:
        return s
    return s._replace(operator=s.operator._replace(point_flown_to=None))


def arrived(s: Snapshot, now: float) -> Snapshot:
    """The snapshot with a line in the log as soon as the vehicle hovers at the point that it was sent to."""
    point, place, v = s.operator.point_flown_to, s.position.from_home, s.position.v
    if point is None or place is None or v is None or s.status.mode != Mode.HOLD.name:
        return s
    if not math.dist(point, place) <= ARRIVAL_DISTANCE or not math.hypot(*v) <= MAX_ARRIVAL_SPEED:
        return s
    north, east, up = (round(part, 1) + 0.0 for part in (point[0], point[1], -point[2]))
    words = f"Go to: arrived at {north:.1f} m north, {east:.1f} m east of home, {up:.1f} m above it"
    s = s._replace(operator=s.operator._replace(point_flown_to=None))
    return add_line(s, now, mavlink.MAV_SEVERITY_INFO, words)
