"""Artificial horizon and heading tape."""

from __future__ import annotations

import math

from darko_gcs.tui.render.canvas import BrailleCanvas, StyledLine
from protocol.frames import Quaternion, Vector, rotate

__all__ = ["heading_tape", "horizon"]

FIELD_OF_VIEW = math.radians(50.0)  # from top to bottom
DIRECTION_NAMES = {0: "N", 45: "NE", 90: "E", 135: "SE", 180: "S", 225: "SW", 270: "W", 315: "NW"}
DEGREES_PER_CELL = 5
MAX_HEADING = 1e6  # a larger heading is nonsense [rad]
ARROWS_FROM_RIGHT = "→↘↓↙←↖↑↗"  # clockwise, 45 deg apart
MIN_TILT = 0.02  # of the vertical against the line of sight, for the arrow to have a direction [-]


def horizon(q_displayed: Quaternion, *, width: int, height: int) -> list[StyledLine]:
    """The horizon as a camera along the displayed x axis sees it: rolling right tilts it to the left.

    A dot shows ground where its ray points below the horizontal, d . (1, y, z) > 0 with d "down" in the displayed
    axes. That is linear in the dot's place and has no singular attitude, where Euler angles have two. Without a
    horizon in view, an arrow points to the nearest one.

    Args:
        q_displayed: Attitude FRD -> NED as it is to be shown, level in an upright hover.
        width: Cells.
        height: Cells.
    """
    canvas = BrailleCanvas(width, height)
    down = _down(q_displayed)
    if down is None:
        canvas.put(0, height // 2, "--", "dim")
        return canvas.lines()
    per_dot = math.tan(FIELD_OF_VIEW / 2.0) / (2 * height)  # dots are square
    across, below = down[1] * per_dot, down[2] * per_dot
    slope = math.hypot(across, below)
    in_view = False
    for y in range(4 * height):
        for x in range(2 * width):
            depth = down[0] + across * (x - width + 0.5) + below * (y - 2 * height + 0.5)
            if abs(depth) <= 0.5 * slope:
                canvas.plot(x, y, "accent")
                in_view = True
            elif depth > 0.0 and (x + y) % 4 == 0 and x % 2 == 0:
                canvas.plot(x, y, "plan")
    _draw_wings(canvas)
    if not in_view:
        _draw_arrow(canvas, down)
    return canvas.lines()


def _down(q: Quaternion) -> Vector | None:
    """Unit vector down in the displayed axes; None if ``q`` is no attitude."""
    norm = math.sqrt(sum(c * c for c in q)) if all(abs(c) < 1e3 for c in q) else 0.0
    if not norm > 1e-3:
        return None
    w, x, y, z = (c / norm for c in q)
    return rotate((w, -x, -y, -z), (0.0, 0.0, 1.0))


def _draw_wings(canvas: BrailleCanvas) -> None:
    centre = canvas.height // 2
    wing = min(5, max(1, canvas.width // 6))
    canvas.put(canvas.width // 2 - wing - 1, centre, "━" * wing, "warn")
    canvas.put(canvas.width // 2, centre, "◆", "warn")
    canvas.put(canvas.width // 2 + 2, centre, "━" * wing, "warn")


def _draw_arrow(canvas: BrailleCanvas, down: Vector) -> None:
    """SKY or GROUND, which fills the view, and an arrow at the edge towards the nearest horizon."""
    ground = down[0] > 0.0
    canvas.put(0, 0, "GROUND" if ground else "SKY", "warn")
    tilt = math.hypot(down[1], down[2])
    if tilt < MIN_TILT:
        return
    sign = -1.0 if ground else 1.0  # the horizon is up from the ground, down from the sky
    right, low = sign * down[1] / tilt, sign * down[2] / tilt
    column = round((canvas.width - 1) / 2 * (1.0 + right))
    row = round((canvas.height - 1) / 2 * (1.0 + low))
    canvas.put(column, row, ARROWS_FROM_RIGHT[round(math.atan2(low, right) / (math.pi / 4)) % 8], "accent")


def heading_tape(heading: float, width: int) -> StyledLine:
    """Heading tape: directions and marks move past the heading in degrees, which stands in the middle.

    Args:
        heading: Any turn [rad].
        width: Cells.
    """
    degrees = math.degrees(heading) % 360.0 if abs(heading) < MAX_HEADING else 0.0  # NaN is shown as north
    cells = [" "] * width
    for column in range(width):
        at = degrees + (column - width // 2) * DEGREES_PER_CELL
        nearest = round(at / 15.0) * 15
        if abs(at - nearest) < DEGREES_PER_CELL / 2:
            cells[column] = "·" if nearest % 45 else "|"
    for direction, name in DIRECTION_NAMES.items():
        off = math.remainder(direction - degrees, 360.0) / DEGREES_PER_CELL
        column = width // 2 + round(off)
        for k, letter in enumerate(name):
            if 0 <= column + k < width:
                cells[column + k] = letter
    text = f"[{round(degrees) % 360:03d}°]"
    begin = max(0, width // 2 - len(text) // 2)
    tape = "".join(cells)
    return [(tape[:begin], "dim"), (text[: width - begin], "accent"), (tape[begin + len(text) :], "dim")]
