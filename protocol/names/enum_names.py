"""Short names for values of the dialect's enums, for texts that people read."""

from __future__ import annotations

from typing import TypeVar

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import LabelledEnum

__all__ = ["as_member", "enum_name", "name_of"]

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
