"""A message as rows of text: each field with its unit, enumerations by name, bits spelled out, its set-point beside."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator, Mapping
from typing import Any, NamedTuple

from darko_gcs.state.text import printable
from protocol.errors import LocalProtocolError
from protocol.names import law_label, mode_name
from protocol.tlog.message_set import message_named
from protocol.wire.message import Message

MAX_ELEMENTS = 16  # of an array, each with a row of its own; a longer one is a single row
MAX_ROW_TEXT = 120  # of a row [characters]
READABLE = {  # wire unit -> factor, unit that is read
    "degE7": (1e-7, "deg"), "degE5": (1e-5, "deg"), "cdeg": (1e-2, "deg"), "cdeg/s": (1e-2, "deg/s"),
    "rad": (180.0 / math.pi, "deg"), "rad/s": (180.0 / math.pi, "deg/s"), "mrad/s": (0.18 / math.pi, "deg/s"),
    "mm": (1e-3, "m"), "cm": (1e-2, "m"), "dm": (1e-1, "m"), "mm/s": (1e-3, "m/s"), "cm/s": (1e-2, "m/s"),
    "dm/s": (1e-1, "m/s"), "mV": (1e-3, "V"), "cV": (1e-2, "V"), "mA": (1e-3, "A"), "cA": (1e-2, "A"),
    "dA": (1e-1, "A"), "ms": (1e-3, "s"), "us": (1e-6, "s"), "ds": (1e-1, "s"), "cdegC": (1e-2, "degC"),
    "d%": (1e-1, "%"), "c%": (1e-2, "%"), "hJ": (1e2, "J"), "mG": (1e-3, "g"), "Pa": (1e-2, "hPa"),
}  # fmt: skip
LARGEST = {"uint8_t": 0xFF, "int16_t": 0x7FFF, "uint16_t": 0xFFFF, "int32_t": 0x7FFFFFFF, "uint32_t": 0xFFFFFFFF}
NO_VALUE = "largest number: no value"  # as MAVLink's messages use it
READABLE_DIGITS = 7
_OF_VELOCITY = {name: f"POSITION_TARGET_LOCAL_NED.{name}" for name in ("x", "y", "z", "vx", "vy", "vz")}
SET_POINTS: Mapping[str, Mapping[str, str]] = {  # message -> field -> where what is wanted of it stands
    "LOCAL_POSITION_NED": _OF_VELOCITY,
    "ODOMETRY": {name: _OF_VELOCITY[name] for name in ("x", "y", "z")},
    "GLOBAL_POSITION_INT": {
        "lat": "POSITION_TARGET_GLOBAL_INT.lat_int", "lon": "POSITION_TARGET_GLOBAL_INT.lon_int",
    },
    "ATTITUDE": {f"{name}speed": f"ATTITUDE_TARGET.body_{name}_rate" for name in ("roll", "pitch", "yaw")},
    "ATTITUDE_QUATERNION": {f"q{k + 1}": f"ATTITUDE_TARGET.q[{k}]" for k in range(4)}
    | {f"{name}speed": f"ATTITUDE_TARGET.body_{name}_rate" for name in ("roll", "pitch", "yaw")},
    "DARKO_ACTUATORS": {"motor_speed": "DARKO_ACTUATORS.motor_command", "elevon": "DARKO_ACTUATORS.elevon_command"},
}  # fmt: skip
# Bits of POSITION_TARGET_TYPEMASK, ATTITUDE_TARGET_TYPEMASK that tell a field to be ignored.
IGNORED = {
    "x": 1, "y": 2, "z": 4, "lat_int": 1, "lon_int": 2, "vx": 8, "vy": 16, "vz": 32, "body_roll_rate": 1,
    "body_pitch_rate": 2, "body_yaw_rate": 4, "q": 128,
}  # fmt: skip


class FieldRow(NamedTuple):
    """A row of a message."""

    path: str  # of the field in an expression, such as ATTITUDE.roll; empty if it is no number
    name: str
    value: str
    unit: str = ""  # of the wire
    meaning: str = ""  # the name of an enumeration, or the value in the unit that is read
    wanted: str = ""  # its set-point, in the wire's unit


def field_rows(message: Message, last: Callable[[str], Message | None]) -> list[FieldRow]:
    """The rows of a message.

    Args:
        message: Any decoded one.
        last: The last message of a name of the same component, which may tell a set-point.
    """
    rows: list[FieldRow] = []
    for name in message.get_fieldnames():
        rows += _rows(message, name, getattr(message, name), last)
    return rows


def _rows(message: Message, name: str, value: Any, last: Callable[[str], Message | None]) -> Iterator[FieldRow]:  # noqa: ANN401
    unit, kind = message.fieldunits_by_name.get(name, ""), message.get_type()
    largest = LARGEST.get(message.fieldtypes[message.fieldnames.index(name)]) if unit else None
    target = SET_POINTS.get(kind, {}).get(name, "")
    if isinstance(value, list) and len(value) <= MAX_ELEMENTS:
        for index, element in enumerate(value):
            wanted = _wanted(f"{target}[{index}]" if target else "", last)
            path = f"{kind}.{name}[{index}]"
            yield FieldRow(path, f"{name}[{index}]", _number(element), unit, _readable(element, unit, largest), wanted)
    elif isinstance(value, list):
        yield FieldRow("", name, _shortened(" ".join(map(_number, value))), unit)
    elif isinstance(value, str | bytes | bytearray):
        text = value if isinstance(value, str) else bytes(value).decode(errors="replace")
        yield FieldRow("", name, _shortened(f'"{printable(text)}"'))
    elif message.fielddisplays_by_name.get(name) == "bitmask":
        yield FieldRow(f"{kind}.{name}", name, f"{value:#x}" if isinstance(value, int) else str(value), unit)
        for bit in bit_names(message, name, int(value)):
            yield FieldRow("", "", "", "", bit)
    else:
        meaning = _named(message, name, value) or _readable(value, unit, largest)
        yield FieldRow(f"{kind}.{name}", name, _number(value), unit, meaning, _wanted(target, last))


def _named(message: Message, name: str, value: Any) -> str:  # noqa: ANN401 - of any message
    """Name of an enumeration's value; of a custom mode too."""
    if message.get_type() == "HEARTBEAT" and name == "custom_mode":
        return mode_name(message.autopilot, message.type, value) or ""
    enumeration = message.fieldenums_by_name.get(name, "")
    entry = _entries(message, enumeration).get(value)
    if entry is None:
        return f"not in {enumeration}" if enumeration else ""
    return str(entry.name).removeprefix(f"{enumeration}_")


def value_words(path: str, value: float) -> str:
    """An enumeration's value in the pilot's words: "hover linear" of 0 at "DARKO_HYBRID_STATE.law".

    Args:
        path: A field; any other expression has no words, nor has a field of numbers.
        value: Its value, also NaN.
    """
    kind, _, name = path.partition(".")
    try:
        message = message_named(kind)
    except LocalProtocolError:
        return ""
    enumeration = message.fieldenums_by_name.get(name, "")
    if not (enumeration and math.isfinite(value)) or message.fielddisplays_by_name.get(name) == "bitmask":
        return ""
    if enumeration == "DARKO_LAW":
        return law_label(int(value))
    entry = _entries(message, enumeration).get(int(value))
    return "" if entry is None else str(entry.name).removeprefix(f"{enumeration}_").replace("_", " ").lower()


def bit_names(message: Message, name: str, value: int) -> list[str]:
    """Names of the bits that are set; those without a name by number."""
    enumeration = message.fieldenums_by_name.get(name, "")
    entries = _entries(message, enumeration)
    found = []
    for place in range(value.bit_length() if value >= 0 else 0):
        if value >> place & 1:
            entry = entries.get(1 << place)
            found.append(f"bit {place}" if entry is None else str(entry.name).removeprefix(f"{enumeration}_"))
    return found


def _entries(message: Message, enumeration: str) -> Mapping[int, Any]:
    """The entries of an enumeration by number, in the dialect that the message is of."""
    module = message.__module__  # of a message and of its class
    known: Mapping[int, Any] = getattr(sys.modules[module], "enums", {}).get(enumeration, {})
    return known


def _wanted(target: str, last: Callable[[str], Message | None]) -> str:
    """The set-point at a place; empty if nobody told one, or the message says to ignore it."""
    kind, _, path = target.partition(".")
    name, _, index = path.rstrip("]").partition("[")
    message = last(kind) if kind else None
    value = getattr(message, name, None)
    if value is None or getattr(message, "type_mask", 0) & IGNORED.get(name, 0):
        return ""
    return _number(value[int(index)] if index else value)


def _number(value: Any) -> str:  # noqa: ANN401 - of any field
    if not isinstance(value, float):
        return str(value)
    return f"{value:.7g}" if math.isfinite(value) else str(value)


def _readable(value: Any, unit: str, largest: int | None) -> str:  # noqa: ANN401 - of any field
    """A number of the wire in the unit that is read: "47.3977 deg" of 473977420 degE7."""
    if value == largest:
        return NO_VALUE
    if unit not in READABLE or not isinstance(value, int | float) or not math.isfinite(value):
        return ""
    factor, read = READABLE[unit]
    digits = READABLE_DIGITS + 2 if unit == "degE7" else 5
    return f"{value * factor:.{digits}g} {read}"


def _shortened(text: str) -> str:
    return text if len(text) <= MAX_ROW_TEXT else text[: MAX_ROW_TEXT - 1] + "…"
