"""Artificial horizon and heading tape."""

from __future__ import annotations

import math

from darko_gcs.render.canvas import Braille, Line
from protocol.frames import Quaternion, Vector, rotate

__all__ = ["attitude", "compass"]

VIEW = math.radians(50.0)  # shown from top to bottom
NAMES = {0: "N", 45: "NE", 90: "E", 135: "SE", 180: "S", 225: "SW", 270: "W", 315: "NW"}
DEGREES_PER_CELL = 5
FARTHEST_TURN = 1e6  # a heading beyond is nonsense [rad]
ARROWS = "→↘↓↙←↖↑↗"
LEAST_TILT = 0.02  # of the ground in the view: below, the horizon is equally far all round [-]


def attitude(q_displayed: Quaternion, *, width: int, height: int) -> list[Line]:
    """The horizon as a camera along the displayed x axis sees it: rolling right tilts it to the left.

    A dot shows ground where its ray points below the horizontal, d . (1, y, z) > 0 with d "down" in the displayed
    axes. That is linear in the dot's place and has no singular attitude, where Euler angles have two. When no
    horizon is in view, an arrow points to where the nearest one is.

    Args:
        q_displayed: Attitude FRD -> NED as it is to be shown, level when hovering upright.
        width: Cells.
        height: Cells.
    """
    canvas = Braille(width, height)
    down = _down(q_displayed)
    if down is None:
        canvas.put(0, height // 2, "--", "dim")
        return canvas.lines()
    per_dot = math.tan(VIEW / 2.0) / (2 * height)  # dots are square
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
    _wings(canvas)
    if not in_view:
        _pointer(canvas, down)
    return canvas.lines()


def _down(q: Quaternion) -> Vector | None:
    """Unit vector down in the displayed axes; None for what is no attitude."""
    norm = math.sqrt(sum(c * c for c in q)) if all(abs(c) < 1e3 for c in q) else 0.0
    if not norm > 1e-3:
        return None
    w, x, y, z = (c / norm for c in q)
    return rotate((w, -x, -y, -z), (0.0, 0.0, 1.0))


def _wings(canvas: Braille) -> None:
    centre = canvas.height // 2
    wing = min(5, max(1, canvas.width // 6))
    canvas.put(canvas.width // 2 - wing - 1, centre, "━" * wing, "warn")
    canvas.put(canvas.width // 2, centre, "◆", "warn")
    canvas.put(canvas.width // 2 + 2, centre, "━" * wing, "warn")


def _pointer(canvas: Braille, down: Vector) -> None:
    """Words on what fills the view, and an arrow at its edge towards the nearest horizon."""
    ground = down[0] > 0.0
    canvas.put(0, 0, "GROUND" if ground else "SKY", "warn")
    tilt = math.hypot(down[1], down[2])
    if tilt < LEAST_TILT:
        return
    sign = -1.0 if ground else 1.0  # away from down where ground is seen, towards it where sky is
    right, low = sign * down[1] / tilt, sign * down[2] / tilt
    column = round((canvas.width - 1) / 2 * (1.0 + right))
    row = round((canvas.height - 1) / 2 * (1.0 + low))
    canvas.put(column, row, ARROWS[round(math.atan2(low, right) / (math.pi / 4)) % 8], "accent")


def compass(heading: float, width: int) -> Line:
    """Heading tape: names and marks slide past the middle, where the heading stands in degrees."""
    degrees = math.degrees(heading) % 360.0 if abs(heading) < FARTHEST_TURN else 0.0  # NaN shows as north
    cells = [" "] * width
    for column in range(width):
        at = degrees + (column - width // 2) * DEGREES_PER_CELL
        nearest = round(at / 15.0) * 15
        if abs(at - nearest) < DEGREES_PER_CELL / 2:
            cells[column] = "·" if nearest % 45 else "|"
    for direction, name in NAMES.items():
        off = math.remainder(direction - degrees, 360.0) / DEGREES_PER_CELL
        column = width // 2 + round(off)
        for k, letter in enumerate(name):
            if 0 <= column + k < width:
                cells[column + k] = letter
    words = f"[{round(degrees) % 360:03d}°]"
    begin = max(0, width // 2 - len(words) // 2)
    text = "".join(cells)
    return [(text[:begin], "dim"), (words[: width - begin], "accent"), (text[begin + len(words) :], "dim")]
