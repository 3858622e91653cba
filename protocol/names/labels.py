"""Names and labels of numbers: laws, failures, parameters, commands and enumerations of the dialect."""

from __future__ import annotations

from typing import Final, TypeVar

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import LabelledEnum, Law, Regime

__all__ = [
    "DEFAULT_SPEED",
    "FAILURE_TYPES",
    "FAILURE_UNITS",
    "FORCE_ARM_DISARM",
    "MAX_NAME_LENGTH",
    "NO_CHANGE",
    "as_member",
    "enum_name",
    "law_label",
    "law_words",
    "name_of",
]

Member = TypeVar("Member", bound=LabelledEnum)


def as_member(enum: type[Member], number: int) -> Member | None:
    """A number of the dialect as a member of its enum; None if only a newer vehicle knows it."""
    try:
        return enum(number)
    except ValueError:
        return None


def name_of(enum: type[LabelledEnum], number: int) -> str:
    """A number of the dialect as programs name it; an unknown number as its digits."""
    member = as_member(enum, number)
    return str(number) if member is None else member.name


def enum_name(enum: str, value: int, prefix: str | None = None) -> str:
    """The name of an enum's value without its prefix, such as "DENIED" for 2 of MAV_RESULT.

    Args:
        enum: Name of the enum.
        value: The value; one without a name gives the enum's name and the number.
        prefix: What the names begin with, if it is not the enum's name.
    """
    entry = mavlink.enums[enum].get(value)
    return str(entry.name).removeprefix(f"{prefix or enum}_") if entry else f"{enum} {value}"


TRANSITIONS: Final = (Regime.FRONT_TRANSITION, Regime.BACK_TRANSITION)


def law_label(number: int) -> str:
    """A DARKO_LAW in plain words: the law of a transition is called as the transition; an unknown one "law 12"."""
    law = as_member(Law, number)
    if law is None:
        return f"law {number}"
    return law.regime.label if law.regime in TRANSITIONS else law.label


def law_words(name: str) -> str:
    """The same of a law's name in programs: "front transition" of "TO_FORWARD"; another name in lower case."""
    return law_label(Law[name]) if name in Law.__members__ else name.replace("_", " ").lower()


def _named(enum: str) -> dict[str, int]:
    """The values of an enumeration by their short names, such as gyro or motor."""
    skipped = (f"{enum}_", "SENSOR_", "SYSTEM_")
    values = {}
    for number, entry in mavlink.enums[enum].items():
        name = str(entry.name)
        for prefix in skipped:
            name = name.removeprefix(prefix)
        if name != "ENUM_END":
            values[name.lower()] = number
    return values


FAILURE_UNITS, FAILURE_TYPES = _named("FAILURE_UNIT"), _named("FAILURE_TYPE")


MAX_NAME_LENGTH = 16
"""Characters of a parameter's name on the wire, which are ASCII."""


FORCE_ARM_DISARM = 21196
"""param2 of MAV_CMD_COMPONENT_ARM_DISARM: arm or disarm without the usual checks.

https://mavlink.io/en/messages/common.html#MAV_CMD_COMPONENT_ARM_DISARM
"""

NO_CHANGE, DEFAULT_SPEED = -1.0, -2.0
"""param2 and param3 of MAV_CMD_DO_CHANGE_SPEED: leave speed or throttle as it is, or return to the vehicle's own.

https://mavlink.io/en/messages/common.html#MAV_CMD_DO_CHANGE_SPEED
"""
