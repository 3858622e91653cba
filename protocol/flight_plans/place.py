"""Place of an element in a flight plan's file, and the error that names it."""

from __future__ import annotations

import re
from dataclasses import dataclass

from protocol.errors import FileError

__all__ = ["NOWHERE", "FlightPlanError", "Place", "SourceText"]

_CHARACTER = re.compile(r"&[^;\s]*;|.", re.DOTALL)  # a reference stands for one character


@dataclass(frozen=True, slots=True)
class Place:
    """A character of a file; lines and columns count from 1."""

    file: str
    line: int
    column: int

    def __str__(self) -> str:
        return f"{self.file}:{self.line}:{self.column}"

    def after(self, text: str) -> Place:
        """The place behind a text that begins here."""
        lines = text.split("\n")
        if len(lines) == 1:
            return Place(self.file, self.line, self.column + len(text))
        return Place(self.file, self.line + len(lines) - 1, len(lines[-1]) + 1)


NOWHERE = Place("", 0, 0)  # of what no file holds


@dataclass(frozen=True, slots=True)
class SourceText:
    """The value of an attribute, and how it was written."""

    text: str  # as XML means it
    place: Place  # of its first character
    raw: str  # as it stands in the file, with references

    def at(self, index: int) -> Place:
        """The place of a character of ``text``."""
        written = "".join(match.group() for match, _ in zip(_CHARACTER.finditer(self.raw), range(index), strict=False))
        return self.place.after(written)


class FlightPlanError(FileError):
    """A flight plan cannot be read or flown: file, line, column and reason in one line.

    Attributes:
        place: Where the fault is.
        reason: What it is.
    """

    def __init__(self, place: Place, reason: str) -> None:
        super().__init__(f"{place}: {reason}" if place.line else f"{place.file}: {reason}")
        self.place, self.reason = place, reason
