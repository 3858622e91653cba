"""Text for numbers on the wire, and text from the wire made safe to show."""

from __future__ import annotations

import re

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import LabelledEnum
from protocol.names import as_member

MINUTE, HOUR = 60.0, 3600.0  # [s]


def label_of(enum: type[LabelledEnum], number: int) -> str:
    """A number of the dialect in plain words; an unknown number keeps the name of its enum: "law 12"."""
    member = as_member(enum, number)
    if member is not None:
        return member.label
    enum_words = re.sub(r"(?<!^)(?=[A-Z])", " ", enum.__name__).lower()
    return f"{enum_words} {number}"


def command_name(command: int) -> str:
    """A MAV_CMD in lower case and without its prefixes: "nav takeoff"; an unknown one as "command 7"."""
    entry = mavlink.enums["MAV_CMD"].get(command)
    return command_words(entry.name) if entry else f"command {command}"


def command_words(name: str) -> str:
    """Operators' name for a command: "jump to block" of "MAV_CMD_DARKO_JUMP_TO_BLOCK"."""
    words = name.replace("_", " ").lower()
    for prefix in ("mav cmd ", "darko ", "component "):
        words = words.removeprefix(prefix)
    return words


def reason_text(reason: str) -> str:
    """A reason as it is shown: the name of a result in lower case, any other text unchanged."""
    return reason.lower().replace("_", " ") if reason.isupper() else reason


def counted(number: int, what: str) -> str:
    """A number of things: "1 item", "2 items"."""
    return f"{number} {what}{'s' * (number != 1)}"


def format_time(seconds: float) -> str:
    """Minutes and seconds, with hours if there are any: "1:23.2", "1:00:01.0"."""
    minutes, rest = divmod(round(seconds, 1), 60.0)
    hours, minutes = divmod(int(minutes), 60)
    return f"{hours}:{minutes:02d}:{rest:04.1f}" if hours else f"{minutes}:{rest:04.1f}"


def format_age(seconds: float) -> str:
    """A time in one unit, rounded down: "5 s", "3 min", "2 h"."""
    if seconds < MINUTE:
        return f"{int(seconds)} s"
    return f"{int(seconds / MINUTE)} min" if seconds < HOUR else f"{int(seconds / HOUR)} h"


def printable(text: str) -> str:
    """The text with a question mark for every character that could control a terminal."""
    return "".join(character if character.isprintable() else "?" for character in text)
