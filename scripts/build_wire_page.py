"""Write ``docs/wire.md``: every message, command, mission item and parameter, from the code's own tables.

Run by hand: ``python scripts/build_wire_page.py``.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from pathlib import Path
from textwrap import wrap

from protocol.dialect import mavlink
from protocol.endpoints.endpoint_vehicle import POSE_MESSAGES, VehicleEndpoint
from protocol.engines.server.data_stream_groups import DATA_STREAM_GROUPS
from protocol.engines.server.operator_control import SETPOINT_MESSAGES
from protocol.engines.server.stream_server import STREAM_COMMANDS
from protocol.ranges.command_ranges import COMMAND_PLACE, command_ranges
from protocol.ranges.item_ranges import MAX_ITEM_ALTITUDE, item_ranges
from protocol.ranges.message_ranges import MESSAGE_RANGES
from protocol.ranges.value_range import ANY_NUMBER, ValueRange
from sitl.autopilot.mission import item_meanings
from sitl.autopilot.mission import items as mission_items
from sitl.autopilot.safety import fence_items, rally
from sitl.mavlink import commands
from sitl.mavlink.handlers import answered_by
from sitl.mavlink.services.command_service import CommandService
from sitl.mavlink.services.failure_service import FailureService
from sitl.mavlink.services.flight_plan_service import FlightPlanService
from sitl.mavlink.services.home_service import HomeService
from sitl.mavlink.services.maintenance_commands import MaintenanceCommands
from sitl.mavlink.services.obstacle_service import ObstacleService
from sitl.mavlink.services.prediction_service import PredictionService
from sitl.mavlink.services.steering_service import SteeringService
from sitl.mavlink.telemetry.streams import FAMILIES, STREAMS
from sitl.vehicle.parameters import INT, Configuration

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "wire.md"
HEADINGS = ("Item", "Numbers", "Here", "Elsewhere")
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
    rows = _together(
        ((f"{s.rate:g}" if s.rate else "on request", _group(s.message_id)), _numbered(s.message_id))
        for s in sorted(STREAMS, key=lambda s: -s.rate)
    )
    families = "; ".join(
        "DARKO_*" if name == "DARKO" else ", ".join(map(_message, sorted(members)))
        for name, members in FAMILIES.items()
    )
    text = (
        "Default rates [Hz of simulated time]. SET_MESSAGE_INTERVAL and REQUEST_DATA_STREAM (by group) change them\n"
        "for a link; REQUEST_MESSAGE asks for one message. A link that asks for one message of a family by the first\n"
        "or the last gets all of that family, events too, until it stops all or is forgotten. The families are\n"
        f"{families}."
    )
    return _section("Messages the vehicle streams", text, ("Rate", "Group", "Messages"), rows)


def _sent_on_events() -> str:
    built = {
        name.upper() for text in _vehicle_sources() for name in re.findall(r"mavlink\.MAVLink_(\w+)_message\(", text)
    }
    ids = {known.msgname: number for number, known in mavlink.mavlink_map.items()}
    names = sorted(built - {_message(s.message_id) for s in STREAMS})
    return f"## Messages the vehicle sends on events\n\n{_wrapped(_numbered(ids[name]) for name in names)}\n"


def _accepted() -> str:
    endpoint = VehicleEndpoint(validate=lambda _items: None)
    served = {name: type(server).__name__ for name, server in endpoint._server_of.items()}  # noqa: SLF001
    served |= dict.fromkeys(SETPOINT_MESSAGES, "set-points") | dict.fromkeys(POSE_MESSAGES, "poses")
    served |= {"HEARTBEAT": "Presence", "SETUP_SIGNING": "Keyring", "DARKO_LEGS_REQUEST": PredictionService.__name__}
    for service in (CommandService, HomeService, ObstacleService, SteeringService):
        served |= dict.fromkeys(answered_by(service, str), service.__name__)
    rows = _together(((served[name],), name) for name in sorted(served))
    lines = "\n".join(_wrapped([names], f"- {by}: ") for by, names in rows)
    return f"## Messages the vehicle accepts\n\nBy what handles them:\n\n{lines}\n"


def _items() -> str:
    """Items of plans: their numbers, and what they mean beside PX4 and ArduPilot; one without a row is an error."""
    rows = [
        (f"{_command(n)}", _ranges(item_ranges(n, MISSION_FRAME)), item_meanings.ITEM_MEANINGS[n])
        for n in sorted(mission_items.SUPPORTED_COMMANDS)
    ]
    text = (
        "A number out of its range (`protocol/ranges/`) is refused with its name: an item at upload, a command by\n"
        "DENIED. NaN leaves a value to the vehicle, but not where \\* stands. Numbers that are not listed may be any.\n"
        f"Places are within 90 and 180 deg, and {MAX_ITEM_ALTITUDE:g} m above or below the sea, home or the origin.\n\n"
        f"{item_meanings.ITEM_WORDS}"
    )
    missions = _section("Mission items", text, HEADINGS, _with_meanings(rows))
    numbers = sorted(_named_in(fence_items) | _named_in(rally))
    spans = _together(((_ranges(item_ranges(n, MISSION_FRAME)),), _command(n)) for n in numbers)
    others = _listed(f"{names}{': ' * bool(span)}{span}" for span, names in spans)
    return f"{missions}\n## Fence and rally items\n\n{others}\n"


def _commands() -> str:
    known = {mavlink.MAV_CMD_REQUEST_OPERATOR_CONTROL, *commands.HANDLERS, *STREAM_COMMANDS}
    for service in (FailureService, FlightPlanService, MaintenanceCommands):
        known |= set(answered_by(service, int))
    ranges = {n: _ranges(command_ranges(n, None), COMMAND_PLACE) for n in sorted(known)}
    meanings = item_meanings.COMMAND_MEANINGS
    same = {n for n in mission_items.SUPPORTED_COMMANDS & known if ranges[n] == _ranges(item_ranges(n, MISSION_FRAME))}
    alike = sorted(same - set(meanings))
    plain = [n for n in ranges if n not in meanings and n not in alike]
    spans = _together(((ranges[n],), _command(n)) for n in plain)
    others = _listed(f"{names}{': ' * bool(span)}{span}" for span, names in spans)
    text = (
        f"As COMMAND_LONG and COMMAND_INT. {item_meanings.COMMAND_WORDS}\nAs the items of the same name:\n\n"
        f"{_wrapped(_command(n) for n in alike)}\n\nOthers:\n\n{others}"
    )
    rows = [(_command(n), "the same" if ranges[n] and n in same else ranges[n], meanings[n]) for n in sorted(meanings)]
    return _section("Commands", text, ("Command", *HEADINGS[1:]), _with_meanings(rows))


def _with_meanings(rows: Sequence[tuple[str, str, item_meanings.Meaning]]) -> list[tuple[str, ...]]:
    """Rows of names, numbers and meanings; what has the same of both is one row."""
    together = _together(((span, meaning.here, _elsewhere(meaning)), name) for name, span, meaning in rows)
    return [(names, span, here, elsewhere) for span, here, elsewhere, names in together]


def _listed(lines: Iterable[str]) -> str:
    return "\n".join("\n".join(wrap(line, 120, initial_indent="- ", subsequent_indent="  ")) for line in lines)


def _wrapped(names: Iterable[str], begin: str = "") -> str:
    """Names in lines of the page's length."""
    return "\n".join(wrap(", ".join(names) + ".", 120, initial_indent=begin, subsequent_indent="  " * bool(begin)))


def _together(rows: Iterable[tuple[tuple[str, ...], str]]) -> list[tuple[str, ...]]:
    """A row for each first part, with all its names."""
    names: dict[tuple[str, ...], list[str]] = {}
    for key, name in rows:
        names.setdefault(key, []).append(name)
    return [(*key, ", ".join(group)) for key, group in names.items()]


def _set_points() -> str:
    rows = [
        (message, "; ".join(f"{', '.join(names)}: {span}" for span, names in _by_span(fields).items()))
        for message, fields in MESSAGE_RANGES.items()
    ]
    text = (
        "A message with another value in a field that its mask does not leave out is refused by a text that names the\n"
        "field (`protocol/ranges/message_ranges.py`)."
    )
    return _section("Set-points and sticks", text, ("Message", "Fields"), rows)


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
        return f"both {meaning.px4}"
    told = (("PX4", meaning.px4), ("ArduPilot", meaning.ardupilot))
    said = "; ".join(f"{who} {words}" for who, words in told if words != "as here")
    return re.sub(r"ArduPilot (?=Plane|Copter|QuadPlane)", "", said)


def _parameters() -> str:
    rows = (
        f"{p.name} {p.value:g}{' ' * bool(p.unit)}{p.unit}, {p.minimum:g}..{p.maximum:g}{' INT32' * (p.type == INT)}: "
        f"{p.description}"
        for p in Configuration().wire_table()
    )
    head = (
        "## Parameters\n\nName, default, range, meaning. REAL32 unless INT32 stands. What is out of range is refused."
    )
    return f"{head}\n\n{_listed(rows)}\n"


def _section(title: str, text: str, head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    lines = [f"## {title}", ""] + ([text, ""] if text else [])
    lines += ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    lines += ["| " + " | ".join(str(cell).replace("|", "\\|") for cell in row) + " |" for row in rows]
    return "\n".join(lines) + "\n"


def _numbered(number: int) -> str:
    return f"{_message(number)} {number}"


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
