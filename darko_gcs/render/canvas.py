"""A grid of braille dots with text laid over it: two dots across and four down in every cell."""

from __future__ import annotations

import math

__all__ = ["Braille", "Line"]

Line = list[tuple[str, str]]  # segments (text, style name)
BLANK = 0x2800
DOTS = ((0x01, 0x08), (0x02, 0x10), (0x04, 0x20), (0x40, 0x80))  # by row, then column
FARTHEST = 4096  # dots beyond the canvas that a line may begin: farther ones are not followed


class Braille:
    """``width`` by ``height`` cells; dots are addressed from the top left."""

    def __init__(self, width: int, height: int) -> None:
        self.width, self.height = width, height
        self._dots = [[0] * width for _ in range(height)]
        self._styles = [[""] * width for _ in range(height)]
        self._text: list[list[str | None]] = [[None] * width for _ in range(height)]

    def plot(self, x: float, y: float, style: str = "") -> None:
        """Set one dot; outside the canvas, or not a number, it is left out."""
        if not (math.isfinite(x) and math.isfinite(y)):
            return
        column, row = math.floor(x), math.floor(y)
        if not (0 <= column < 2 * self.width and 0 <= row < 4 * self.height):
            return
        cell = (row // 4, column // 2)
        self._dots[cell[0]][cell[1]] |= DOTS[row % 4][column % 2]
        if style:
            self._styles[cell[0]][cell[1]] = style

    def line(self, x0: float, y0: float, x1: float, y1: float, style: str = "") -> None:
        """A straight line of dots."""
        if not all(math.isfinite(v) and abs(v) < FARTHEST for v in (x0, y0, x1, y1)):
            return
        steps = max(1, math.ceil(max(abs(x1 - x0), abs(y1 - y0))))
        for k in range(steps + 1):
            self.plot(x0 + (x1 - x0) * k / steps, y0 + (y1 - y0) * k / steps, style)

    def put(self, column: int, row: int, text: str, style: str = "") -> None:
        """Text over the dots, cut at the edges."""
        if not 0 <= row < self.height:
            return
        for offset, character in enumerate(text):
            if 0 <= column + offset < self.width:
                self._text[row][column + offset] = character
                self._styles[row][column + offset] = style

    def lines(self) -> list[Line]:
        """The picture, each line of exactly ``width`` cells."""
        return [self._line(row) for row in range(self.height)]

    def _line(self, row: int) -> Line:
        segments: Line = []
        for column in range(self.width):
            overlay, dots = self._text[row][column], self._dots[row][column]
            character = overlay if overlay is not None else (chr(BLANK + dots) if dots else " ")
            style = self._styles[row][column]
            if segments and segments[-1][1] == style:
                segments[-1] = (segments[-1][0] + character, style)
            else:
                segments.append((character, style))
        return segments
