"""A grid of braille dots with text on top: two dots across and four down in every cell."""

from __future__ import annotations

import math
from itertools import groupby

StyledLine = list[tuple[str, str]]  # segments (text, style name)
FIRST_BRAILLE = 0x2800  # code point without dots
DOT_BITS = ((0x01, 0x08), (0x02, 0x10), (0x04, 0x20), (0x40, 0x80))  # by row, then column
MAX_LINE_END = 4096  # coordinate of a line's ends; a line with a larger one is not drawn [dots]


class BrailleCanvas:
    """``width`` by ``height`` cells; dots are counted from the top left."""

    def __init__(self, width: int, height: int) -> None:
        self.width, self.height = width, height
        self._dots = [[0] * width for _ in range(height)]
        self._styles = [[""] * width for _ in range(height)]
        self._text: list[list[str | None]] = [[None] * width for _ in range(height)]
        self._lines: list[StyledLine | None] = [None] * height  # rows put together since they were last drawn on

    def copy(self) -> BrailleCanvas:
        """A canvas to draw on, which leaves this one as it is; rows without anything new are not put together again."""
        new = BrailleCanvas(0, 0)
        new.width, new.height = self.width, self.height
        new._dots, new._styles = [row.copy() for row in self._dots], [row.copy() for row in self._styles]
        new._text, new._lines = [row.copy() for row in self._text], list(self.lines())
        return new

    def plot(self, x: float, y: float, style: str = "") -> None:
        """Set one dot; a dot outside the canvas, or with NaN, is ignored."""
        if not (0.0 <= x < 2 * self.width and 0.0 <= y < 4 * self.height):  # false for NaN too
            return
        column, row = int(x), int(y)
        self._lines[row >> 2] = None
        self._dots[row >> 2][column >> 1] |= DOT_BITS[row & 3][column & 1]
        if style:
            self._styles[row >> 2][column >> 1] = style

    def line(self, start: tuple[float, float], end: tuple[float, float], style: str = "") -> None:
        """A straight line of dots."""
        (x0, y0), (x1, y1) = start, end
        if not (
            abs(x0) < MAX_LINE_END and abs(y0) < MAX_LINE_END and abs(x1) < MAX_LINE_END and abs(y1) < MAX_LINE_END
        ):
            return  # NaN ends here, too
        steps = max(1, math.ceil(max(abs(x1 - x0), abs(y1 - y0))))
        for k in range(steps + 1):
            self.plot(x0 + (x1 - x0) * k / steps, y0 + (y1 - y0) * k / steps, style)

    def put(self, column: int, row: int, text: str, style: str = "") -> None:
        """Text on top of the dots, cut at the edges."""
        if not 0 <= row < self.height:
            return
        self._lines[row] = None
        for offset, character in enumerate(text):
            if 0 <= column + offset < self.width:
                self._text[row][column + offset] = character
                self._styles[row][column + offset] = style

    def has_room(self, column: int, row: int, text: str) -> bool:
        """True if a text is whole there, on no other one, and does not read as one with its neighbours."""
        end = column + len(text)
        if not (text and 0 <= row < self.height and column >= 0 and end <= self.width):
            return False
        before = (self._text[row][column - 1] if column else None) or " "
        after = (self._text[row][end] if end < self.width else None) or " "
        joins = (before.isalnum() and text[0].isalnum()) or (text[-1].isalnum() and after.isalnum())
        return not joins and not any(self._text[row][column:end])

    def lines(self) -> list[StyledLine]:
        """All rows, each exactly ``width`` cells wide."""
        lines = [line or self._line(row) for row, line in enumerate(self._lines)]
        self._lines = [*lines]
        return lines

    def _line(self, row: int) -> StyledLine:
        dots, text, styles = self._dots[row], self._text[row], self._styles[row].copy()
        if not any(dots) and not any(text):
            return [(" " * self.width, styles[0])] if self.width else []
        characters = [
            overlay or (chr(FIRST_BRAILLE + dot) if dot else " ") for overlay, dot in zip(text, dots, strict=True)
        ]
        for column, character in enumerate(characters):
            if character == " " and column:  # a blank has no colour: fewer segments
                styles[column] = styles[column - 1]
        segments, begin = [], 0
        for style, group in groupby(styles):
            end = begin + len(list(group))
            segments.append(("".join(characters[begin:end]), style))
            begin = end
        return segments
