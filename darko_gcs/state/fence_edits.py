"""A fence and rally points as lists of items that are edited: areas put in, corners added, moved, taken away."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from darko_gcs.state.fence_shapes import CIRCLE_STATES, POLYGON_STATES, Place, polygon_spans
from darko_gcs.state.mission_items import shifted
from darko_gcs.state.values import Items
from protocol.dialect import mavlink
from protocol.frames import Geodetic, Vector
from protocol.plans import MissionItem
from protocol.ranges import MIN_CORNERS
from protocol.units import to_e7

STAY_IN, STAY_OUT = (
    mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION,
    mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION,
)
CIRCLE_IN, CIRCLE_OUT = mavlink.MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION, mavlink.MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION
RALLY = mavlink.MAV_CMD_NAV_RALLY_POINT
TURNED = {STAY_IN: STAY_OUT, STAY_OUT: STAY_IN, CIRCLE_IN: CIRCLE_OUT, CIRCLE_OUT: CIRCLE_IN}
FENCE_CHOICES = {
    "Polygon to stay inside": STAY_IN,
    "Polygon to stay outside": STAY_OUT,
    "Circle to stay inside": CIRCLE_IN,
    "Circle to stay outside": CIRCLE_OUT,
}
FENCE_RADIUS = 40.0  # of a new area to stay in, half as much to stay out [m]
RALLY_HEIGHT = 20.0  # of a first rally point above home [m]


def limit_item(command: int, place: Place, first: float, height: float, home: Geodetic, home_p: Vector) -> MissionItem:
    """A corner, circle or rally point.

    Args:
        command: MAV_CMD.
        place: North and east in the vehicle's local frame [m].
        first: Its first parameter.
        height: Above home [m], of a rally point.
        home: The vehicle's home.
        home_p: Home in the local frame, NED [m].

    Raises:
        LocalProtocolError: The place does not fit the wire.
    """
    is_rally = command == RALLY
    frame = mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT if is_rally else mavlink.MAV_FRAME_GLOBAL
    at_home = MissionItem(
        command=command,
        frame=frame,
        params=(first, 0.0, 0.0, 0.0),
        x=to_e7(home.lat_deg),
        y=to_e7(home.lon_deg),
        z=height if is_rally else 0.0,
    )
    return shifted(at_home, (place[0] - home_p[0], place[1] - home_p[1], 0.0), home, home_p)


def new_area(command: int, middle: Place, home: Geodetic, home_p: Vector) -> Items:
    """A square or a circle around a place, to be dragged into shape; see ``limit_item``."""
    reach = _reach(command)
    if command in CIRCLE_STATES:
        return (limit_item(command, middle, reach, 0.0, home, home_p),)
    corners = [(middle[0] + reach * n, middle[1] + reach * e) for n, e in ((1, 1), (1, -1), (-1, -1), (-1, 1))]
    return tuple(limit_item(command, corner, float(len(corners)), 0.0, home, home_p) for corner in corners)


def _reach(command: int) -> float:
    return FENCE_RADIUS if command in {STAY_IN, CIRCLE_IN} else FENCE_RADIUS / 2.0


def area_words(command: int, middle: Place, home_p: Vector) -> str:
    """A new area in words, and that it is only a beginning; see ``new_area``."""
    reach, is_circle = _reach(command), command in CIRCLE_STATES
    north, east = round(middle[0] - home_p[0]), round(middle[1] - home_p[1])
    shape = f"A circle of {reach:g} m radius" if is_circle else f"A square of {2.0 * reach:g} m"
    change = "e changes its place and radius" if is_circle else "move its corners on the map (Tab), e edits one"
    return f"{shape} around {north} m north, {east} m east of home, to begin with: {change}"


def span_of(fence: Items, row: int) -> range:
    """Numbers of the items of the area that an item belongs to."""
    return next((span for span in polygon_spans(fence) if row in span), range(row, row + 1))


def area_count(fence: Items) -> int:
    """Number of areas of a fence: polygons and circles."""
    return len({span_of(fence, row).start for row in range(len(fence)) if fence[row].command in TURNED})


def with_corner(fence: Items, row: int, corner: MissionItem) -> Items:
    """The fence with another corner after one of a polygon; the polygon's command and number of corners hold."""
    span = span_of(fence, row)
    corners = [*fence[span.start : row + 1], replace(corner, command=fence[row].command, frame=fence[row].frame)]
    return _with_polygon(fence, span, [*corners, *fence[row + 1 : span.stop]])


def without(fence: Items, row: int) -> Items:
    """The fence without a corner or a circle; a triangle goes as a whole."""
    span = span_of(fence, row)
    rest = [fence[seq] for seq in span if seq != row]
    return _with_polygon(fence, span, rest if len(rest) >= MIN_CORNERS else [])


def turned(fence: Items, row: int) -> Items:
    """The fence with the area of an item to stay out of instead of in, or the other way round."""
    span = span_of(fence, row)
    other = [replace(fence[seq], command=TURNED.get(fence[seq].command, fence[seq].command)) for seq in span]
    return (*fence[: span.start], *other, *fence[span.stop :])


def _with_polygon(fence: Items, span: range, corners: Sequence[MissionItem]) -> Items:
    count = float(len(corners))
    counted = (replace(corner, params=(count, *corner.params[1:])) for corner in corners)
    return (*fence[: span.start], *counted, *fence[span.stop :])


def limit_label(items: Items, row: int) -> str:
    """An item of a fence or a rally point in few words: "inside 2/4", "outside r 20 m"."""
    item = items[row]
    state = {"fence": "inside", "keep-out": "outside"}
    if item.command in POLYGON_STATES:
        span = span_of(items, row)
        return f"{state[POLYGON_STATES[item.command]]} {row - span.start + 1}/{len(span)}"
    if item.command in CIRCLE_STATES:
        return f"{state[CIRCLE_STATES[item.command]]} r {item.params[0]:.4g} m"
    return "rally point" if item.command == RALLY else "return point"
