"""Write ``docs/wire.md``: every message, command, mission item and parameter, from the code's own tables.

Run by hand: ``python scripts/build_wire_page.py``.
"""

from __future__ import annotations

import re
from collections.abc import Hashable, Iterable, Mapping, Sequence
from functools import cache
from pathlib import Path
from textwrap import wrap
from typing import NamedTuple, TypeVar

from protocol.dialect import mavlink
from protocol.endpoints.endpoint_vehicle import POSE_MESSAGES, VehicleEndpoint
from protocol.engines.server.operator_control import SETPOINT_MESSAGES
from protocol.engines.server.stream_server import DATA_STREAM_GROUPS, STREAM_COMMANDS
from protocol.engines.table_values import Parameter
from protocol.ranges import (
    ANY_NUMBER,
    COMMAND_PLACE,
    MAX_ITEM_ALTITUDE,
    MESSAGE_RANGES,
    ValueRange,
    command_ranges,
    item_ranges,
)
from sitl.autopilot import world
from sitl.autopilot.mission import items as mission_items
from sitl.mavlink import commands
from sitl.mavlink.handlers import answered_by
from sitl.mavlink.services.command_service import CommandService, FailureService, MaintenanceCommands
from sitl.mavlink.services.flight_plan_service import FlightPlanService
from sitl.mavlink.services.home_service import HomeService
from sitl.mavlink.services.peer_inputs import ObstacleService, SteeringService
from sitl.mavlink.telemetry.telemetry_service import FAMILIES, STREAMS
from sitl.vehicle.parameters import INT, Configuration

# The meaning of mission items and commands here, beside what PX4 and ArduPilot document: a table of ``docs/wire.md``.
#
# To add an item or a command, add its row. "as here" is said of what differs in nothing that a plan can tell. Sources:
# <https://docs.px4.io/main/en/flight_modes_vtol/mission>, PX4's ``src/modules/navigator`` where its guide is silent,
# <https://ardupilot.org/plane/docs/common-mavlink-mission-command-messages-mav_cmd.html> and its page for Copter.


class Meaning(NamedTuple):
    """One item or command: what it does here, of a PX4 and of an ArduPilot."""

    here: str
    px4: str = "as here"
    ardupilot: str = "as here"


ITEM_WORDS = """An item with autocontinue 0 pauses the mission after it until MISSION_START, DO_PAUSE_CONTINUE or the
mode goes on (PX4: until another item is chosen; ArduPilot: ignored). After a condition (unknown to PX4) DO items wait
while the next item is flown; those still waiting at its end are passed over. Leaving the mission suspends images. In
italics: where PX4 and ArduPilot (Plane, Copter) document something else."""
COMMAND_WORDS = "Conditions (but CONDITION_YAW) and DO_LAND_START are items alone."

TAKE_OFF_MEANING = Meaning(
    "Climbs straight up, then hovers to its place; passed over in the air; an interrupted climb goes on.",
    "flies to it in the air, ends VTOL_TAKEOFF with a front transition",
    "climbs in the air if lower",
)
LAND_MEANING = Meaning(
    "Flies to its place (0, 0: here) at its height or higher, lands upright, disarms. Arm and start to go on.",
    "ignores yaw",
    "Plane lands as a plane by LAND",
)
LOITER_WORDS = "In forward flight a circle"

ITEM_MEANINGS: dict[int, Meaning] = {
    mavlink.MAV_CMD_NAV_WAYPOINT: Meaning(
        "With a hold it stops, turned to yaw. Else forward flight passes within the radius (0: NAV_ACC_RAD), or as "
        "near as a right angle is turned, and NAV_FW_ALT_RAD of its height, if need be after a circle.",
        "flying forward ignores both",
        "Plane does not hold",
    ),
    mavlink.MAV_CMD_NAV_LOITER_UNLIM: Meaning(
        f"{LOITER_WORDS} for ever; hovering, or without a radius, it hovers there."
    ),
    mavlink.MAV_CMD_NAV_LOITER_TURNS: Meaning(
        f"{LOITER_WORDS} (radius 0: NAV_LOITER_RAD); hovering it is passed.",
        "does not know it",
        "Copter turns on the spot for radius 0",
    ),
    mavlink.MAV_CMD_NAV_LOITER_TIME: Meaning("As LOITER_UNLIM; the time begins on the circle or at the place."),
    mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH: Meaning(
        "Lands at home or the nearest rally point, from RTL_RETURN_ALT or higher.",
        "by RTL_TYPE also along the mission",
        "Plane circles there",
    ),
    mavlink.MAV_CMD_NAV_LAND: LAND_MEANING,
    mavlink.MAV_CMD_NAV_TAKEOFF: TAKE_OFF_MEANING,
    mavlink.MAV_CMD_NAV_VTOL_TAKEOFF: TAKE_OFF_MEANING,
    mavlink.MAV_CMD_NAV_VTOL_LAND: LAND_MEANING,
    mavlink.MAV_CMD_NAV_LOITER_TO_ALT: Meaning(
        "In forward flight circles (radius 0: NAV_LOITER_RAD) until within 2 m of its height, towards the next item if "
        "param1 or param4 is 1; hovering, goes to its point.",
        "takes param4 for the exit's place",
        "Copter climbs at the point",
    ),
    mavlink.MAV_CMD_DO_LAND_START: Meaning(
        "Passed over; with RTL_TYPE 1 and 3 returns fly from the nearest on.",
        "by RTL_TYPE 2 and 4 along the mission",
        "Plane by RTL_AUTOLAND, Copter by Auto RTL",
    ),
    mavlink.MAV_CMD_CONDITION_DELAY: Meaning("The DO items after it wait that long."),
    mavlink.MAV_CMD_CONDITION_DISTANCE: Meaning("They wait until the next item is that near, level."),
    mavlink.MAV_CMD_CONDITION_YAW: Meaning(
        "Turns the belly (at most, and rate 0: 30 deg/s); in forward flight it is met at once."
    ),
    mavlink.MAV_CMD_DO_SET_HOME: Meaning(
        "Home is here (1), or at its place, unless fence, arena or mission forbid it."
    ),
    mavlink.MAV_CMD_DO_FENCE_ENABLE: Meaning(
        "0: no fence until disarmed, 1: that of GF_ACTION.",
        "does not know it",
        "has 2 for the floor",
    ),
    mavlink.MAV_CMD_DO_SET_ROI_LOCATION: Meaning(
        "The camera, and a hovering vehicle's belly (not in strong wind or landing), turn there until NONE, another "
        "order to the mount, or a new start.",
        "as a multicopter",
        "Copter turns if the mount cannot",
    ),
    mavlink.MAV_CMD_DO_SET_ROI: Meaning(
        "With a place as DO_SET_ROI_LOCATION; without: 0 none, 1 along the way.",
        "by param1",
        "has a place, or none",
    ),
    mavlink.MAV_CMD_DO_SET_ROI_WPNEXT_OFFSET: Meaning(
        "The camera looks that far up and clockwise of the course.",
        "points it to the next waypoint",
        "does not know it",
    ),
    mavlink.MAV_CMD_DO_SET_ROI_NONE: Meaning("Fixes the camera to the body."),
    mavlink.MAV_CMD_DO_MOUNT_CONFIGURE: Meaning("Accepted: nothing to configure.", ardupilot="sets the mount's mode"),
    mavlink.MAV_CMD_DO_MOUNT_CONTROL: Meaning(
        "Looks up and clockwise of the heading, level (mode 2), or is fixed to the body (0, 1).",
        ardupilot="numbers param7 otherwise",
    ),
    mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW: Meaning(
        "As DO_MOUNT_CONTROL, from north if the flags lock the yaw; no rates.",
        "with rates",
        "with rates",
    ),
    mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE: Meaning(
        "Accepted: everyone may point it.", "choose who may", "choose who may"
    ),
    mavlink.MAV_CMD_DO_DIGICAM_CONTROL: Meaning("Takes an image.", ardupilot="only if param5 is 1"),
    mavlink.MAV_CMD_DO_SET_CAM_TRIGG_DIST: Meaning("Over the ground; 0 ends it."),
    mavlink.MAV_CMD_DO_SET_CAM_TRIGG_INTERVAL: Meaning("0 or -1 ends it.", ardupilot="does not know it"),
    mavlink.MAV_CMD_SET_CAMERA_MODE: Meaning("Images and videos in each.", ardupilot="leaves it to the camera"),
    mavlink.MAV_CMD_IMAGE_START_CAPTURE: Meaning("0 images: until stopped; at least 0.1 s apart."),
    mavlink.MAV_CMD_IMAGE_STOP_CAPTURE: Meaning("Ends images by time."),
    mavlink.MAV_CMD_VIDEO_START_CAPTURE: Meaning("CAMERA_CAPTURE_STATUS tells of it."),
    mavlink.MAV_CMD_VIDEO_STOP_CAPTURE: Meaning("CAMERA_CAPTURE_STATUS tells of it."),
    mavlink.MAV_CMD_NAV_DELAY: Meaning("Waits.", ardupilot="also to a time of day"),
    mavlink.MAV_CMD_DO_JUMP: Meaning(
        "-1: for ever. Counters begin anew with the mission, and by DO_SET_MISSION_CURRENT's reset.",
        ardupilot="allows 15 in older versions",
    ),
    mavlink.MAV_CMD_DO_CHANGE_SPEED: Meaning(
        "Up to DRK_HOV_VMAX the hover's ground speed; from 7 m/s the cruise, through the air (type 0) or over the "
        "ground (1); 2, 3: climb and descent of hovered legs; -1: no change, -2: default. No throttle. Holds until the "
        "mission begins anew.",
        "takes types as one, 0 or less as the default, a throttle",
        "Copter takes 0 and 1 as level; Plane 1 as the least ground speed, and a throttle",
    ),
    mavlink.MAV_CMD_DO_VTOL_TRANSITION: Meaning(
        "3: hover the next legs, 4: fly them forward where possible, 0: choose again; no wait.",
        "ends with the transition",
        "QuadPlane 3 and 4",
    ),
}
TAKE_OFF_COMMAND = Meaning(
    "Straight up to param7 (NaN: MIS_TAKEOFF_ALT); disarmed, it waits 20 s for arming; refused in the air.",
    "without a limit of time",
    "only armed and in GUIDED",
)
LAND_COMMAND = Meaning("Stops and lands there; a place is ignored.")
COMMAND_MEANINGS: dict[int, Meaning] = {
    mavlink.MAV_CMD_NAV_TAKEOFF: TAKE_OFF_COMMAND,
    mavlink.MAV_CMD_NAV_VTOL_TAKEOFF: TAKE_OFF_COMMAND,
    mavlink.MAV_CMD_NAV_LAND: LAND_COMMAND,
    mavlink.MAV_CMD_NAV_VTOL_LAND: LAND_COMMAND,
    mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH: Meaning("As the item, in mode RTL."),
    mavlink.MAV_CMD_NAV_LOITER_UNLIM: Meaning("Holds, upright; with a place it is refused."),
    mavlink.MAV_CMD_DO_SET_MODE: Meaning(
        "PX4's main and sub mode. Disarmed, every mode is taken; in RTL and LAND it is not armed.",
        ardupilot="has its own numbers",
    ),
    mavlink.MAV_CMD_COMPONENT_ARM_DISARM: Meaning(
        "On the ground, if the checks pass; 21196 forces either.", ardupilot="forces arming by 2989"
    ),
    mavlink.MAV_CMD_DO_REPOSITION: Meaning(
        "A place by COMMAND_INT, hovered or flown forward to, then held, at the hover's speed. Without a place another "
        "height or heading, else hold.",
        "circles there with a fixed wing, radius param3",
        "in GUIDED, or with a flag",
    ),
    mavlink.MAV_CMD_DO_CHANGE_ALTITUDE: Meaning(
        "For where the vehicle is to be, or its circle.",
        ardupilot="Plane, in GUIDED",
    ),
    mavlink.MAV_CMD_DO_ORBIT: Meaning(
        "Flown forward for ever, not tighter than 5 m/s2 (40 m at 14 m/s); NaN: NAV_LOITER_RAD, here.",
        "orbits in the hover with any yaw",
        "does not document it",
    ),
    mavlink.MAV_CMD_CONDITION_YAW: Meaning(
        "Turns the belly while the vehicle holds in the hover.", "by DO_REPOSITION's yaw", "Copter"
    ),
    mavlink.MAV_CMD_MISSION_START: Meaning(
        "NaN: from the current item. 0 without param2 (0): goes on; on the ground a broken-off mission begins anew. "
        "From item 0, or complete before, as after an upload. Disarmed, it is checked, and waits 20 s for arming.",
        "sets the item, changes the mode, arms",
        "changes the mode to AUTO, resumes by MIS_RESTART",
    ),
    mavlink.MAV_CMD_DO_SET_MISSION_CURRENT: Meaning(
        "The mode stays. -1: the current item. 1 resets counters, speeds and ways of flying.",
        "has no reset",
    ),
    mavlink.MAV_CMD_DO_PAUSE_CONTINUE: Meaning("0 holds, upright; 1 goes on with the current item."),
    mavlink.MAV_CMD_DO_CHANGE_SPEED: Meaning(
        "As the item, now: a hover takes no cruise speed, a cruise no hover speed.",
    ),
    mavlink.MAV_CMD_DO_VTOL_TRANSITION: Meaning(
        "IN_PROGRESS until it hovers or flies forward (outside a mission: a circle ahead).",
        "ACCEPTED at the start",
        "ACCEPTED at the start",
    ),
}

Key = TypeVar("Key", bound=Hashable)
ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "wire.md"
USUAL = ("yaw: ±360 deg", "radius: ±100000 m", "camera: 0, 1")  # told once
MISSION_FRAME = mavlink.MAV_FRAME_MISSION  # without a place
# Sources of the vehicle side, which build messages that no table lists; physics speaks to PX4 as its simulator does.
VEHICLE_SOURCES = (
    "sitl/**/*.py",
    "protocol/engines/*.py",
    "protocol/engines/server/*.py",
    "protocol/plans/*.py",
    "protocol/endpoints/endpoint_vehicle.py",
)
OTHERS_SOURCES = ROOT / "sitl" / "physics"

HEAD = """# What goes over the wire

Every message, command, plan item and parameter of the vehicle, written from its own tables by
`scripts/build_wire_page.py`. Definitions: <https://mavlink.io/en/messages/common.html>, `protocol/dialect/darko.xml`.
An unknown command is UNSUPPORTED, an unknown parameter a PARAM_ERROR.
"""


def page() -> str:
    """The whole page, Markdown."""
    parts = [HEAD, _streamed(), _sent_on_events(), _accepted(), _set_points(), _items(), _commands(), _parameters()]
    return "\n".join(parts)


def _streamed() -> str:
    rates: dict[float, list[str]] = {}
    grouped = _together(((s.rate, _group(s.message_id)), _message(s.message_id)) for s in STREAMS)
    for rate, group in sorted(grouped, reverse=True):
        rates.setdefault(rate, []).append(grouped[rate, group] + f" ({group})" * bool(group))
    rows = (f"{f'{rate:g} Hz' if rate else 'on request'}: {'; '.join(names)}" for rate, names in rates.items())
    families = "; ".join(
        "DARKO_*" if name == "DARKO" else ", ".join(map(_message, sorted(members)))
        for name, members in FAMILIES.items()
    )
    text = _paragraph(
        "Default rates, in simulated time, with the group of REQUEST_DATA_STREAM in brackets; that and "
        "SET_MESSAGE_INTERVAL change them for a link. A link that asks for one message of a family, by the latter or "
        f"REQUEST_MESSAGE, gets all of it, events too, until it stops all or is forgotten. Families: {families}."
    )
    return _section("Messages the vehicle streams", text, _listed(rows))


def _sent_on_events() -> str:
    built = {
        name.upper() for text in _vehicle_sources() for name in re.findall(r"mavlink\.MAVLink_(\w+)_message\(", text)
    }
    names = sorted(built - {_message(s.message_id) for s in STREAMS})
    return _section("Messages the vehicle sends on events", _paragraph(", ".join(names)))


def _accepted() -> str:
    endpoint = VehicleEndpoint(validate=lambda _items: None)
    names = {*endpoint._server_of, *SETPOINT_MESSAGES, *POSE_MESSAGES}  # noqa: SLF001
    names |= {"HEARTBEAT", "SETUP_SIGNING", "DARKO_LEGS_REQUEST"}
    for service in (CommandService, HomeService, ObstacleService, SteeringService):
        names |= set(answered_by(service, str))
    return _section("Messages the vehicle accepts", _paragraph(", ".join(sorted(names))))


def _items() -> str:
    """Items of plans: their numbers, and what they mean beside PX4 and ArduPilot; one without a row is an error."""
    rows = [
        (_command(n), _ranges(item_ranges(n, MISSION_FRAME)), ITEM_MEANINGS[n])
        for n in sorted(mission_items.SUPPORTED_COMMANDS)
    ]
    ranges = _paragraph(
        "In brackets: parameters with their ranges (`protocol/ranges.py`). One out of its range is refused by name, an "
        "item at upload, a command by DENIED. NaN leaves a value to the vehicle, but not where \\* stands. Yaws are "
        "±360 deg, radii ±100000 m, cameras 0 or 1; others may be any. Places are within 90 and 180 deg, and "
        f"{MAX_ITEM_ALTITUDE:g} m of the sea, home or the origin."
    )
    missions = _section("Mission items", ranges, ITEM_WORDS, _with_meanings(rows))
    numbers = sorted(_named_in(world))
    spans = _together((_ranges(item_ranges(n, MISSION_FRAME)), _command(n)) for n in numbers)
    return f"{missions}\n{_section('Fence and rally items', _with_ranges(spans))}"


def _commands() -> str:
    known = {mavlink.MAV_CMD_REQUEST_OPERATOR_CONTROL, *commands.HANDLERS, *STREAM_COMMANDS}
    for service in (FailureService, FlightPlanService, MaintenanceCommands):
        known |= set(answered_by(service, int))
    ranges = {n: _ranges(command_ranges(n, None), COMMAND_PLACE) for n in sorted(known)}
    meanings = COMMAND_MEANINGS
    same = {n for n in mission_items.SUPPORTED_COMMANDS & known if ranges[n] == _ranges(item_ranges(n, MISSION_FRAME))}
    alike = sorted(same - set(meanings))
    text = _paragraph(
        f"As COMMAND_LONG and COMMAND_INT. {COMMAND_WORDS} As the items of the same name: "
        f"{', '.join(_command(n).rpartition(' ')[0] for n in alike)}."
    )
    rows = [(_command(n), "the same" if ranges[n] and n in same else ranges[n], meanings[n]) for n in sorted(meanings)]
    others = _together((span, _command(n)) for n, span in ranges.items() if n not in meanings and n not in alike)
    return _section("Commands", text, f"{_with_meanings(rows)}\n{_with_ranges(others)}")


def _with_meanings(rows: Sequence[tuple[str, str, Meaning]]) -> str:
    """A list of names, ranges and meanings; those that have the same of both are one."""
    together = _together(((span, meaning.here, _elsewhere(meaning)), name) for name, span, meaning in rows)
    return _listed(
        f"{_named(names, span)}: {here}{f' *{elsewhere}.*' * bool(elsewhere)}"
        for (span, here, elsewhere), names in together.items()
    )


def _with_ranges(together: Mapping[str, str]) -> str:
    return _listed(_named(names, span) for span, names in together.items())


def _named(names: str, span: str) -> str:
    return f"**{names}** ({span})" if span else f"**{names}**"


def _listed(lines: Iterable[str]) -> str:
    return "\n".join(_paragraph(line, "- ") for line in lines)


def _paragraph(text: str, begin: str = "") -> str:
    """Text in lines of the page's length."""
    return "\n".join(wrap(text, 120, initial_indent=begin, subsequent_indent=" " * len(begin), break_on_hyphens=False))


def _together(rows: Iterable[tuple[Key, str]]) -> dict[Key, str]:
    """The names that have the same of everything else, in one text."""
    names: dict[Key, list[str]] = {}
    for key, name in rows:
        names.setdefault(key, []).append(name)
    return {key: ", ".join(group) for key, group in names.items()}


def _set_points() -> str:
    rows = (f"{message}: {_fields(fields)}" for message, fields in MESSAGE_RANGES.items())
    text = _paragraph(
        "A message out of range in a field that its mask does not leave out is refused by a text with the field's name."
    )
    return _section("Set-points and sticks", text, _listed(rows))


def _fields(fields: Mapping[str, ValueRange]) -> str:
    return "; ".join(f"{', '.join(names)}: {span}" for span, names in _by_span(fields).items())


def _by_span(fields: Mapping[str, ValueRange]) -> dict[str, list[str]]:
    """The names of fields by what they may have."""
    spans: dict[str, list[str]] = {}
    for name, allowed in fields.items():
        spans.setdefault(_span(allowed), []).append(name)
    return spans


def _span(allowed: ValueRange) -> str:
    """The values a number may have; equal limits of either sign are written once."""
    symmetric = re.sub(r"(^| )-([\d.e+]+)\.\.\2(?![\d.])", r"\1±\2", allowed.span)
    return symmetric if allowed.default else f"{symmetric}\\*"


def _ranges(ranges: Sequence[ValueRange], left_out: Sequence[ValueRange] = ()) -> str:
    """The ranges of numbered parameters in words, without those that are usual, not used or left out."""
    left_out = (ANY_NUMBER, *left_out)
    used = [(number, f"{r.name}: {_span(r)}") for number, r in enumerate(ranges, start=1) if r not in left_out]
    return "; ".join(f"{number} {span}" for number, span in used if span not in USUAL)


def _elsewhere(meaning: Meaning) -> str:
    """Differences of PX4 and ArduPilot, if any."""
    if meaning.px4 == meaning.ardupilot != "as here":
        return f"PX4 and ArduPilot {meaning.px4}"
    told = (("PX4", meaning.px4), ("ArduPilot", meaning.ardupilot))
    said = "; ".join(f"{who} {words}" for who, words in told if words != "as here")
    return re.sub(r"ArduPilot (?=Plane|Copter|QuadPlane)", "", said)


def _parameters() -> str:
    rows = (f"**{p.name}** {_allowed(p)}: {p.description}" for p in Configuration().wire_table())
    text = "Name, default, range, meaning. REAL32; INT32 where the meaning lists the values."
    return _section("Parameters", text, _listed(rows))


def _allowed(parameter: Parameter) -> str:
    """Default, unit and range; values of whole numbers are listed by the meaning."""
    default = f"{parameter.value:g} {parameter.unit}".strip()
    return default if parameter.type == INT else f"{default}, {parameter.minimum:g}..{parameter.maximum:g}"


def _section(title: str, *parts: str) -> str:
    return "\n\n".join((f"## {title}", *parts)) + "\n"


def _message(number: int) -> str:
    return str(mavlink.mavlink_map[number].msgname)


def _group(number: int) -> str:
    """The name of the MAV_DATA_STREAM a message belongs to, if any."""
    groups = mavlink.enums["MAV_DATA_STREAM"]
    held = (
        group
        for group, members in DATA_STREAM_GROUPS.items()
        if group != mavlink.MAV_DATA_STREAM_ALL and number in members
    )
    return next((str(groups[group].name).removeprefix("MAV_DATA_STREAM_") for group in held), "")


def _command(number: int) -> str:
    """The name of a command without its prefix, and its number."""
    known = mavlink.enums["MAV_CMD"].get(number)
    return f"{str(known.name).removeprefix('MAV_CMD_') if known else 'command'} {number}"


def _named_in(module: object) -> set[int]:
    """The commands that a module's source mentions."""
    text = Path(str(getattr(module, "__file__", ""))).read_text(encoding="utf-8")
    return {getattr(mavlink, name) for name in re.findall(r"mavlink\.(MAV_CMD_\w+)", text)}


@cache
def _vehicle_sources() -> tuple[str, ...]:
    paths = sorted(
        path for pattern in VEHICLE_SOURCES for path in ROOT.glob(pattern) if OTHERS_SOURCES not in path.parents
    )
    return tuple(path.read_text(encoding="utf-8") for path in paths)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
