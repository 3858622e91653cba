"""A grid of braille dots with text on top: two dots across and four down in every cell."""

from __future__ import annotations

import math

__all__ = ["BrailleCanvas", "StyledLine"]

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

    def plot(self, x: float, y: float, style: str = "") -> None:
        """Set one dot; a dot outside the canvas, or with NaN, is ignored."""
        if not (math.isfinite(x) and math.isfinite(y)):
            return
        column, row = math.floor(x), math.floor(y)
        if not (0 <= column < 2 * self.width and 0 <= row < 4 * self.height):
            return
        cell = (row // 4, column // 2)
        self._dots[cell[0]][cell[1]] |= DOT_BITS[row % 4][column % 2]
        if style:
            self._styles[cell[0]][cell[1]] = style

    def line(self, start: tuple[float, float], end: tuple[float, float], style: str = "") -> None:
        """A straight line of dots."""
        (x0, y0), (x1, y1) = start, end
        if not all(math.isfinite(v) and abs(v) < MAX_LINE_END for v in (x0, y0, x1, y1)):
            return
        steps = max(1, math.ceil(max(abs(x1 - x0), abs(y1 - y0))))
        for k in range(steps + 1):
            self.plot(x0 + (x1 - x0) * k / steps, y0 + (y1 - y0) * k / steps, style)

    def put(self, column: int, row: int, text: str, style: str = "") -> None:
        """Text on top of the dots, cut at the edges."""
        if not 0 <= row < self.height:
            return
        for offset, character in enumerate(text):
            if 0 <= column + offset < self.width:
                self._text[row][column + offset] = character
                self._styles[row][column + offset] = style

    def lines(self) -> list[StyledLine]:
        """All rows, each exactly ``width`` cells wide."""
        return [self._line(row) for row in range(self.height)]

    def _line(self, row: int) -> StyledLine:
        segments: StyledLine = []
        for column in range(self.width):
            overlay, dots = self._text[row][column], self._dots[row][column]
            character = overlay if overlay is not None else (chr(FIRST_BRAILLE + dots) if dots else " ")
            style = self._styles[row][column]
            if segments and segments[-1][1] == style:
                segments[-1] = (segments[-1][0] + character, style)
            else:
                segments.append((character, style))
        return segments
