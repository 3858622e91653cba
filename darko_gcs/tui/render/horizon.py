"""Instruments in cells: artificial horizon, heading tape, vertical tapes, and bars in eighths of a cell."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import groupby

from darko_gcs.tui.render.canvas import BrailleCanvas, StyledLine
from protocol.frames import Quaternion, Vector, rotate

EIGHTH_BLOCKS = " ▏▎▍▌▋▊▉█"
COMMAND_MARK = "│"


def bar(
    value: float | None,
    low: float,
    high: float,
    *,
    width: int,
    command: float | None = None,
    saturated: bool = False,
    centre: float | None = None,
) -> StyledLine:
    """A value between its limits, filled from ``low`` or from ``centre``.

    Args:
        value: None or NaN gives dashes.
        low: At the left edge.
        high: At the right edge.
        width: Cells.
        command: Shown by a mark.
        saturated: Use the style "bad".
        centre: Where the bar begins, for values of both signs.
    """
    if value is None or not math.isfinite(value) or not high > low:
        return [("-" * width, "dim")]
    end = _share(value, low, high)
    begin = 0.0 if centre is None else _share(centre, low, high)
    cells = _fill(min(end, begin) * width, max(end, begin) * width, width)
    style = "bad" if saturated else "track"
    if command is None or not math.isfinite(command):
        return [("".join(cells), style)]
    mark = min(width - 1, int(_share(command, low, high) * width))
    return [("".join(cells[:mark]), style), (COMMAND_MARK, "accent"), ("".join(cells[mark + 1 :]), style)]


def _share(value: float, low: float, high: float) -> float:
    return min(max((value - low) / (high - low), 0.0), 1.0)


def _fill(begin: float, end: float, width: int) -> list[str]:
    cells = []
    for cell in range(width):
        filled = max(0.0, min(end, cell + 1.0) - max(begin, float(cell)))
        if begin > cell and filled > 0.0:  # blocks fill from the left: the left end of a bar is a whole or half cell
            cells.append("▐" if filled < 0.75 else "█")
        else:
            cells.append(EIGHTH_BLOCKS[round(8 * filled)])
    return cells


ROWS_PER_NUMBER = 4  # of the scale
MAX_ON_TAPE = 1e5  # larger ones are not shown


def tape(
    value: float | None, *, title: str, per_row: float, width: int, height: int, least: float = -math.inf
) -> list[StyledLine]:
    """The rows of a tape, larger values above.

    Args:
        value: Stands in the middle row; dashes for None and NaN.
        title: In the first row.
        per_row: What a row adds to the value.
        width: Cells.
        height: Cells.
        least: Smallest value of the scale.
    """
    middle = height // 2
    at = math.nan if value is None else value
    values = [at + (middle - row) * per_row for row in range(height)]
    rows: list[StyledLine] = [[(_scale_text(v, per_row, width, least), "dim")] for v in values]
    number = f"{round(at, 1) + 0.0:.1f}" if abs(at) < MAX_ON_TAPE else "--"
    rows[middle] = [(f"▶{number:>{width - 2}} "[:width], "accent")]
    rows[0] = [(f"{title:>{width - 1}} "[:width], "label")]
    return rows


def _scale_text(value: float, per_row: float, width: int, least: float) -> str:
    """A number where a round one lies in the row, else a mark; nothing below the scale."""
    if not abs(value) < MAX_ON_TAPE or value < least - per_row / 2:
        return " " * width
    step = ROWS_PER_NUMBER * per_row
    nearest = round(value / step) * step
    is_number = -per_row / 2 <= nearest - value < per_row / 2
    return (f"{nearest + 0.0:g} ─" if is_number else "·").rjust(width)


FIELD_OF_VIEW = math.radians(50.0)  # from top to bottom
DIRECTION_NAMES = {0: "N", 45: "NE", 90: "E", 135: "SE", 180: "S", 225: "SW", 270: "W", 315: "NW"}
DEGREES_PER_CELL = 5
MAX_HEADING = 1e6  # a larger heading is nonsense [rad]
LOWER_BLOCKS = "▁▂▃▄▅▆▇"  # eighths of a cell
ARROWS_FROM_RIGHT = "→↘↓↙←↖↑↗"  # clockwise, 45 deg apart
MIN_STEP = 1e-9  # between the depths of neighbours in a row that the horizon may cross
MIN_TILT = 0.02  # of the vertical against the line of sight, for the arrow to have a direction [-]


def horizon(q_displayed: Quaternion, *, width: int, height: int) -> list[StyledLine]:
    """The horizon as a camera along the displayed x axis sees it: rolling right tilts it to the left.

    Sky and ground fill the view. A dot shows ground where its ray points below the horizontal, d . (1, y, z) > 0 with
    d "down" in the displayed axes. That is linear in the dot's place and has no singular attitude, where Euler angles
    have two. Without a horizon in view, an arrow points to the nearest one.

    Args:
        q_displayed: Attitude FRD -> NED as it is to be shown, level in an upright hover.
        width: Cells.
        height: Cells.
    """
    down = _down(q_displayed)
    if down is None:
        canvas = BrailleCanvas(width, height)
        canvas.put(0, height // 2, "--", "dim")
        return canvas.lines()
    per_dot = math.tan(FIELD_OF_VIEW / 2.0) / (2 * height)  # dots are square
    across, below = down[1] * per_dot, down[2] * per_dot

    def depth(x: float, y: float) -> float:
        return down[0] + across * (x - width + 0.5) + below * (y - 2 * height + 0.5)

    reach = 0.5 * abs(across) + 1.5 * abs(below)  # how much the depth differs within a cell
    cells = [_row(depth, reach, 2.0 * across, row, width) for row in range(height)]
    is_one = len({style for line in cells for _, style in line}) == 1  # all sky, or all ground
    _draw_wings(cells)
    if is_one:
        _draw_arrow(cells, down)
    return [_joined(line) for line in cells]


def _row(
    depth: Callable[[float, float], float], reach: float, step: float, row: int, width: int
) -> list[tuple[str, str]]:
    """A row: only around the horizon its cells are looked at one by one; ``step`` is between their depths."""
    first = depth(0.5, 4 * row + 1.5)
    last = first + step * (width - 1)
    if min(abs(first), abs(last)) > reach and (first > 0.0) is (last > 0.0):
        return _plain("ground" if first > 0.0 else "sky", row, 0, width)
    if abs(step) < MIN_STEP:
        return [_cell(depth, reach, column, row) for column in range(width)]
    ends = sorted(((-reach - first) / step, (reach - first) / step))
    begin, end = (min(max(math.floor(ends[0]), 0), width), min(max(math.ceil(ends[1]) + 1, 0), width))
    left, right = ("sky", "ground") if step > 0.0 else ("ground", "sky")
    middle = [_cell(depth, reach, column, row) for column in range(begin, end)]
    return [*_plain(left, row, 0, begin), *middle, *_plain(right, row, end, width)]


def _plain(style: str, row: int, begin: int, end: int) -> list[tuple[str, str]]:
    """Cells of sky or ground alone; the ground has dots, to be told without colours."""
    if style == "sky":
        return [(" ", style)] * (end - begin)
    return [("·" if (column + 2 * row) % 4 == 0 else " ", style) for column in range(begin, end)]


def _cell(depth: Callable[[float, float], float], reach: float, column: int, row: int) -> tuple[str, str]:
    """Sky, ground, or the share of both in a cell."""
    middle = depth(2 * column + 0.5, 4 * row + 1.5)
    if abs(middle) > reach:
        return _plain("ground" if middle > 0.0 else "sky", row, column, column + 1)[0]
    dots = [[depth(2 * column + x, 4 * row + y) > 0.0 for x in range(2)] for y in range(4)]
    ground = sum(map(sum, dots))
    if ground in {0, 8}:
        return (" ", "sky") if ground == 0 else (" ", "ground")
    low = sum(map(sum, dots[2:]))
    if low > ground - low:
        return LOWER_BLOCKS[ground - 1], "ground-on-sky"
    if low < ground - low:
        return LOWER_BLOCKS[7 - ground], "sky-on-ground"
    return "▌", "ground-on-sky" if sum(line[0] for line in dots) > sum(line[1] for line in dots) else "sky-on-ground"


def _joined(cells: Sequence[tuple[str, str]]) -> StyledLine:
    """The cells of a row with neighbours of one style in one segment."""
    return [("".join(text for text, _ in group), style) for style, group in groupby(cells, key=lambda cell: cell[1])]


def _put(cells: list[list[tuple[str, str]]], column: int, row: int, text: str) -> None:
    """Text in the colours of symbols, on the sky or ground that is there."""
    for offset, character in enumerate(text):
        if 0 <= row < len(cells) and 0 <= column + offset < len(cells[row]):
            on = "ground" if cells[row][column + offset][1] in {"ground", "sky-on-ground"} else "sky"
            cells[row][column + offset] = (character, f"symbol-on-{on}")


def _down(q: Quaternion) -> Vector | None:
    """Unit vector down in the displayed axes; None if ``q`` is no attitude."""
    norm = math.sqrt(sum(c * c for c in q)) if all(abs(c) < 1e3 for c in q) else 0.0
    if not norm > 1e-3:
        return None
    w, x, y, z = (c / norm for c in q)
    return rotate((w, -x, -y, -z), (0.0, 0.0, 1.0))


def _draw_wings(cells: list[list[tuple[str, str]]]) -> None:
    width, centre = len(cells[0]), len(cells) // 2
    wing = min(5, max(1, width // 6))
    _put(cells, width // 2 - wing - 1, centre, "━" * wing)
    _put(cells, width // 2, centre, "◆")
    _put(cells, width // 2 + 2, centre, "━" * wing)


def _draw_arrow(cells: list[list[tuple[str, str]]], down: Vector) -> None:
    """SKY or GROUND, which fills the view, and an arrow at the edge towards the nearest horizon."""
    ground = down[0] > 0.0
    _put(cells, 0, 0, "GROUND" if ground else "SKY")
    tilt = math.hypot(down[1], down[2])
    if tilt < MIN_TILT:
        return
    sign = -1.0 if ground else 1.0  # the horizon is up from the ground, down from the sky
    right, low = sign * down[1] / tilt, sign * down[2] / tilt
    column = round((len(cells[0]) - 1) / 2 * (1.0 + right))
    row = round((len(cells) - 1) / 2 * (1.0 + low))
    _put(cells, column, row, ARROWS_FROM_RIGHT[round(math.atan2(low, right) / (math.pi / 4)) % 8])


def heading_tape(heading: float, width: int) -> StyledLine:
    """Heading tape: directions and marks move past the heading in degrees, which stands in the middle.

    Args:
        heading: Any turn [rad].
        width: Cells.
    """
    degrees = math.degrees(heading) % 360.0 if abs(heading) < MAX_HEADING else 0.0  # NaN is shown as north
    text = f"[{round(degrees) % 360:03d}°]"
    begin = max(0, width // 2 - len(text) // 2)
    cells = [" "] * width
    for column in range(width):
        at = degrees + (column - width // 2) * DEGREES_PER_CELL
        nearest = round(at / 15.0) * 15
        if abs(at - nearest) < DEGREES_PER_CELL / 2:
            cells[column] = "·" if nearest % 45 else "|"
    for direction, name in DIRECTION_NAMES.items():
        off = math.remainder(direction - degrees, 360.0) / DEGREES_PER_CELL
        column = width // 2 + round(off)
        is_whole = column >= 0 and column + len(name) <= width
        if is_whole and (column + len(name) <= begin or column >= begin + len(text)):  # a cut NW reads as N
            cells[column : column + len(name)] = name
    tape = "".join(cells)
    return [(tape[:begin], "dim"), (text[: width - begin], "accent"), (tape[begin + len(text) :], "dim")]
