"""Write ``docs/wire.md``: every message, command, mission item and parameter, from the code's own tables.

Run by hand: ``python scripts/build_wire_page.py``. The last column is a test file that names the thing.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from functools import cache
from pathlib import Path

from protocol import endpoint_vehicle
from protocol.dialect import mavlink
from protocol.endpoint import VehicleEndpoint
from protocol.engines import stream
from sitl.autopilot import commands, fence, home, mission_items, rally
from sitl.autopilot.settings import Settings
from sitl.parameters import INT, Bindings, Surroundings
from sitl.simulation.tuning import Tuning
from sitl.wire import node
from sitl.wire.telemetry import STREAMS

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "wire.md"
# What the vehicle side is made of, where messages that no table lists are built.
SPEAKERS = ("sitl/**/*.py", "protocol/engines/*.py", "protocol/plans/*.py", "protocol/endpoint_vehicle.py")
GROUND = re.compile(r"_client\.py$")
BEST = ("tests/sitl", "tests/protocol", "tests/e2e")
UNTESTED = "none"

HEAD = """# What goes over the wire

Written by `scripts/build_wire_page.py` from the tables the vehicle itself works by; do not edit. Definitions:
<https://mavlink.io/en/messages/common.html> and `protocol/dialect/darko.xml`. "Test" is the test file that says
most about it, tests of the whole vehicle first. Whatever is not here is answered as the services ask: an unknown
command with UNSUPPORTED, an unknown parameter with PARAM_ERROR, an unknown message not at all.
"""


def page() -> str:
    """The whole page, Markdown."""
    parts = [HEAD, _sent(), _occasional(), _taken(), _commands(), _items(), _parameters()]
    return "\n".join(parts)


def _sent() -> str:
    rows = [
        (name, s.message_id, f"{s.rate:g}" if s.rate else "on request", _group(s.message_id), _test(name))
        for s in STREAMS
        for name in (_message(s.message_id),)
    ]
    return _section(
        "Messages the vehicle streams",
        "Rates are the defaults [Hz of simulated time]. SET_MESSAGE_INTERVAL and REQUEST_DATA_STREAM change them for\n"
        "the link they come by and for no other; REQUEST_MESSAGE asks once. A group is one of REQUEST_DATA_STREAM\n"
        "(MAV_DATA_STREAM): what is in none keeps its rate when all are asked for.",
        ("Message", "Id", "Rate", "Group", "Test"),
        rows,
    )


def _occasional() -> str:
    streamed = {_message(s.message_id) for s in STREAMS}
    built = {name.upper() for text in _speakers() for name in re.findall(r"mavlink\.MAVLink_(\w+)_message\(", text)}
    ids = {known.msgname: number for number, known in mavlink.mavlink_map.items()}
    rows = [(name, ids[name], _test(name)) for name in sorted(built - streamed)]
    return _section("Messages it sends when there is cause", "", ("Message", "Id", "Test"), rows)


def _taken() -> str:
    endpoint = VehicleEndpoint(validate=lambda _items: None)
    served = {name: type(server).__name__ for name, server in endpoint._server_of.items()}  # noqa: SLF001
    served |= dict.fromkeys(endpoint_vehicle._SETPOINTS, "set-points")  # noqa: SLF001
    served |= {"HEARTBEAT": "presence", "SETUP_SIGNING": "Keyring", "MANUAL_CONTROL": "sticks", "SET_MODE": "autopilot"}
    served |= dict.fromkeys(home.MESSAGES, "home and origin")
    rows = [(name, served[name], _test(name)) for name in sorted(served)]
    return _section("Messages it takes", "", ("Message", "By", "Test"), rows)


def _commands() -> str:
    known = dict.fromkeys(commands.HANDLERS, "autopilot") | dict.fromkeys(stream.COMMANDS, "link")
    known |= dict.fromkeys(node.UPKEEP, "node") | {mavlink.MAV_CMD_REQUEST_OPERATOR_CONTROL: "operator control"}
    rows = [(_command(number), number, known[number], _test(_command(number))) for number in sorted(known)]
    return _section("Commands", "As COMMAND_LONG and COMMAND_INT.", ("MAV_CMD", "Number", "By", "Test"), rows)


def _items() -> str:
    plans = (("mission", mission_items.SUPPORTED), ("fence", _named_in(fence)), ("rally", _named_in(rally)))
    rows = [(_command(n), n, plan, _test(_command(n))) for plan, numbers in plans for n in sorted(numbers)]
    return _section("Plan items", "", ("MAV_CMD", "Number", "Plan", "Test"), rows)


def _parameters() -> str:
    rows = [
        (p.name, "INT32" if p.type == INT else "REAL32", f"{p.minimum:g}..{p.maximum:g}", p.unit, p.description)
        for p in Bindings(Settings(), Tuning(), Surroundings()).wire_table()
    ]
    text = "Each is read, set, refused out of its range and kept between runs by `tests/sitl/wire/test_node.py`."
    return _section("Parameters", text, ("Name", "Type", "Range", "Unit", "Meaning"), rows)


def _section(title: str, text: str, head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    lines = [f"## {title}", ""] + ([text, ""] if text else [])
    lines += ["| " + " | ".join(head) + " |", "|" + " --- |" * len(head)]
    lines += ["| " + " | ".join(str(cell).replace("|", "\\|") for cell in row) + " |" for row in rows]
    return "\n".join(lines) + "\n"


def _message(number: int) -> str:
    return str(mavlink.mavlink_map[number].msgname)


def _group(number: int) -> str:
    """The name of the MAV_DATA_STREAM a message belongs to, if any."""
    groups = mavlink.enums["MAV_DATA_STREAM"]
    held = (
        group for group, members in stream.GROUPS.items() if group != mavlink.MAV_DATA_STREAM_ALL and number in members
    )
    return next((str(groups[group].name).removeprefix("MAV_DATA_STREAM_") for group in held), "")


def _command(number: int) -> str:
    known = mavlink.enums["MAV_CMD"].get(number)
    return str(known.name).removeprefix("MAV_CMD_") if known else f"command {number}"


def _named_in(module: object) -> set[int]:
    """The commands a module's source names."""
    text = Path(str(getattr(module, "__file__", ""))).read_text(encoding="utf-8")
    return {getattr(mavlink, name) for name in re.findall(r"mavlink\.(MAV_CMD_\w+)", text)}


@cache
def _speakers() -> tuple[str, ...]:
    paths = sorted(path for pattern in SPEAKERS for path in ROOT.glob(pattern) if not GROUND.search(path.name))
    return tuple(path.read_text(encoding="utf-8") for path in paths)


@cache
def _tests() -> dict[str, str]:
    paths = sorted(path for path in (ROOT / "tests").rglob("test_*.py") if path.name != "test_wire_page.py")
    return {path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8") for path in paths}


def mentions(name: str, text: str) -> int:
    """How often a test names a message or a command, by any of the names Python code has for it."""
    ways = rf"(?:MAVLINK_MSG_ID_|MAV_CMD_)?{name}\b|MAVLink_{name.lower()}_message\b"
    return len(re.findall(rf"(?<![A-Za-z_])(?:{ways})", text))


def _test(name: str) -> str:
    counts = {path: mentions(name, text) for path, text in _tests().items()}
    best = max(counts, key=lambda path: (bool(counts[path]), -_rank(path), counts[path]))
    return f"`{best}`" if counts[best] else UNTESTED


def _rank(path: str) -> int:
    """The vehicle itself is better evidence than an engine, and an engine than a reader of logs."""
    return next((rank for rank, folder in enumerate(BEST) if Path(path).is_relative_to(folder)), len(BEST))


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
