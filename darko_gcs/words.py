"""Words for what is on the wire, and words from the wire, made safe to show."""

from __future__ import annotations

import re
from typing import TypeVar

from protocol.dialect.vocabulary import Word

__all__ = ["clock", "known", "label", "name", "printable"]

Known = TypeVar("Known", bound=Word)


def known(kind: type[Known], number: int) -> Known | None:
    """A number of the dialect as its member; None where a newer vehicle may have one that this program does not."""
    try:
        return kind(number)
    except ValueError:
        return None


def label(kind: type[Word], number: int) -> str:
    """A number of the dialect in plain words; an unknown one with its kind: "law 12"."""
    member = known(kind, number)
    words = re.sub(r"(?<!^)(?=[A-Z])", " ", kind.__name__).lower()
    return f"{words} {number}" if member is None else member.label


def name(kind: type[Word], number: int) -> str:
    """A number of the dialect as programs name it, or the number."""
    member = known(kind, number)
    return str(number) if member is None else member.name


def clock(seconds: float) -> str:
    """Minutes and seconds."""
    return f"{int(seconds // 60)}:{seconds % 60:04.1f}"


def printable(text: str) -> str:
    """Text without what could command a terminal: each such character becomes a question mark."""
    return "".join(character if character.isprintable() else "?" for character in text)
