"""Heading of a hovering vehicle's belly, and so of its camera: to a region of interest, or to a set-point."""

from __future__ import annotations

import math

from protocol.names.modes import Mode
from sitl.autopilot.flight_state import FlightState
from sitl.control.reference import Reference

POINTED_MODES = frozenset({Mode.MISSION, Mode.HOLD})
OVERHEAD = 1.0  # nearer than this a region of interest has no bearing [m]


def pointed(reference: Reference, flight: FlightState) -> Reference:
    """The reference with the heading that is asked for; as it is in forward flight and where something lands."""
    view = flight.view
    hovers = flight.flying and not (view.forward or reference.forward or reference.steered or flight.landing)
    if not hovers or flight.mode not in POINTED_MODES:
        return reference
    turn = flight.mission.turn if flight.mode is Mode.MISSION and flight.mission is not None else flight.turn
    if turn is not None:
        return reference._replace(heading=turn.update(view))
    if flight.roi is None or math.dist(flight.roi[:2], view.p[:2]) < OVERHEAD:
        return reference
    return reference._replace(heading=math.atan2(flight.roi[1] - view.p[1], flight.roi[0] - view.p[0]))
