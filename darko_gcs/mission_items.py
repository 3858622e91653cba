"""Mission items in the operator's words: parameter names by command, fields to edit, and back."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from darko_gcs.snapshot import VTOL
from darko_gcs.store import command_name
from protocol.dialect import mavlink
from protocol.plans import MissionItem
from protocol.units import UNKNOWN_INT32, from_e7, from_local_e4, is_global_frame, local_e4, to_e7

__all__ = [
    "FRAMES",
    "KINDS",
    "Kind",
    "edited",
    "fields",
    "kind_of",
    "made",
    "place_words",
    "reset",
    "value_text",
    "words",
]

FRAMES = {0: "AMSL", 1: "NED", 2: "-", 3: "rel", 4: "ENU", 5: "AMSL", 6: "rel"}
NAN = math.nan
MISSION_FRAME = mavlink.MAV_FRAME_MISSION
RELATIVE = mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT
YAW = "Yaw [deg]"
CIRCLE = "Radius [m], - anticlockwise"
EXIT = "Yaw, or leave from (0, 1)"
Params = tuple[float, float, float, float]


@dataclass(frozen=True)
class Kind:
    """A command that missions are made of. A parameter without a name is not used."""

    command: int  # MAV_CMD
    label: str
    params: tuple[str, str, str, str]
    defaults: Params
    is_placed: bool = True


KINDS = (
    Kind(
        mavlink.MAV_CMD_NAV_WAYPOINT, "Waypoint",
        ("Hold [s]", "Acceptance radius [m]", "Pass radius [m]", YAW), (0.0, 0.0, 0.0, NAN),
    ),
    Kind(mavlink.MAV_CMD_NAV_TAKEOFF, "Take off", ("", "", "", YAW), (0.0, 0.0, 0.0, NAN)),
    Kind(mavlink.MAV_CMD_NAV_LAND, "Land", ("", "", "", YAW), (0.0, 0.0, 0.0, NAN)),
    Kind(mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH, "Return home and land", ("",) * 4, (0.0,) * 4, is_placed=False),
    Kind(
        mavlink.MAV_CMD_NAV_LOITER_TIME, "Loiter for a time", ("Time [s]", "", CIRCLE, EXIT), (30.0, 0.0, 30.0, NAN)
    ),
    Kind(mavlink.MAV_CMD_NAV_LOITER_TURNS, "Loiter for turns", ("Turns", "", CIRCLE, EXIT), (2.0, 0.0, 30.0, NAN)),
    Kind(mavlink.MAV_CMD_NAV_LOITER_UNLIM, "Loiter without end", ("", "", CIRCLE, YAW), (0.0, 0.0, 30.0, NAN)),
    Kind(
        mavlink.MAV_CMD_DO_VTOL_TRANSITION, "Transition", ("State (3 hover, 4 forward)", "", "", ""),
        (float(mavlink.MAV_VTOL_STATE_FW), 0.0, 0.0, 0.0), is_placed=False,
    ),
    Kind(
        mavlink.MAV_CMD_DO_CHANGE_SPEED, "Change speed", ("Type (0 air, 1 ground)", "Speed [m/s]", "Throttle [%]", ""),
        (0.0, 12.0, -1.0, 0.0), is_placed=False,
    ),
    Kind(mavlink.MAV_CMD_NAV_DELAY, "Wait", ("Delay [s]", "", "", ""), (5.0, -1.0, -1.0, -1.0), is_placed=False),
    Kind(mavlink.MAV_CMD_DO_JUMP, "Jump to an item", ("Item", "Repeat", "", ""), (0.0, 1.0, 0.0, 0.0), is_placed=False),
)  # fmt: skip
BY_COMMAND = {kind.command: kind for kind in KINDS}


def kind_of(item: MissionItem) -> Kind:
    """What is known of an item's command; of others, that they have numbered parameters."""
    unknown = Kind(item.command, command_name(item.command), ("param1", "param2", "param3", "param4"), item.params)
    return BY_COMMAND.get(item.command, replace(unknown, is_placed=item.frame != MISSION_FRAME))


def made(kind: Kind, near: MissionItem | None, home: tuple[float, float] | None) -> MissionItem | None:
    """A new item of a kind with its default parameters; None where it needs a place and none is known.

    Args:
        kind: What it is.
        near: An item whose place it takes.
        home: Else, latitude and longitude of home [deg]: 3 m above.
    """
    if not kind.is_placed:
        return MissionItem(kind.command, MISSION_FRAME, kind.defaults, 0, 0, 0.0)
    if near is not None:
        return MissionItem(kind.command, near.frame, kind.defaults, near.x, near.y, near.z)
    if home is None:
        return None
    return MissionItem(kind.command, RELATIVE, kind.defaults, to_e7(home[0]), to_e7(home[1]), 3.0)


def reset(item: MissionItem) -> MissionItem:
    """The item with the default parameters of its command, and a frame that suits it."""
    kind = kind_of(item)
    frame = item.frame if kind.is_placed else MISSION_FRAME
    if kind.is_placed and frame == MISSION_FRAME:
        frame = RELATIVE
    return replace(item, params=kind.defaults, frame=frame)


def words(item: MissionItem) -> str:
    """An item's parameters that say something, in few words."""
    first, second = item.params[:2]
    if item.command == mavlink.MAV_CMD_DO_VTOL_TRANSITION and first in VTOL:
        return f"to {VTOL[int(first)]}"
    if item.command == mavlink.MAV_CMD_DO_CHANGE_SPEED and first in {0.0, 1.0} and second > 0.0:
        return f"{value_text(second)} m/s {('in the air', 'over ground')[int(first)]}"
    said = zip(_names(item), item.params, strict=True)
    return ", ".join(
        f"{name.split()[0].strip(',').lower()} {value_text(value)}"
        for name, value in said
        if name and value and not math.isnan(value)
    )


def fields(item: MissionItem) -> list[tuple[str, str]]:
    """Label and text of every field of an item: command, frame, its used parameters, its place."""
    shown = [("Command (name or MAV_CMD)", command_name(item.command)), ("Frame (MAV_FRAME)", str(item.frame))]
    shown += [(name, value_text(value)) for name, value in zip(_names(item), item.params, strict=True) if name]
    if kind_of(item).is_placed:
        world = is_global_frame(item.frame)
        labels = ("Latitude [deg]", "Longitude [deg]", "Altitude [m]") if world else ("x [m]", "y [m]", "z [m]")
        shown += list(zip(labels, (*place_words(item), value_text(item.z)), strict=True))
    return shown


def edited(item: MissionItem, texts: Sequence[str]) -> MissionItem:
    """The item after its fields were edited; another command begins with that command's default parameters.

    What was not touched stays as it is on the wire, to the last bit.

    Raises:
        ValueError: A field cannot be read; the message names it.
        LocalProtocolError: A value does not fit the wire.
    """
    shown = fields(item)
    command, frame = _command(texts[0]), _whole("Frame", texts[1])
    if frame not in mavlink.enums["MAV_FRAME"]:
        raise ValueError(f"Frame: there is no MAV_FRAME {frame}")
    rest = iter([(label, None if old == new else new) for (label, old), new in zip(shown, texts, strict=True)][2:])
    listed = [
        _value(*next(rest), value) if name else value for name, value in zip(_names(item), item.params, strict=True)
    ]
    params: Params = (listed[0], listed[1], listed[2], listed[3])
    new = replace(item, command=command, frame=frame, params=params)
    if kind_of(item).is_placed:
        x, y = (_coordinate(*next(rest), old, item.frame, frame) for old in (item.x, item.y))
        new = replace(new, x=x, y=y, z=_value(*next(rest), item.z))
    return new if command == item.command else reset(new)


def place_words(item: MissionItem) -> tuple[str, str]:
    """Latitude and longitude [deg], or x and y [m]; dashes for what is left open."""
    convert, digits = (from_e7, 7) if is_global_frame(item.frame) else (from_local_e4, 4)
    x, y = ("-" if part == UNKNOWN_INT32 else f"{convert(part):.{digits}f}" for part in (item.x, item.y))
    return x, y


def value_text(value: float) -> str:
    """A number as it is edited; NaN, "leave it to the vehicle", is a dash."""
    return "-" if math.isnan(value) else f"{value:.7g}"


def _names(item: MissionItem) -> tuple[str, ...]:
    """Names of the parameters; one that is not used but holds something is numbered."""
    named = zip(kind_of(item).params, item.params, kind_of(item).defaults, strict=True)
    return tuple(
        name or ("" if value in {0.0, default} or math.isnan(value) else f"param{number}")
        for number, (name, value, default) in enumerate(named, 1)
    )


def _command(text: str) -> int:
    """The number of a command, also by its name as it is shown or as MAVLink writes it."""
    if text.isdigit():
        return int(text)
    wanted = text.lower().replace("_", " ").removeprefix("mav cmd ")
    found: int | None = next((number for number in mavlink.enums["MAV_CMD"] if command_name(number) == wanted), None)
    if found is None:
        raise ValueError(f"Command: {text!r} is neither a MAV_CMD nor its number")
    return found


def _whole(name: str, text: str) -> int:
    if not text.isdigit():
        raise ValueError(f"{name}: {text!r} is not a whole number")
    return int(text)


def _value(name: str, text: str | None, old: float) -> float:
    """The number a field holds; the old one where there is no new text."""
    if text is None:
        return old
    if text in {"-", "nan"}:
        return NAN
    try:
        value = float(text)
    except ValueError:
        value = NAN
    if not math.isfinite(value):
        raise ValueError(f"{name}: {text!r} is not a number")
    return value


def _coordinate(name: str, text: str | None, old: int, old_frame: int, frame: int) -> int:
    """The integer of the wire for a coordinate; in a frame of another unit it is the same number again."""
    if text is None and is_global_frame(old_frame) == is_global_frame(frame):
        return old
    before = (from_e7 if is_global_frame(old_frame) else from_local_e4)(old)
    value = _value(name, text, NAN if old == UNKNOWN_INT32 else before)
    if math.isnan(value):
        return UNKNOWN_INT32
    return to_e7(value) if is_global_frame(frame) else local_e4(value)
