"""Ranges of the numbers that an operator types, and what is wrong with one, in the operator's words.

A range is narrow enough for the wire: what passes it can be sent, and nobody reads of fields that do not fit.
"""

from __future__ import annotations

import math

from protocol.errors import WireRangeError
from protocol.ranges import (
    ALTITUDE,
    LATITUDE,
    LONGITUDE,
    MAX_AIRSPEED,
    MAX_DISTANCE,
    MAX_FLOAT32,
    MAX_ITEM_ALTITUDE,
    MIN_SPEED,
    ZONE_RADIUS,
    ValueRange,
    finite,
    whole,
)

MIN_CLIMB = 0.5  # of a take-off above where the vehicle stands [m]
MAX_OTHER_SPEED = 200.0  # of other autopilots' vehicles [m/s]
HEIGHT, RADIUS = ALTITUDE, ZONE_RADIUS
DISTANCE = finite("distance", -MAX_DISTANCE, MAX_DISTANCE, "m", default=False)
GLOBE_PLACE = (LATITUDE, LONGITUDE, ALTITUDE)
LOCAL_PLACE = (DISTANCE, DISTANCE, ALTITUDE)
PARAMETER = finite("parameter", -1e6, 1e6)  # of a mission item: what a command makes of it, its vehicle knows
NUMBER = ValueRange("number", default=False)  # any that can be sent
COMMAND_NUMBER = whole("command", 0, 0xFFFF)


def take_off_range(from_home_down: float | None) -> ValueRange:
    """Heights above home that a take-off may have.

    Args:
        from_home_down: Of the vehicle, down from home [m]; None where it is not known.
    """
    ground = 0.0 if from_home_down is None else round(-from_home_down, 1)
    return finite("height", ground + MIN_CLIMB, MAX_ITEM_ALTITUDE, "m", default=False)


def speed_range(*, is_ours: bool) -> ValueRange:
    """Speeds that can be asked for: what DarkO flies, and of another vehicle what any might."""
    return finite("speed", MIN_SPEED, MAX_AIRSPEED if is_ours else MAX_OTHER_SPEED, "m/s", default=False)


def parse_number(text: str) -> float | None:
    """The finite number that a text spells, or None."""
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def number_problem(label: str, text: str, allowed: ValueRange) -> str | None:
    """The fault of the text of a field, or None: "Altitude: from -20 000 to 20 000 m, not 1e39".

    Args:
        label: Of the field, with its unit in brackets.
        text: As typed.
        allowed: Values that the number may have.
    """
    value = parse_number(text)
    if value is None:
        return f"{label}: {text[:MAX_ECHO]!r} is not a number"
    if allowed.allows(value):
        return None
    return f"{label.partition(' [')[0]}: {range_words(allowed)}, not {value:.6g}"


MAX_ECHO = 24  # of what was typed that is told [characters]


def range_words(allowed: ValueRange) -> str:
    """A range in words: "from 0.1 to 22 m/s", "a whole number from 0 to 65 535"."""
    if allowed.maximum == MAX_FLOAT32:
        return f"from {allowed.minimum:g} to {allowed.maximum:g}"
    kind = "a whole number " if allowed.is_whole else ""
    return f"{kind}from {_grouped(allowed.minimum)} to {_grouped(allowed.maximum)} {allowed.unit}".rstrip()


def _grouped(value: float) -> str:
    return f"{value:,.10g}".replace(",", " ")


def fault_words(error: Exception) -> str:
    """The reason why something could not be asked for, without the names of messages and fields."""
    if isinstance(error, WireRangeError):
        return "A number is too large to be sent: nothing was sent"
    return str(error)
