"""Mission items as the operator edits them: parameters named by command, text fields of an item, and back."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from darko_gcs.state.missions.mission_frames import in_frame
from darko_gcs.state.missions.payload_commands import PAYLOAD_COMMANDS, MissionCommand
from darko_gcs.state.text import command_name, command_words
from protocol.dialect import mavlink
from protocol.frames import Geodetic, Vector, is_global_frame
from protocol.plans import MissionItem
from protocol.units import UNKNOWN_INT32, from_e7, from_local_e4, local_e4, to_e7

FRAME_LABELS = {
    mavlink.MAV_FRAME_GLOBAL: "AMSL",
    mavlink.MAV_FRAME_LOCAL_NED: "NED",
    mavlink.MAV_FRAME_MISSION: "-",
    mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT: "rel",
    mavlink.MAV_FRAME_LOCAL_ENU: "ENU",
    mavlink.MAV_FRAME_GLOBAL_INT: "AMSL",
    mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT: "rel",
}
WAY_SUMMARIES = {mavlink.MAV_VTOL_STATE_FW: "to forward flight", mavlink.MAV_VTOL_STATE_MC: "to hover"}
_NAN = math.nan
_NO_PLACE = mavlink.MAV_FRAME_MISSION  # frame of items without a place
_YAW = "Yaw [deg]"
_RADIUS = "Radius [m], - anticlockwise"
_EXIT = "Yaw, or exit path (0, 1)"  # MAV_CMD_NAV_LOITER_*: a hover has a yaw, a circle an exit path

MISSION_COMMANDS = (
    MissionCommand(
        command=mavlink.MAV_CMD_NAV_WAYPOINT, label="Waypoint",
        params=("Hold [s]", "Acceptance radius [m]", "Pass radius [m]", _YAW), defaults=(0.0, 0.0, 0.0, _NAN),
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
        _read_number(*next(rest), value) if name else value
        for name, value in zip(_parameter_names(item), item.params, strict=True)
    ]
    new = replace(item, command=command, params=(params[0], params[1], params[2], params[3]))
    if mission_command_of(item).has_place:
        x, y = (_read_coordinate(*next(rest), old, item.frame) for old in (item.x, item.y))
        new = replace(new, x=x, y=y, z=_read_number(*next(rest), item.z))
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
    if text.isdigit():
        return int(text)
    wanted = command_words(text)
    found: int | None = next((number for number in mavlink.enums["MAV_CMD"] if command_name(number) == wanted), None)
    if found is None:
        raise ValueError(f"Command: {text!r} is neither a MAV_CMD nor its number")
    return found


def _frame_name(frame: int) -> str:
    """A MAV_FRAME in lower case and without its prefix: "global relative alt"."""
    return _words(mavlink.enums["MAV_FRAME"][frame].name) if frame in mavlink.enums["MAV_FRAME"] else str(frame)


def _read_frame(text: str) -> int:
    """The number of a frame, from the number, the name on the screen or MAVLink's name."""
    frames = mavlink.enums["MAV_FRAME"]
    found = int(text) if text.isdigit() else next((n for n in frames if _frame_name(n) == _words(text)), -1)
    if found not in frames:
        raise ValueError(f"Frame: {text!r} is neither a MAV_FRAME nor its number")
    return found


def _words(frame: str) -> str:
    return frame.lower().replace("_", " ").removeprefix("mav frame ")


def _read_number(name: str, text: str | None, old: float) -> float:
    """The number in a field; the old one if the field was not edited."""
    if text is None:
        return old
    if text in {"-", "nan"}:
        return _NAN
    try:
        value = float(text)
    except ValueError:
        value = _NAN
    if not math.isfinite(value):
        raise ValueError(f"{name}: {text!r} is not a number")
    return value


def _read_coordinate(name: str, text: str | None, old: int, frame: int) -> int:
    """The wire integer of a coordinate."""
    if text is None:
        return old
    value = _read_number(name, text, _NAN)
    if math.isnan(value):
        return UNKNOWN_INT32
    return to_e7(value) if is_global_frame(frame) else local_e4(value)
