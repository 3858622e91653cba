"""Write ``docs/wire.md``: every message, command, mission item and parameter, from the code's own tables.

Run by hand: ``python scripts/build_wire_page.py``.
"""

from __future__ import annotations

import re
from collections.abc import Hashable, Iterable, Mapping, Sequence
from functools import cache
from pathlib import Path
from textwrap import wrap
from typing import TypeVar

from protocol.dialect import mavlink
from protocol.endpoints.endpoint_vehicle import POSE_MESSAGES, VehicleEndpoint
from protocol.engines.server.data_stream_groups import DATA_STREAM_GROUPS
from protocol.engines.server.operator_control import SETPOINT_MESSAGES
from protocol.engines.server.stream_server import STREAM_COMMANDS
from protocol.ranges.command_ranges import COMMAND_PLACE, command_ranges
from protocol.ranges.item_ranges import MAX_ITEM_ALTITUDE, item_ranges
from protocol.ranges.message_ranges import MESSAGE_RANGES
from protocol.ranges.value_range import ANY_NUMBER, ValueRange
from scripts import item_meanings
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
        (_command(n), _ranges(item_ranges(n, MISSION_FRAME)), item_meanings.ITEM_MEANINGS[n])
        for n in sorted(mission_items.SUPPORTED_COMMANDS)
    ]
    ranges = _paragraph(
        "Each has its number and, in brackets, its parameters with their ranges (`protocol/ranges/`). One out of its "
        "range is refused with its name: an item at upload, a command by DENIED. NaN leaves a value to the vehicle, "
        "but not where \\* stands. Parameters that are not listed may be any. Places are within 90 and 180 deg, and "
        f"{MAX_ITEM_ALTITUDE:g} m above or below the sea, home or the origin."
    )
    missions = _section("Mission items", ranges, item_meanings.ITEM_WORDS, _with_meanings(rows))
    numbers = sorted(_named_in(world))
    spans = _together((_ranges(item_ranges(n, MISSION_FRAME)), _command(n)) for n in numbers)
    return f"{missions}\n{_section('Fence and rally items', _with_ranges(spans))}"


def _commands() -> str:
    known = {mavlink.MAV_CMD_REQUEST_OPERATOR_CONTROL, *commands.HANDLERS, *STREAM_COMMANDS}
    for service in (FailureService, FlightPlanService, MaintenanceCommands):
        known |= set(answered_by(service, int))
    ranges = {n: _ranges(command_ranges(n, None), COMMAND_PLACE) for n in sorted(known)}
    meanings = item_meanings.COMMAND_MEANINGS
    same = {n for n in mission_items.SUPPORTED_COMMANDS & known if ranges[n] == _ranges(item_ranges(n, MISSION_FRAME))}
    alike = sorted(same - set(meanings))
    text = _paragraph(
        f"As COMMAND_LONG and COMMAND_INT. {item_meanings.COMMAND_WORDS} As the items of the same name: "
        f"{', '.join(_command(n) for n in alike)}."
    )
    rows = [(_command(n), "the same" if ranges[n] and n in same else ranges[n], meanings[n]) for n in sorted(meanings)]
    others = _together((span, _command(n)) for n, span in ranges.items() if n not in meanings and n not in alike)
    return _section("Commands", text, f"{_with_meanings(rows)}\n{_with_ranges(others)}")


def _with_meanings(rows: Sequence[tuple[str, str, item_meanings.Meaning]]) -> str:
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


def _elsewhere(meaning: item_meanings.Meaning) -> str:
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
