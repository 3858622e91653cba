"""Short names for values of the dialect's enums, for texts that people read."""

from __future__ import annotations

from protocol.dialect import mavlink

__all__ = ["enum_name"]


def enum_name(enum: str, value: int, prefix: str | None = None) -> str:
    """The name of an enum's value without its prefix, such as "DENIED" for 2 of MAV_RESULT.

    Args:
        enum: Name of the enum.
        value: The value; one without a name gives the enum's name and the number.
        prefix: What the names begin with, if it is not the enum's name.
    """
    entry = mavlink.enums[enum].get(value)
    return str(entry.name).removeprefix(f"{prefix or enum}_") if entry else f"{enum} {value}"
