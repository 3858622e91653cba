"""Mission items as the operator edits them: parameters named by command, text fields, and other frames.

They come with plans of other stations, and are shown and kept; the list of items to insert does not have them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from darko_gcs.state.number_ranges import COMMAND_NUMBER, GLOBE_PLACE, LOCAL_PLACE, PARAMETER, number_problem
from darko_gcs.state.text import command_name, command_words
from protocol.dialect import mavlink
from protocol.dialect import mavlink as m
from protocol.frames import Geodetic, LocalFrame, Vector
from protocol.names import ABSOLUTE_ALTITUDE_FRAMES, RELATIVE_ALTITUDE_FRAMES, is_global_frame
from protocol.plans import MissionItem
from protocol.ranges import MIN_AIRSPEED, ValueRange
from protocol.units import UNKNOWN_INT32, from_e7, from_local_e4, local_e4, to_e7

LOCAL_FRAMES = frozenset({mavlink.MAV_FRAME_LOCAL_NED, mavlink.MAV_FRAME_LOCAL_ENU})
FAMILIES = (ABSOLUTE_ALTITUDE_FRAMES, RELATIVE_ALTITUDE_FRAMES)  # frames in one of them have the same numbers


def in_frame(item: MissionItem, frame: int, home: Geodetic | None, home_p: Vector = (0.0, 0.0, 0.0)) -> MissionItem:
    """The item at the same place, with its numbers in another frame.

    Args:
        item: The item before.
        frame: MAV_FRAME.
        home: None while it is not known.
        home_p: Home in the local frame, NED [m].

    Raises:
        ValueError: The numbers cannot be converted; the message says why.
        LocalProtocolError: The place does not fit the wire.
    """
    if frame == item.frame or any({frame, item.frame} <= family for family in FAMILIES):
        return replace(item, frame=frame)
    if home is None:
        raise ValueError("Frame: home is not known yet, and without it the numbers cannot be converted")
    if {frame, item.frame} <= ABSOLUTE_ALTITUDE_FRAMES | RELATIVE_ALTITUDE_FRAMES:
        return replace(item, frame=frame, z=item.z + (home.alt if frame in ABSOLUTE_ALTITUDE_FRAMES else -home.alt))
    if UNKNOWN_INT32 in {item.x, item.y} or math.isnan(item.z):
        raise ValueError("Frame: the item leaves its place to the vehicle: there is nothing to convert")
    return _placed(item, frame, _place(item, home, home_p), home, home_p)


def place_of(item: MissionItem, home: Geodetic, home_p: Vector = (0.0, 0.0, 0.0)) -> Vector | None:
    """Position of an item, NED in the vehicle's local frame [m]; None if it has no place of its own.

    Args:
        item: The item.
        home: The vehicle's home.
        home_p: Home in the local frame, NED [m].
    """
    is_open = UNKNOWN_INT32 in {item.x, item.y} or math.isnan(item.z)
    is_unset = is_global_frame(item.frame) and item.x == item.y == 0
    known = ABSOLUTE_ALTITUDE_FRAMES | RELATIVE_ALTITUDE_FRAMES | LOCAL_FRAMES
    if item.frame not in known or is_open or is_unset:
        return None
    north, east, down = LocalFrame(home).to_ned(_place(item, home, home_p))
    return north + home_p[0], east + home_p[1], down + home_p[2]


def shifted(item: MissionItem, by: Vector, home: Geodetic, home_p: Vector = (0.0, 0.0, 0.0)) -> MissionItem:
    """The item so far away from where it was, in its own frame.

    Args:
        item: The item.
        by: North, east and up [m].
        home: The vehicle's home.
        home_p: Home in the local frame, NED [m].

    Raises:
        ValueError: The item has no place of its own.
        LocalProtocolError: The new place does not fit the wire.
    """
    if place_of(item, home, home_p) is None:
        raise ValueError("The item has no place of its own to be moved from")
    north, east, down = LocalFrame(home).to_ned(_place(item, home, home_p))
    place = LocalFrame(home).to_geodetic((north + by[0], east + by[1], down - by[2]))
    new = _placed(item, item.frame, place, home, home_p)
    return new if by[2] else replace(new, z=item.z)


def _place(item: MissionItem, home: Geodetic, home_p: Vector) -> Geodetic:
    if item.frame in ABSOLUTE_ALTITUDE_FRAMES | RELATIVE_ALTITUDE_FRAMES:
        above = home.alt if item.frame in RELATIVE_ALTITUDE_FRAMES else 0.0
        return Geodetic(from_e7(item.x), from_e7(item.y), item.z + above)
    if item.frame not in LOCAL_FRAMES:
        raise ValueError(f"Frame: numbers of MAV_FRAME {item.frame} cannot be converted")
    x, y = from_local_e4(item.x), from_local_e4(item.y)
    north, east, down = (x, y, item.z) if item.frame == mavlink.MAV_FRAME_LOCAL_NED else (y, x, -item.z)
    return LocalFrame(home).to_geodetic((north - home_p[0], east - home_p[1], down - home_p[2]))


def _placed(item: MissionItem, frame: int, place: Geodetic, home: Geodetic, home_p: Vector) -> MissionItem:
    if frame in ABSOLUTE_ALTITUDE_FRAMES | RELATIVE_ALTITUDE_FRAMES:
        z = place.alt - (home.alt if frame in RELATIVE_ALTITUDE_FRAMES else 0.0)
        return replace(item, frame=frame, x=to_e7(place.lat_deg), y=to_e7(place.lon_deg), z=z)
    if frame not in LOCAL_FRAMES or is_global_frame(frame):
        raise ValueError(f"Frame: the numbers cannot be converted to MAV_FRAME {frame}")
    own = LocalFrame(home).to_ned(place)
    north, east, down = (part + offset for part, offset in zip(own, home_p, strict=True))
    if frame == mavlink.MAV_FRAME_LOCAL_NED:
        return replace(item, frame=frame, x=local_e4(north), y=local_e4(east), z=down)
    return replace(item, frame=frame, x=local_e4(east), y=local_e4(north), z=-down)


Params = tuple[float, float, float, float]


@dataclass(frozen=True, kw_only=True)
class MissionCommand:
    """A command that missions are made of. A parameter without a name is not used."""

    command: int  # MAV_CMD
    label: str
    params: tuple[str, str, str, str]  # names of param1 to param4
    defaults: Params
    has_place: bool = True


_UNUSED = ("",) * 4
_ZEROS: Params = (0.0,) * 4
_OPEN = math.nan


def _aside(
    command: int, label: str, params: tuple[str, str, str, str] = _UNUSED, defaults: Params = _ZEROS
) -> MissionCommand:
    """An item without a place."""
    return MissionCommand(command=command, label=label, params=params, defaults=defaults, has_place=False)


PAYLOAD_COMMANDS = (
    MissionCommand(
        command=m.MAV_CMD_NAV_VTOL_TAKEOFF, label="Take off", params=("", "", "", "Yaw [deg]"),
        defaults=(0.0, 0.0, 0.0, _OPEN),
    ),
    MissionCommand(
        command=m.MAV_CMD_NAV_VTOL_LAND, label="Land", params=("", "", "", "Yaw [deg]"),
        defaults=(0.0, 0.0, 0.0, _OPEN),
    ),
    MissionCommand(
        command=m.MAV_CMD_NAV_LOITER_TO_ALT, label="Circle to a height",
        params=("Leave towards the next (0, 1)", "Radius [m], - anticlockwise", "", "Exit by a tangent (0, 1)"),
        defaults=(1.0, 40.0, 0.0, 1.0),
    ),
    _aside(m.MAV_CMD_DO_LAND_START, "Landing begins"),
    _aside(m.MAV_CMD_CONDITION_DELAY, "Next items wait", ("Delay [s]", "", "", ""), (5.0, 0.0, 0.0, 0.0)),
    _aside(m.MAV_CMD_CONDITION_DISTANCE, "Next items wait", ("Distance [m]", "", "", ""), (10.0, 0.0, 0.0, 0.0)),
    _aside(
        m.MAV_CMD_CONDITION_YAW, "Turn",
        ("Angle [deg]", "Rate [deg/s]", "Way (0 shorter, 1 clockwise, -1)", "Relative (0, 1)"),
    ),
    MissionCommand(
        command=m.MAV_CMD_DO_SET_HOME, label="Move home", params=("Here (0, 1)", "", "", ""), defaults=_ZEROS
    ),
    _aside(m.MAV_CMD_DO_FENCE_ENABLE, "Fence", ("In force (0, 1)", "", "", ""), (1.0, 0.0, 0.0, 0.0)),
    MissionCommand(command=m.MAV_CMD_DO_SET_ROI_LOCATION, label="Look at a place", params=_UNUSED, defaults=_ZEROS),
    MissionCommand(
        command=m.MAV_CMD_DO_SET_ROI, label="Look at a place", params=("Mode (0 none, 1 along, 3 place)", "", "", ""),
        defaults=(3.0, 0.0, 0.0, 0.0),
    ),
    _aside(m.MAV_CMD_DO_SET_ROI_WPNEXT_OFFSET, "Look along the way"),
    _aside(m.MAV_CMD_DO_SET_ROI_NONE, "Look nowhere"),
    _aside(m.MAV_CMD_DO_MOUNT_CONFIGURE, "Configure mount", ("Mode", "", "", "")),
    _aside(m.MAV_CMD_DO_MOUNT_CONTROL, "Point mount", ("Pitch [deg]", "Roll [deg]", "Yaw [deg]", "")),
    _aside(
        m.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW, "Point gimbal",
        ("Pitch [deg]", "Yaw [deg]", "Pitch rate [deg/s]", "Yaw rate [deg/s]"), (0.0, 0.0, _OPEN, _OPEN),
    ),
    _aside(m.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE, "Configure gimbal"),
    _aside(m.MAV_CMD_DO_DIGICAM_CONTROL, "Take an image"),
    _aside(
        m.MAV_CMD_DO_SET_CAM_TRIGG_DIST, "Images by distance",
        ("Distance [m], 0 ends", "Shutter [ms]", "At once (0, 1)", ""), (25.0, 0.0, 1.0, 0.0),
    ),
    _aside(
        m.MAV_CMD_DO_SET_CAM_TRIGG_INTERVAL, "Images by time", ("Cycle [ms], 0 ends", "Shutter [ms]", "", ""),
        (2000.0, 0.0, 0.0, 0.0),
    ),
    _aside(m.MAV_CMD_SET_CAMERA_MODE, "Camera mode", ("", "Mode (0 image, 1 video, 2 survey)", "", "")),
    _aside(
        m.MAV_CMD_IMAGE_START_CAPTURE, "Take images", ("", "Interval [s]", "Images, 0 without end", ""),
        (0.0, 2.0, 0.0, 0.0),
    ),
    _aside(m.MAV_CMD_IMAGE_STOP_CAPTURE, "Stop images"),
    _aside(m.MAV_CMD_VIDEO_START_CAPTURE, "Start video"),
    _aside(m.MAV_CMD_VIDEO_STOP_CAPTURE, "Stop video"),
)  # fmt: skip


FRAME_LABELS = {
    mavlink.MAV_FRAME_GLOBAL: "AMSL",
    mavlink.MAV_FRAME_LOCAL_NED: "NED",
    mavlink.MAV_FRAME_MISSION: "-",
    mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT: "rel",
    mavlink.MAV_FRAME_LOCAL_ENU: "ENU",
    mavlink.MAV_FRAME_GLOBAL_INT: "AMSL",
    mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT: "rel",
}
FRAME_WORDS = {"rel": "above home", "AMSL": "above the sea"}  # by label: what a height is measured from
WAY_SUMMARIES = {mavlink.MAV_VTOL_STATE_FW: "to forward flight", mavlink.MAV_VTOL_STATE_MC: "to hover"}
_NAN = math.nan
_NO_PLACE = mavlink.MAV_FRAME_MISSION  # frame of items without a place
_YAW = "Yaw [deg], - as it is"
_RADIUS = "Radius [m], - anticlockwise"
_EXIT = "Yaw, or exit path (0, 1)"  # MAV_CMD_NAV_LOITER_*: a hover has a yaw, a circle an exit path

MISSION_COMMANDS = (
    MissionCommand(
        command=mavlink.MAV_CMD_NAV_WAYPOINT, label="Waypoint",
        params=("Hold [s]", "Acceptance [m], 0 usual", "Pass radius [m]", _YAW), defaults=(0.0, 0.0, 0.0, _NAN),
    ),
    MissionCommand(
        command=mavlink.MAV_CMD_NAV_TAKEOFF, label="Take off",
        params=("", "", "", _YAW), defaults=(0.0, 0.0, 0.0, _NAN),
    ),
    MissionCommand(
        command=mavlink.MAV_CMD_NAV_LAND, label="Land", params=("", "", "", _YAW), defaults=(0.0, 0.0, 0.0, _NAN)
    ),
    MissionCommand(
        command=mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH, label="Return home and land",
        params=("",) * 4, defaults=(0.0,) * 4, has_place=False,
    ),
    MissionCommand(
        command=mavlink.MAV_CMD_NAV_LOITER_TIME, label="Loiter for a time",
        params=("Time [s]", "", _RADIUS, _EXIT), defaults=(30.0, 0.0, 30.0, _NAN),
    ),
    MissionCommand(
        command=mavlink.MAV_CMD_NAV_LOITER_TURNS, label="Loiter for turns",
        params=("Turns", "", _RADIUS, _EXIT), defaults=(2.0, 0.0, 30.0, _NAN),
    ),
    MissionCommand(
        command=mavlink.MAV_CMD_NAV_LOITER_UNLIM, label="Loiter without end",
        params=("", "", _RADIUS, _YAW), defaults=(0.0, 0.0, 30.0, _NAN),
    ),
    MissionCommand(
        command=mavlink.MAV_CMD_DO_VTOL_TRANSITION, label="Transition",
        params=("State (0 auto, 3 hover, 4 forward)", "", "", ""),
        defaults=(float(mavlink.MAV_VTOL_STATE_FW), 0.0, 0.0, 0.0), has_place=False,
    ),
    MissionCommand(
        command=mavlink.MAV_CMD_DO_CHANGE_SPEED, label="Change speed",
        params=("Type (0 air, 1 ground)", "Speed [m/s]", "Throttle [%]", ""),
        defaults=(0.0, 12.0, -1.0, 0.0), has_place=False,
    ),
    MissionCommand(
        command=mavlink.MAV_CMD_NAV_DELAY, label="Wait",
        params=("Delay [s]", "", "", ""), defaults=(5.0, -1.0, -1.0, -1.0), has_place=False,
    ),
    MissionCommand(
        command=mavlink.MAV_CMD_DO_JUMP, label="Jump to an item",
        params=("Item", "Repeat", "", ""), defaults=(0.0, 1.0, 0.0, 0.0), has_place=False,
    ),
)  # fmt: skip
_BY_NUMBER = {entry.command: entry for entry in (*MISSION_COMMANDS, *PAYLOAD_COMMANDS)}
WAYPOINT = _BY_NUMBER[m.MAV_CMD_NAV_WAYPOINT]


FIELD_HELPS = {  # of the fields of the form, by label
    "Command (name or MAV_CMD)": "Another command: Enter shows its own fields",
    "Frame (name or MAV_FRAME)": "Where the numbers below begin; they are converted",
    "Latitude [deg]": "Or change north and east of home below",
    "Longitude [deg]": "Or change north and east of home below",
    "Altitude [m]": "Above home, or above the sea: as the frame says",
    "x [m]": "In the local frame: north (NED) or east (ENU)",
    "y [m]": "In the local frame: east (NED) or north (ENU)",
    "z [m]": "In the local frame: down (NED) or up (ENU)",
    "Hold [s]": "How long it waits there; above 0 it stops and hovers",
    "Acceptance [m], 0 usual": "How near counts as reached; 0: the vehicle's own radius",
    "Pass radius [m]": "0 flies through the point; else past it, + clockwise",
    _YAW: "Clockwise from north; - keeps the heading",
    _RADIUS: "Of the circle in forward flight; below 0 anticlockwise",
    _EXIT: "In hover the yaw; of a circle 1 leaves it by a tangent",
    "Time [s]": "How long it stays there",
    "Turns": "How many turns of the circle; a hover stays as long",
    "State (0 auto, 3 hover, 4 forward)": "How the legs after it are flown",
    "Type (0 air, 1 ground)": "Through the air or over the ground; 2 climb, 3 descent",
    "Speed [m/s]": f"Below {MIN_AIRSPEED:g} of the hover, else of forward flight; -2 usual",
    "Throttle [%]": "-1: not changed",
    "Delay [s]": "How long it waits",
    "Item": "Number of the item to go on with",
    "Repeat": "How many times; -1 for ever",
    "Yaw [deg]": "Clockwise from north; - keeps the heading",
    "Leave towards the next (0, 1)": "1: it leaves the circle towards the next item",
    "Radius [m], - anticlockwise": "Of the circle in forward flight; below 0 anticlockwise",
    "Exit by a tangent (0, 1)": "1: it leaves the circle by a tangent",
    "Distance [m]": "The items after it wait until it is as near as this",
    "Angle [deg]": "Clockwise from north, or from the heading if relative",
    "Rate [deg/s]": "How fast it turns; 0: the vehicle's own",
    "Way (0 shorter, 1 clockwise, -1)": "-1: anticlockwise",
    "Relative (0, 1)": "1: from the present heading, 0: from north",
    "Here (0, 1)": "1: home is where the vehicle is, 0: the place below",
    "At once (0, 1)": "1: the first image at once",
    "Cycle [ms], 0 ends": "Time from image to image",
    "Distance [m], 0 ends": "Way from image to image",
    "Images, 0 without end": "How many are taken",
    "Interval [s]": "Time from image to image",
    "Shutter [ms]": "How long it is open; 0: the camera's own",
    "Mode": "Of the mount, as MAVLink numbers it (MAV_MOUNT_MODE)",
    "Mode (0 image, 1 video, 2 survey)": "Of the camera",
    "Mode (0 none, 1 along, 3 place)": "What it looks at",
    "Pitch [deg]": "Of the camera; below 0 looks down",
    "Roll [deg]": "Of the camera",
    "Pitch rate [deg/s]": "How fast it turns; - leaves it open",
    "Yaw rate [deg/s]": "How fast it turns; - leaves it open",
    "In force (0, 1)": "1 puts the fence in force, 0 takes it out",
}
OTHER_FIELD = "As MAVLink defines it for this command (MAV_CMD)"


def field_help(label: str) -> str:
    """A line about a field of the form of an item, by its label."""
    return FIELD_HELPS.get(label, OTHER_FIELD)


def mission_command_of(item: MissionItem) -> MissionCommand:
    """The description of an item's command; an unknown command gets numbered parameters."""
    known = _BY_NUMBER.get(item.command)
    if known is not None:
        return known
    return MissionCommand(
        command=item.command,
        label=command_name(item.command),
        params=("param1", "param2", "param3", "param4"),
        defaults=item.params,
        has_place=item.frame != _NO_PLACE,
    )


def new_item(
    kind: MissionCommand, near: MissionItem | None, here: tuple[float, float, float] | None
) -> MissionItem | None:
    """A new item with default parameters; None if it needs a place and none is known.

    Args:
        kind: Its command.
        near: An item whose place it takes.
        here: Without ``near``: latitude and longitude [deg], and height above home [m].
    """
    if not kind.has_place:
        return _item(kind, _NO_PLACE, (0, 0, 0.0))
    if near is not None:
        return _item(kind, near.frame, (near.x, near.y, near.z))
    if here is None:
        return None
    return _item(kind, mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT, (to_e7(here[0]), to_e7(here[1]), here[2]))


def _item(kind: MissionCommand, frame: int, place: tuple[int, int, float]) -> MissionItem:
    x, y, z = place
    return MissionItem(command=kind.command, frame=frame, params=kind.defaults, x=x, y=y, z=z)


def with_default_parameters(item: MissionItem) -> MissionItem:
    """The item with the default parameters of its command, and a frame that suits it."""
    kind = mission_command_of(item)
    frame = item.frame if kind.has_place else _NO_PLACE
    if kind.has_place and frame == _NO_PLACE:
        frame = mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT
    return replace(item, params=kind.defaults, frame=frame)


def item_summary(item: MissionItem) -> str:
    """The parameters of an item that are set, in a few words: "hold 2, acceptance 0.3"."""
    first, second = item.params[:2]
    if item.command == mavlink.MAV_CMD_DO_VTOL_TRANSITION and first in WAY_SUMMARIES:
        return WAY_SUMMARIES[int(first)]
    if item.command == mavlink.MAV_CMD_DO_VTOL_TRANSITION and first == mavlink.MAV_VTOL_STATE_UNDEFINED:
        return "vehicle decides"
    if item.command == mavlink.MAV_CMD_DO_CHANGE_SPEED and first in {0.0, 1.0} and second > 0.0:
        return f"{field_text(second)} m/s {('airspeed', 'over ground')[int(first)]}"
    named = zip(_parameter_names(item), item.params, strict=True)
    return ", ".join(
        f"{name.split()[0].strip(',').lower()} {field_text(value)}"
        for name, value in named
        if name and value and not math.isnan(value)
    )


def item_fields(item: MissionItem) -> list[tuple[str, str]]:
    """Label and text of every field of an item: command, frame, its used parameters, its place."""
    shown = [
        ("Command (name or MAV_CMD)", command_name(item.command)),
        ("Frame (name or MAV_FRAME)", _frame_name(item.frame)),
    ]
    shown += [
        (name, field_text(value)) for name, value in zip(_parameter_names(item), item.params, strict=True) if name
    ]
    if mission_command_of(item).has_place:
        is_global = is_global_frame(item.frame)
        labels = ("Latitude [deg]", "Longitude [deg]", "Altitude [m]") if is_global else ("x [m]", "y [m]", "z [m]")
        shown += list(zip(labels, (*coordinate_texts(item), field_text(item.z)), strict=True))
    return shown


def edited_item(
    item: MissionItem, texts: Sequence[str], home: Geodetic | None = None, home_p: Vector = (0.0, 0.0, 0.0)
) -> MissionItem:
    """The item after its fields were edited. A new command starts with that command's default parameters.

    Fields that were not edited keep their value on the wire, to the last bit. The numbers are of the frame before; in a
    new frame they become those of the same place.

    Args:
        item: The item before.
        texts: Texts of the fields that ``item_fields`` gave, in that order.
        home: None while it is not known.
        home_p: Home in the local frame, NED [m].

    Raises:
        ValueError: A field cannot be read; the message names it.
        LocalProtocolError: A value does not fit the wire.
    """
    shown = item_fields(item)
    command, frame = _read_command(texts[0]), _read_frame(texts[1])
    rest = iter([(label, None if old == new else new) for (label, old), new in zip(shown, texts, strict=True)][2:])
    params = [
        _read_number(*next(rest), value, PARAMETER) if name else value
        for name, value in zip(_parameter_names(item), item.params, strict=True)
    ]
    new = replace(item, command=command, params=(params[0], params[1], params[2], params[3]))
    if mission_command_of(item).has_place:
        *plane, height = GLOBE_PLACE if is_global_frame(item.frame) else LOCAL_PLACE
        olds = zip((item.x, item.y), plane, strict=True)
        x, y = (_read_coordinate(*next(rest), old, item.frame, allowed) for old, allowed in olds)
        new = replace(new, x=x, y=y, z=_read_number(*next(rest), item.z, height))
        new = in_frame(new, frame, home, home_p)
    else:
        new = replace(new, frame=frame)
    return new if command == item.command else with_default_parameters(new)


def coordinate_texts(item: MissionItem) -> tuple[str, str]:
    """Latitude and longitude [deg], or x and y [m]; a dash for a coordinate that is not set."""
    convert, digits = (from_e7, 7) if is_global_frame(item.frame) else (from_local_e4, 4)
    x, y = ("-" if part == UNKNOWN_INT32 else f"{convert(part):.{digits}f}" for part in (item.x, item.y))
    return x, y


def field_text(value: float) -> str:
    """A number as it is edited; NaN, which leaves the value to the vehicle, is a dash."""
    return "-" if math.isnan(value) else f"{value:.7g}"


def _parameter_names(item: MissionItem) -> tuple[str, ...]:
    """Names of the parameters; an unused parameter that has a value is numbered, otherwise empty."""
    kind = mission_command_of(item)
    named = zip(kind.params, item.params, kind.defaults, strict=True)
    return tuple(
        name or ("" if value in {0.0, default} or math.isnan(value) else f"param{number}")
        for number, (name, value, default) in enumerate(named, 1)
    )


def _read_command(text: str) -> int:
    """The number of a command, from the number, the name on the screen or MAVLink's name."""
    if text.isdecimal() and text.isascii():
        if problem := number_problem("Command", text, COMMAND_NUMBER):
            raise ValueError(problem)
        return int(text)
    wanted = command_words(text)
    found: int | None = next((number for number in mavlink.enums["MAV_CMD"] if command_name(number) == wanted), None)
    if found is None:
        raise ValueError(f"Command: {text!r} is neither a MAV_CMD nor its number")
    return found


MAX_FRAME_DIGITS = 4


def _frame_name(frame: int) -> str:
    """A MAV_FRAME in lower case and without its prefix: "global relative alt"."""
    return _words(mavlink.enums["MAV_FRAME"][frame].name) if frame in mavlink.enums["MAV_FRAME"] else str(frame)


def _read_frame(text: str) -> int:
    """The number of a frame, from the number, the name on the screen or MAVLink's name."""
    frames = mavlink.enums["MAV_FRAME"]
    is_number = text.isdecimal() and len(text) < MAX_FRAME_DIGITS
    found = int(text) if is_number else next((n for n in frames if _frame_name(n) == _words(text)), -1)
    if found not in frames:
        raise ValueError(f"Frame: {text!r} is neither a MAV_FRAME nor its number")
    return found


def _words(frame: str) -> str:
    return frame.lower().replace("_", " ").removeprefix("mav frame ")


def _read_number(name: str, text: str | None, old: float, allowed: ValueRange) -> float:
    """The number in a field; the old one if the field was not edited."""
    if text is None:
        return old
    if text == "-":
        return _NAN
    if problem := number_problem(name, text, allowed):
        raise ValueError(problem)
    return float(text)


def _read_coordinate(name: str, text: str | None, old: int, frame: int, allowed: ValueRange) -> int:
    """The wire integer of a coordinate."""
    if text is None:
        return old
    value = _read_number(name, text, _NAN, allowed)
    if math.isnan(value):
        return UNKNOWN_INT32
    return to_e7(value) if is_global_frame(frame) else local_e4(value)


def height_text(item: MissionItem) -> str:
    """An item's height and what it is measured from: "12 m above home"; empty where it has none."""
    label = FRAME_LABELS.get(item.frame, "")
    return "" if math.isnan(item.z) or label not in FRAME_WORDS else f"{field_text(item.z)} m {FRAME_WORDS[label]}"
