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
from protocol.dialect import mavlink as m
from protocol.endpoints.endpoint_vehicle import POSE_MESSAGES, VehicleEndpoint
from protocol.engines.server.data_stream_groups import DATA_STREAM_GROUPS
from protocol.engines.server.operator_control import SETPOINT_MESSAGES
from protocol.engines.server.stream_server import STREAM_COMMANDS
from protocol.ranges.command_ranges import COMMAND_PLACE, command_ranges
from protocol.ranges.item_ranges import MAX_ITEM_ALTITUDE, item_ranges
from protocol.ranges.message_ranges import MESSAGE_RANGES
from protocol.ranges.value_range import ANY_NUMBER, ValueRange
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


ITEM_WORDS = """An item whose autocontinue is 0 pauses the mission after it: the vehicle holds and says so, until
MISSION_START, DO_PAUSE_CONTINUE or the mode goes on. (PX4 stays at the item until another is chosen; ArduPilot ignores
the field.) After a condition the DO items wait while the next item is flown; those still waiting at its end are passed
over, and said. With nothing to fly after it the vehicle waits where it is. (PX4 knows no conditions.) Each image is a
CAMERA_IMAGE_CAPTURED. Leaving the mission suspends images by distance or time. (On PX4 images, videos and modes are the
camera's.) In italics: where PX4 and ArduPilot (Plane, Copter) document something else."""
COMMAND_WORDS = "Conditions but CONDITION_YAW, and DO_LAND_START, are refused: they are items alone."

TAKE_OFF_MEANING = Meaning(
    "Climbs straight up at MPC_TKO_SPEED, then hovers to its place. In the air it is passed over, and said; a climb "
    "that was interrupted goes on.",
    "takes it in the air for a waypoint, and ends VTOL_TAKEOFF with a front transition",
    "in the air climbs if it is lower",
)
LAND_MEANING = Meaning(
    "Flies to its place (0, 0: here) at its height or higher, stands upright, descends at MPC_LAND_SPEED, disarms. "
    "Within a mission: arm and start again to go on.",
    "ignores yaw",
    "Plane lands a fixed wing by LAND, a QuadPlane by VTOL_LAND",
)
LOITER_WORDS = "In forward flight a circle"

ITEM_MEANINGS: dict[int, Meaning] = {
    m.MAV_CMD_NAV_WAYPOINT: Meaning(
        "With a hold it stops, turned to yaw; without, it is passed in forward flight within the radius "
        "(0: NAV_ACC_RAD), or as near as a right angle is turned (16 m at 15 m/s), and within "
        "NAV_FW_ALT_RAD of its height, after a circle where the leg is too short or too steep.",
        "ignores hold and radius on a fixed wing",
        "Plane does not hold, and passes by at param3",
    ),
    m.MAV_CMD_NAV_LOITER_UNLIM: Meaning(
        f"{LOITER_WORDS} until another order; without a radius, or hovering, it hovers there."
    ),
    m.MAV_CMD_NAV_LOITER_TURNS: Meaning(
        f"{LOITER_WORDS} (radius 0: NAV_LOITER_RAD); hovering it is passed.",
        "does not know it",
        "Copter turns on the spot for radius 0",
    ),
    m.MAV_CMD_NAV_LOITER_TIME: Meaning("As LOITER_UNLIM; the time begins on the circle or at the place."),
    m.MAV_CMD_NAV_RETURN_TO_LAUNCH: Meaning(
        "Returns to home or the nearest rally point at RTL_RETURN_ALT or higher, and lands.",
        "by RTL_TYPE also along the mission",
        "Plane circles there",
    ),
    m.MAV_CMD_NAV_LAND: LAND_MEANING,
    m.MAV_CMD_NAV_TAKEOFF: TAKE_OFF_MEANING,
    m.MAV_CMD_NAV_VTOL_TAKEOFF: TAKE_OFF_MEANING,
    m.MAV_CMD_NAV_VTOL_LAND: LAND_MEANING,
    m.MAV_CMD_NAV_LOITER_TO_ALT: Meaning(
        "In forward flight circles (radius 0: NAV_LOITER_RAD) until within 2 m of its height, and leaves towards the "
        "next item if param1 or param4 is 1; hovering it goes to its point.",
        "takes param4 for the exit's place",
        "Copter climbs at the point",
    ),
    m.MAV_CMD_DO_LAND_START: Meaning(
        "Passed over. With RTL_TYPE 1 and 3 a return, also of a failsafe, flies from the nearest one on.",
        "by RTL_TYPE 2 and 4 along the mission",
        "Plane by RTL_AUTOLAND, Copter by Auto RTL",
    ),
    m.MAV_CMD_CONDITION_DELAY: Meaning("The DO items after it wait that long."),
    m.MAV_CMD_CONDITION_DISTANCE: Meaning("They wait until the next item is that near, level."),
    m.MAV_CMD_CONDITION_YAW: Meaning(
        "Turns the belly (rate 0, and at most: 30 deg/s) until the next item ends; in forward flight it is met at once."
    ),
    m.MAV_CMD_DO_SET_HOME: Meaning(
        "Home is here (1), or at its place; one that fence, arena or mission forbid is refused in flight."
    ),
    m.MAV_CMD_DO_FENCE_ENABLE: Meaning(
        "0: no fence until the vehicle is disarmed, 1: the fence of GF_ACTION again.",
        "does not know it",
        "has 2 for the floor",
    ),
    m.MAV_CMD_DO_SET_ROI_LOCATION: Meaning(
        "The hovering vehicle turns its belly there (not in a wind that asks for the span edge-on, not while landing), "
        "the camera looks there in forward flight too, until NONE, another order to the mount, or a new start.",
        "as a multicopter",
        "Copter turns if the mount cannot",
    ),
    m.MAV_CMD_DO_SET_ROI: Meaning(
        "With a place as DO_SET_ROI_LOCATION; without: param1 0 none, 1 along the way.",
        "by param1",
        "has a place, or none",
    ),
    m.MAV_CMD_DO_SET_ROI_WPNEXT_OFFSET: Meaning(
        "The camera looks that far up and clockwise of the course; the vehicle does not turn.",
        "points it to the next waypoint",
        "does not know it",
    ),
    m.MAV_CMD_DO_SET_ROI_NONE: Meaning("No region of interest; the camera is fixed to the body again."),
    m.MAV_CMD_DO_MOUNT_CONFIGURE: Meaning("Accepted: nothing to configure.", ardupilot="sets the mount's mode"),
    m.MAV_CMD_DO_MOUNT_CONTROL: Meaning(
        "The camera looks up and clockwise of the heading, level (mode 2), or is fixed to the body (0, 1). No roll.",
        ardupilot="numbers param7 otherwise",
    ),
    m.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW: Meaning(
        "As DO_MOUNT_CONTROL, from north if the flags lock the yaw; no rates.",
        "with rates",
        "with rates",
    ),
    m.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE: Meaning(
        "Accepted: everyone may point it.", "choose who may", "choose who may"
    ),
    m.MAV_CMD_DO_DIGICAM_CONTROL: Meaning("Takes an image.", ardupilot="only if param5 is 1"),
    m.MAV_CMD_DO_SET_CAM_TRIGG_DIST: Meaning("Over the ground; 0 ends it."),
    m.MAV_CMD_DO_SET_CAM_TRIGG_INTERVAL: Meaning("0 or -1 ends it.", ardupilot="does not know it"),
    m.MAV_CMD_SET_CAMERA_MODE: Meaning("Images and videos in each.", ardupilot="leaves it to the camera"),
    m.MAV_CMD_IMAGE_START_CAPTURE: Meaning("0 images: until stopped; at least 0.1 s apart."),
    m.MAV_CMD_IMAGE_STOP_CAPTURE: Meaning("Ends images by time."),
    m.MAV_CMD_VIDEO_START_CAPTURE: Meaning("CAMERA_CAPTURE_STATUS tells of it."),
    m.MAV_CMD_VIDEO_STOP_CAPTURE: Meaning("CAMERA_CAPTURE_STATUS tells of it."),
    m.MAV_CMD_NAV_DELAY: Meaning("Waits.", ardupilot="also to a time of day"),
    m.MAV_CMD_DO_JUMP: Meaning(
        "-1: for ever. Counters begin anew with an upload, a start from the first item, "
        "after the mission was complete, and by DO_SET_MISSION_CURRENT's reset.",
        ardupilot="allows 15 in older versions",
    ),
    m.MAV_CMD_DO_CHANGE_SPEED: Meaning(
        "Up to DRK_HOV_VMAX the ground speed of the hover; from 7 m/s the cruise, through the air (type 0) or over "
        "the ground (1: by the wind at the start of each leg). 2 and 3: climb (take-offs too) and descent of hovered "
        "legs. Speed: -1 no change, -2 default. A throttle is refused. Holds until the mission begins anew.",
        "takes types as one, 0 or less as the default, a throttle without a speed",
        "Copter takes 0 and 1 as level; Plane 1 as the least ground speed, and a throttle",
    ),
    m.MAV_CMD_DO_VTOL_TRANSITION: Meaning(
        "3: hover the legs to come, 4: fly them forward where possible, 0: choose again. No wait of its own.",
        "ends with the transition",
        "QuadPlane 3 and 4",
    ),
}
TAKE_OFF_COMMAND = Meaning(
    "Straight up where it stands, to param7 (NaN: MIS_TAKEOFF_ALT); disarmed, it waits 20 s for arming. In the air "
    "it is refused.",
    "without a limit of time",
    "only armed and in GUIDED",
)
LAND_COMMAND = Meaning("Stops and lands there; a place is ignored.")
COMMAND_MEANINGS: dict[int, Meaning] = {
    m.MAV_CMD_NAV_TAKEOFF: TAKE_OFF_COMMAND,
    m.MAV_CMD_NAV_VTOL_TAKEOFF: TAKE_OFF_COMMAND,
    m.MAV_CMD_NAV_LAND: LAND_COMMAND,
    m.MAV_CMD_NAV_VTOL_LAND: LAND_COMMAND,
    m.MAV_CMD_NAV_RETURN_TO_LAUNCH: Meaning("As the item, in mode RTL."),
    m.MAV_CMD_NAV_LOITER_UNLIM: Meaning("Holds, upright; with a place it is refused."),
    m.MAV_CMD_DO_SET_MODE: Meaning(
        "PX4's main and sub mode. Disarmed on the ground every mode is taken; in RTL and LAND it is not armed.",
        ardupilot="has its own numbers",
    ),
    m.MAV_CMD_COMPONENT_ARM_DISARM: Meaning(
        "On the ground, if the checks pass; 21196 forces either.", ardupilot="forces arming by 2989"
    ),
    m.MAV_CMD_DO_REPOSITION: Meaning(
        "A place by COMMAND_INT, hovered or flown forward to, then held; the speed is the hover's limit. Without a "
        "place another height (round the circle if one is flown) or heading, else hold.",
        "circles there with a fixed wing, radius param3",
        "in GUIDED, or with the flag that changes the mode",
    ),
    m.MAV_CMD_DO_CHANGE_ALTITUDE: Meaning(
        "For where the vehicle is to be, or round the circle that it flies.",
        ardupilot="Plane, in GUIDED",
    ),
    m.MAV_CMD_DO_ORBIT: Meaning(
        "Flown forward for ever, not tighter than 5 m/s2; NaN: NAV_LOITER_RAD, here, at this height.",
        "orbits in the hover with any yaw",
        "does not document it",
    ),
    m.MAV_CMD_CONDITION_YAW: Meaning(
        "Turns the belly while the vehicle holds in the hover.", "by DO_REPOSITION's yaw", "Copter"
    ),
    m.MAV_CMD_MISSION_START: Meaning(
        "NaN: from the current item. 0 without param2 (0): the mission under way goes on; on the "
        "ground it begins anew if it was broken off. From item 0, or complete before, it is as after an upload.",
        "sets the item, changes the mode",
        "changes the mode to AUTO; MIS_RESTART decides whether it resumes",
    ),
    m.MAV_CMD_DO_SET_MISSION_CURRENT: Meaning(
        "The mode stays. -1: the current item. 1 resets counters, speeds and ways of flying, and lets a "
        "complete mission go on. Out of range: FAILED.",
        "has no reset",
    ),
    m.MAV_CMD_DO_PAUSE_CONTINUE: Meaning("0 holds, upright; 1 goes on with the current item."),
    m.MAV_CMD_DO_CHANGE_SPEED: Meaning(
        "As the item, for the manoeuvre under way: a hover takes no cruise speed, a cruise no hover speed.",
    ),
    m.MAV_CMD_DO_VTOL_TRANSITION: Meaning(
        "IN_PROGRESS until it hovers or flies on the wing; EXTENDED_SYS_STATE says so before the ACCEPTED. Forward "
        "outside a mission: a circle ahead.",
        "ACCEPTED at the start",
        "ACCEPTED at the start",
    ),
}


Key = TypeVar("Key", bound=Hashable)
ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "wire.md"
MISSION_FRAME = mavlink.MAV_FRAME_MISSION  # without a place
# Sources of the vehicle side, which build messages that no table lists.
VEHICLE_SOURCES = (
    "sitl/**/*.py",
    "protocol/engines/*.py",
    "protocol/engines/server/*.py",
    "protocol/plans/*.py",
    "protocol/endpoints/endpoint_vehicle.py",
)

HEAD = """# What goes over the wire

For anyone who connects a program: every message, command, plan item and parameter of the vehicle, written from its
own tables by `scripts/build_wire_page.py`. Definitions: <https://mavlink.io/en/messages/common.html> and
`protocol/dialect/darko.xml`. An unknown command is UNSUPPORTED, an unknown parameter a PARAM_ERROR; an unknown message
gets no answer.
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
        "By default, in simulated time, with the group of REQUEST_DATA_STREAM in brackets. That and "
        "SET_MESSAGE_INTERVAL change rates for a link; REQUEST_MESSAGE asks for one message. A link that asks for one "
        "message of a family by either of the last two gets all of that family, events too, until it stops all or is "
        f"forgotten. The families are {families}."
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
        "Each has its number and, in brackets, its parameters with their ranges (`protocol/ranges/`). One out of its "
        "range is refused with its name: an item at upload, a command by DENIED. NaN leaves a value to the vehicle, "
        "but not where \\* stands. Parameters that are not listed may be any. Places are within 90 and 180 deg, and "
        f"{MAX_ITEM_ALTITUDE:g} m above or below the sea, home or the origin."
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
        f"{', '.join(_command(n) for n in alike)}."
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
        "A message with another value in a field that its mask does not leave out is refused by a text that names the "
        "field (`protocol/ranges/message_ranges.py`)."
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
    """The ranges of numbered parameters in words, without those that are not used or are left out."""
    left_out = (ANY_NUMBER, *left_out)
    used = [(number, allowed) for number, allowed in enumerate(ranges, start=1) if allowed not in left_out]
    return "; ".join(f"{n} {r.name}: {_span(r)}" for n, r in used)


def _elsewhere(meaning: Meaning) -> str:
    """Differences of PX4 and ArduPilot, if any."""
    if meaning.px4 == meaning.ardupilot != "as here":
        return f"PX4 and ArduPilot {meaning.px4}"
    told = (("PX4", meaning.px4), ("ArduPilot", meaning.ardupilot))
    said = "; ".join(f"{who} {words}" for who, words in told if words != "as here")
    return re.sub(r"ArduPilot (?=Plane|Copter|QuadPlane)", "", said)


def _parameters() -> str:
    rows = (
        f"**{p.name}** {p.value:g}{' ' * bool(p.unit)}{p.unit}, {p.minimum:g}..{p.maximum:g}"
        f"{' INT32' * (p.type == INT)}: {p.description}"
        for p in Configuration().wire_table()
    )
    text = "Name, default, range, meaning. REAL32 unless INT32 stands. What is out of range is refused."
    return _section("Parameters", text, _listed(rows))


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
    paths = sorted(path for pattern in VEHICLE_SOURCES for path in ROOT.glob(pattern))
    return tuple(path.read_text(encoding="utf-8") for path in paths)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
