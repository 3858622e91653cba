"""Plans: mission, fence and rally points as items, and why one is refused.

A survey or a corridor scan carries its items (``TransectStyleComplexItem.Items``). Landing patterns and structure scans
carry none: QGroundControl makes them when it uploads, and so does this module, in the same order with the same numbers
(``appendMissionItems`` of LandingComplexItem, CameraSection and StructureScanComplexItem in its sources).
"""

from __future__ import annotations

import copy
import math
import struct
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from difflib import SequenceMatcher
from pathlib import Path
from typing import Any, NamedTuple

from protocol import units
from protocol.dialect import mavlink
from protocol.dialect.mavlink import MAV_MISSION_ERROR
from protocol.errors import LocalProtocolError, WireRangeError
from protocol.frames import Geodetic, LocalFrame
from protocol.names import is_global_frame
from protocol.ranges import MIN_CORNERS
from protocol.tools.files import JsonTable
from protocol.wire.message import Message

_WIRE = struct.Struct("<HB5f2i?")


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class MissionItem:
    """One item of a plan; NaN means "default" and stays NaN.

    Two items are equal if their fields have the same bits on the wire (float32, NaN equal to the same NaN). ``current``
    marks where a vehicle is, not what the item is, so it is not compared.

    Raises:
        LocalProtocolError: A field does not fit its type on the wire.
    """

    command: int  # MAV_CMD
    frame: int  # MAV_FRAME
    params: tuple[float, float, float, float]
    x: int  # latitude [degE7] in global frames, x [1e-4 m] in local ones
    y: int  # longitude [degE7] in global frames, y [1e-4 m] in local ones
    z: float  # altitude [m] in global frames (up), z [m] in local ones (down)
    autocontinue: bool = True
    current: bool = False

    def __post_init__(self) -> None:
        if len(self.params) != 4:
            raise LocalProtocolError(f"a mission item has 4 params, not {len(self.params)}")
        try:
            self.wire_image()
        except (struct.error, OverflowError, TypeError) as error:
            raise WireRangeError(f"mission item {self} does not fit the wire: {error}") from error

    def __eq__(self, other: object) -> bool:
        return self.wire_image() == other.wire_image() if isinstance(other, MissionItem) else NotImplemented

    def __hash__(self) -> int:
        return hash(self.wire_image())

    def wire_image(self) -> bytes:
        """The item's fields as bytes: float32 and the integers of the wire."""
        return _WIRE.pack(self.command, self.frame, *self.params, self.z, self.x, self.y, bool(self.autocontinue))

    def to_message(
        self, seq: int, target_system: int, target_component: int, *, current: bool | None = None, kind: int = 0
    ) -> Message:
        """MISSION_ITEM_INT number ``seq`` of a plan; ``kind`` is its MAV_MISSION_TYPE."""
        is_current = self.current if current is None else current
        param1, param2, param3, param4 = self.params
        return mavlink.MAVLink_mission_item_int_message(
            target_system=target_system,
            target_component=target_component,
            seq=seq,
            frame=self.frame,
            command=self.command,
            current=int(is_current),
            autocontinue=int(self.autocontinue),
            param1=param1,
            param2=param2,
            param3=param3,
            param4=param4,
            x=self.x,
            y=self.y,
            z=self.z,
            mission_type=kind,
        )

    @classmethod
    def from_message(cls, message: Message) -> MissionItem:
        """The item in a MISSION_ITEM_INT, or in the older MISSION_ITEM with its position in floats.

        Raises:
            LocalProtocolError: The floats of a MISSION_ITEM are not a position; the message names the parameter.
        """
        x, y = message.x, message.y
        if message.get_type() == "MISSION_ITEM":
            x, y = (_to_wire(message.frame, number, value) for number, value in ((5, x), (6, y)))
        return cls(
            command=message.command,
            frame=message.frame,
            params=(message.param1, message.param2, message.param3, message.param4),
            x=x,
            y=y,
            z=message.z,
            autocontinue=bool(message.autocontinue),
            current=bool(message.current),
        )


def _to_wire(frame: int, number: int, value: float) -> int:
    """A position's parameter of a MISSION_ITEM as a MISSION_ITEM_INT has it; NaN leaves it open."""
    if math.isnan(value):
        return units.UNKNOWN_INT32
    try:
        return units.to_e7(value) if is_global_frame(frame) else units.local_e4(value)
    except LocalProtocolError:
        raise LocalProtocolError(f"param{number} is {value:g}, which is no position") from None


Level = tuple[float, float]  # north and east [m]
_TRANSECTS, _ITEMS = "TransectStyleComplexItem", "Items"
_NO_PLACE = mavlink.MAV_FRAME_MISSION
_MAX_LAYERS = 100  # of a structure scan
_PARALLEL = 1e-9  # of the cross product of two edges, to the product of their lengths


@dataclass(frozen=True, slots=True)
class ComplexItem:
    """A complex item of a file, unchanged, and the mission items that it stands for."""

    entry: dict[str, Any]
    items: tuple[MissionItem, ...]


def simple_entries(entry: JsonTable) -> list[JsonTable]:
    """The simple items that a complex item stands for, as objects of a plan file.

    Raises:
        FileError: It carries no items, and is none of which they are known.
    """
    kind = str(entry.values.get("complexItemType"))[:40]
    if _ITEMS in entry.table(_TRANSECTS, {}).values:
        table = entry.table(_TRANSECTS)
        rows = [table.entry(_ITEMS, index) for index in range(len(table.rows(_ITEMS)))]
    elif kind in _MAKERS:
        rows = [entry.made(values) for values in _MAKERS[kind](entry)]
    else:
        raise entry.error("complexItemType", f"{kind!r} carries no items: save the plan by QGroundControl once more")
    if not rows:
        raise entry.error(f"{_TRANSECTS}.{_ITEMS}", f"{kind!r} carries no items")
    return rows


def places(complex_items: Sequence[ComplexItem], items: Sequence[MissionItem]) -> dict[int, ComplexItem]:
    """The complex items that a mission still holds whole, by the number of the first item of each.

    The items of one that was edited are simple items from then on.
    """
    found: dict[int, ComplexItem] = {}
    left, seq = list(complex_items), 0
    while seq < len(items):
        whole = next((part for part in left if tuple(items[seq : seq + len(part.items)]) == part.items), None)
        if whole is not None:
            left.remove(whole)
            found[seq] = whole
        seq += 1 if whole is None else len(whole.items)
    return found


def renumbered(part: ComplexItem, jump_ids: Sequence[int]) -> dict[str, Any]:
    """The complex item as an object of a plan file, with other ``doJumpId`` in the items that it carries."""
    if _ITEMS not in part.entry.get(_TRANSECTS, {}):
        return part.entry
    entry = copy.deepcopy(part.entry)
    for row, number in zip(entry[_TRANSECTS][_ITEMS], jump_ids, strict=True):
        row["doJumpId"] = number
    return entry


def _simple(command: int, frame: int, *params: float | None) -> dict[str, Any]:
    values = [*params, *[0.0] * (7 - len(params))]
    return {"type": "SimpleItem", "command": command, "frame": frame, "params": values, "autoContinue": True}


def _landing(entry: JsonTable, command: int, yaw: float | None) -> Iterator[dict[str, Any]]:
    """A landing pattern: the start of the landing, the end of the survey, the way down, the landing."""
    yield _simple(mavlink.MAV_CMD_DO_LAND_START, _NO_PLACE)
    if entry.flag("useDoChangeSpeed", default=False):
        speed = entry.number("finalApproachSpeed", math.nan)
        yield _simple(mavlink.MAV_CMD_DO_CHANGE_SPEED, _NO_PLACE, mavlink.SPEED_TYPE_AIRSPEED, speed, -1.0)
    if entry.flag("stopTakingPhotos", default=False):
        yield _simple(mavlink.MAV_CMD_DO_SET_CAM_TRIGG_DIST, _NO_PLACE)
        yield _simple(mavlink.MAV_CMD_IMAGE_STOP_CAPTURE, _NO_PLACE, 0.0, *[None] * 6)
    if entry.flag("stopVideoPhotos", default=False):
        yield _simple(mavlink.MAV_CMD_VIDEO_STOP_CAPTURE, _NO_PLACE, 0.0, *[None] * 6)
    frame = mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT if _is_relative(entry) else mavlink.MAV_FRAME_GLOBAL
    old = "loiterCoordinate" in entry.values
    approach = entry.numbers("loiterCoordinate" if old else "landingApproachCoordinate", 3)
    if entry.flag("useLoiterToAlt", default=True):
        radius = entry.number("loiterRadius", math.nan)
        clockwise = entry.flag("loiterClockwise", default=True)
        params = (1.0, radius if clockwise else -radius, 0.0, 1.0)  # leave the circle towards the landing, by a tangent
        yield _simple(mavlink.MAV_CMD_NAV_LOITER_TO_ALT, frame, *params, *approach)
    else:
        yield _simple(mavlink.MAV_CMD_NAV_WAYPOINT, frame, 0.0, 0.0, 0.0, None, *approach)
    yield _simple(command, frame, 0.0, 0.0, 0.0, yaw, *entry.numbers("landCoordinate", 3))


def _is_relative(entry: JsonTable) -> bool:
    """Whether altitudes are above home; the first version told it of each place, and is read as QGroundControl does."""
    if "altitudesAreRelative" in entry.values:
        return entry.flag("altitudesAreRelative", default=True)
    return entry.flag("loiterAltitudeRelative", default=True) or entry.flag("landAltitudeRelative", default=True)


def _structure_scan(entry: JsonTable) -> Iterator[dict[str, Any]]:
    """A structure scan: round the structure at a distance, layer by layer, with the camera across the way."""
    camera = entry.table("CameraCalc")
    side, height = camera.number("AdjustedFootprintSide", math.nan), camera.number("AdjustedFootprintFrontal", math.nan)
    structure = _corners(entry)
    if len(set(structure)) < MIN_CORNERS:
        raise entry.error("polygon", "corners at one place are too few for a polygon")
    corners = _offset(structure, camera.number("DistanceToSurface", math.nan))
    from_top, layers = entry.flag("StartFromTop", default=False), entry.number("Layers", 1.0)
    if not 1.0 <= layers <= _MAX_LAYERS:
        raise entry.error("Layers", f"{layers:g} is not a number of layers from 1 to {_MAX_LAYERS}")
    entrance = (corners[0].lat_deg, corners[0].lon_deg, entry.number("EntranceAltitude", math.nan))
    relative = mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT
    yield _simple(mavlink.MAV_CMD_NAV_WAYPOINT, relative, 0.0, 0.0, 0.0, None, *entrance)
    pitch = round(entry.number("GimbalPitch", 0.0))  # whole, as x of an item without a place must be
    yield _simple(mavlink.MAV_CMD_DO_SET_ROI_WPNEXT_OFFSET, _NO_PLACE, 0.0, 0.0, 0.0, 0.0, pitch, 0.0, 90.0)
    start, up = ("StructureHeight", -height) if from_top else ("ScanBottomAlt", height)
    for layer in range(int(layers)):
        alt = entry.number(start, math.nan) + (layer + 0.5) * up
        for index, corner in enumerate((*corners, corners[0])):
            place = (corner.lat_deg, corner.lon_deg, alt)
            yield _simple(mavlink.MAV_CMD_NAV_WAYPOINT, relative, 0.0, 0.0, 0.0, None, *place)
            if index == 0:
                yield _simple(mavlink.MAV_CMD_DO_SET_CAM_TRIGG_DIST, _NO_PLACE, side, 0.0, 1.0)
        yield _simple(mavlink.MAV_CMD_DO_SET_CAM_TRIGG_DIST, _NO_PLACE)
    yield _simple(mavlink.MAV_CMD_DO_SET_ROI_NONE, _NO_PLACE)
    yield _simple(mavlink.MAV_CMD_NAV_WAYPOINT, relative, 0.0, 0.0, 0.0, None, *entrance)


def _corners(entry: JsonTable) -> list[Geodetic]:
    rows = entry.rows("polygon")
    if len(rows) < MIN_CORNERS:
        raise entry.error("polygon", f"{len(rows)} corners are too few for a polygon")
    corners = []
    for index in range(len(rows)):
        lat, lon = entry.made({f"polygon[{index}]": rows[index]}).numbers(f"polygon[{index}]", 2)
        if not (abs(lat) <= 90.0 and abs(lon) <= 180.0):
            raise entry.error(f"polygon[{index}]", f"{lat:g}, {lon:g} is not on the globe")
        corners.append(Geodetic(lat, lon, 0.0))
    return corners


def _offset(corners: Sequence[Geodetic], distance: float) -> list[Geodetic]:
    """A polygon whose edges lie outside of those of another by a distance [m]."""
    frame = LocalFrame(corners[0])
    flat = [frame.to_ned(corner)[:2] for corner in corners]
    area = sum(a[0] * b[1] - b[0] * a[1] for a, b in zip(flat, (*flat[1:], flat[0]), strict=True))
    out = -distance if area > 0.0 else distance  # clockwise on the map: outside is on the left
    edges = [(a, b) for a, b in zip(flat, (*flat[1:], flat[0]), strict=True) if a != b]
    moved = [_aside(a, b, out) for a, b in edges]
    return [
        frame.to_geodetic((*_meeting(before, after), 0.0))
        for before, after in zip((moved[-1], *moved[:-1]), moved, strict=True)
    ]


def _aside(a: Level, b: Level, by: float) -> tuple[Level, Level]:
    """An edge so far to its right [m]."""
    length = math.dist(a, b)
    north, east = -by * (b[1] - a[1]) / length, by * (b[0] - a[0]) / length
    return (a[0] + north, a[1] + east), (b[0] + north, b[1] + east)


def _meeting(first: tuple[Level, Level], second: tuple[Level, Level]) -> Level:
    """Intersection of the lines of two edges; the beginning of the second if they are parallel."""
    (a, b), (c, d) = first, second
    u, v = (b[0] - a[0], b[1] - a[1]), (d[0] - c[0], d[1] - c[1])
    cross = u[0] * v[1] - u[1] * v[0]
    if abs(cross) < _PARALLEL * math.hypot(*u) * math.hypot(*v):
        return c
    along = ((c[0] - a[0]) * v[1] - (c[1] - a[1]) * v[0]) / cross
    return (a[0] + along * u[0], a[1] + along * u[1])


_MAKERS: Mapping[str, Callable[[JsonTable], Iterator[dict[str, Any]]]] = {
    "fwLandingPattern": lambda entry: _landing(entry, mavlink.MAV_CMD_NAV_LAND, 0.0),
    "vtolLandingPattern": lambda entry: _landing(entry, mavlink.MAV_CMD_NAV_VTOL_LAND, None),
    "StructureScan": _structure_scan,
}


@dataclass(frozen=True, kw_only=True)
class Plan:
    """Mission items and the other content of a plan file.

    Item k of ``items`` is mission item k on the wire; the home position is not one of them. Content that is not
    interpreted is stored unchanged, so that saving loses nothing.
    """

    items: tuple[MissionItem, ...] = ()
    planned_home: Geodetic | None = None
    cruise_speed: float = 15.0  # [m/s]
    hover_speed: float = 3.0  # [m/s]
    geo_fence: dict[str, Any] = field(default_factory=lambda: {"circles": [], "polygons": [], "version": 2})
    rally_points: dict[str, Any] = field(default_factory=lambda: {"points": [], "version": 2})
    file_keys: dict[str, Any] = field(default_factory=lambda: {"groundStation": "DarkO"})
    mission_keys: dict[str, Any] = field(
        default_factory=lambda: {
            "firmwareType": mavlink.MAV_AUTOPILOT_PX4,
            "vehicleType": mavlink.MAV_TYPE_VTOL_DUOROTOR,
        }
    )
    item_keys: tuple[dict[str, Any], ...] = ()  # one table for each item, or () if all are empty
    complex_items: tuple[ComplexItem, ...] = ()  # those that the items came from, in their order
    source: Path | None = field(default=None, compare=False)  # the file it was loaded from

    def with_items(self, items: Sequence[MissionItem]) -> Plan:
        """The plan with other mission items. Those that are as before keep what a file tells of them aside.

        Their ``doJumpId`` is not kept: items are numbered anew when the plan is saved.
        """
        keys: list[dict[str, Any]] = [{} for _ in items]
        if self.item_keys:
            for old, new, count in SequenceMatcher(None, self.items, items, autojunk=False).get_matching_blocks():
                keys[new : new + count] = [
                    {key: value for key, value in others.items() if key != "doJumpId"}
                    for others in self.item_keys[old : old + count]
                ]
        return replace(self, items=tuple(items), item_keys=tuple(keys) if any(keys) else ())


class Refusal(NamedTuple):
    """A request that cannot be carried out, in a sentence with the reason."""

    text: str
    result: int = MAV_MISSION_ERROR  # MAV_MISSION_RESULT, of a plan


Validate = Callable[[Sequence[MissionItem]], Refusal | None]
"""Checks a complete new plan; None accepts it."""
