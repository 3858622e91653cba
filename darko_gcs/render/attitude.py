"""Artificial horizon and heading tape."""

from __future__ import annotations

import math

from darko_gcs.render.canvas import Braille, Line
from protocol.frames import Quaternion, euler_from_quaternion

__all__ = ["attitude", "compass"]

PITCH_SPAN = math.radians(50.0)  # shown from top to bottom
NAMES = {0: "N", 45: "NE", 90: "E", 135: "SE", 180: "S", 225: "SW", 270: "W", 315: "NW"}
DEGREES_PER_CELL = 5
FARTHEST_TURN = 1e6  # a heading beyond is nonsense [rad]


def attitude(q_displayed: Quaternion, *, width: int, height: int) -> list[Line]:
    """The horizon as it is seen along the displayed x axis: rolling right tilts it to the left.

    Args:
        q_displayed: Attitude FRD -> NED as it is to be shown, level when hovering upright.
        width: Cells.
        height: Cells.
    """
    canvas = Braille(width, height)
    roll, pitch, _ = euler_from_quaternion(q_displayed)
    if not (math.isfinite(roll) and math.isfinite(pitch)):
        canvas.put(0, height // 2, "--", "dim")
        return canvas.lines()
    dots_per_radian = 4 * height / PITCH_SPAN
    for x in range(2 * width):
        across = x - width + 0.5
        horizon = 2 * height + math.tan(_short_of_vertical(-roll)) * across + pitch * dots_per_radian / math.cos(roll)
        inverted = math.cos(roll) < 0.0
        for y in range(4 * height):
            below = y > horizon
            if abs(y - horizon) <= 0.5:
                canvas.plot(x, y, "accent")
            elif below != inverted and (x + y) % 4 == 0 and x % 2 == 0:
                canvas.plot(x, y, "plan")
    centre = height // 2
    wing = min(5, max(1, width // 6))
    canvas.put(width // 2 - wing - 1, centre, "━" * wing, "warn")
    canvas.put(width // 2, centre, "◆", "warn")
    canvas.put(width // 2 + 2, centre, "━" * wing, "warn")
    return canvas.lines()


def _short_of_vertical(angle: float) -> float:
    """An angle whose tangent is finite."""
    turned = math.remainder(angle, math.pi)
    return max(-1.55, min(1.55, turned))


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
