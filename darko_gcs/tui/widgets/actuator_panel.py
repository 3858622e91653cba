"""The panel of the motors and elevons."""

from __future__ import annotations

import math

from darko_gcs.state.snapshot import Snapshot
from darko_gcs.state.values import Actuators
from darko_gcs.tui.render.bar import bar
from darko_gcs.tui.render.canvas import StyledLine
from darko_gcs.tui.widgets.panel import Panel, styled_line
from protocol.dialect.vocabulary import Limit

SATURATION_SHOWN = 1.0  # for which a saturated axis stays in view [s]
MOTOR_LIMITS = (("L", Limit.MOTOR_LEFT), ("R", Limit.MOTOR_RIGHT))
ELEVON_LIMITS = (("L", Limit.ELEVON_LEFT), ("R", Limit.ELEVON_RIGHT))
POSITION_LIMITS = Limit.MOTOR_LEFT | Limit.MOTOR_RIGHT | Limit.ELEVON_LEFT | Limit.ELEVON_RIGHT
PULSES = (1000.0, 2000.0)  # of a servo from end to end [us]
SERVO_TEXT_WIDTH = 13  # number and pulse beside a bar [cells]
TEXT_WIDTH = 17  # name and value beside a bar [cells]


class ActuatorPanel(Panel):
    """Motors and elevons between their limits."""

    SOURCES = ("DARKO_ACTUATORS", "SERVO_OUTPUT_RAW")

    def draw(self, s: Snapshot, width: int, height: int) -> list[StyledLine]:
        """A line per actuator, then limits and saturated axes, in one line if there is no room for two."""
        a = s.actuators
        if a is None:
            return _servos(s.servos, width, height)
        room = max(4, width - TEXT_WIDTH)
        lines = [_motor(a, side, room) for side in range(2)] + [_elevon(a, side, room) for side in range(2)]
        limits, saturated = _limits(a.limits), _saturated(s)
        if height > len(lines) + 1:
            return [*lines, limits, saturated]
        return [*lines, saturated or limits]


def _servos(pulses: tuple[int, ...], width: int, height: int) -> list[StyledLine]:
    """The driven outputs of a vehicle that tells their pulses only, in two columns if one has no room."""
    driven = [(number, pulse) for number, pulse in enumerate(pulses, 1) if pulse]
    if not driven:
        return [styled_line(("no actuator state", "dim"))]
    columns = 1 if len(driven) <= height else 2
    rows = -(-len(driven) // columns)
    cells = [_servo(number, pulse, width // columns) for number, pulse in driven]
    return [[part for cell in cells[row::rows] for part in cell] for row in range(rows)]


def _servo(number: int, pulse: int, width: int) -> StyledLine:
    cells = bar(pulse, *PULSES, width=max(2, width - SERVO_TEXT_WIDTH))
    return [(f"S{number:<3}", "label"), *cells, (f"{pulse:5d} us ", "")]


def _motor(a: Actuators, side: int, width: int) -> StyledLine:
    name, limit = MOTOR_LIMITS[side]
    hit = limit in a.limits
    cells = bar(a.motor[side], 0.0, a.motor_max, width=width, command=a.motor_command[side], saturated=hit)
    return [(f"M{name} ", "label"), *cells, (f"{a.motor[side]:5.0f} rad/s", "bad" if hit else "")]


def _elevon(a: Actuators, side: int, width: int) -> StyledLine:
    name, limit = ELEVON_LIMITS[side]
    hit, high = limit in a.limits, a.elevon_max
    command = a.elevon_command[side]
    cells = bar(a.elevon[side], -high, high, width=width, command=command, saturated=hit, centre=0.0)
    return [(f"E{name} ", "label"), *cells, (f"{math.degrees(a.elevon[side]):+7.1f} deg", "bad" if hit else "")]


def _limits(limits: Limit) -> StyledLine:
    if not limits.label:
        return styled_line(("within all limits", "dim"))
    return styled_line((f"at limit: {limits.label}", "bad" if limits & POSITION_LIMITS else "warn"))


def _saturated(s: Snapshot) -> StyledLine:
    """Axes on which the control allocation saturates now (bad) or did within the last second (warn)."""
    now, is_saturated = s.boot or 0.0, s.actuators is not None and s.actuators.saturation
    recent = [axis.label for axis, at in sorted(s.saturated_at.items()) if now - at <= SATURATION_SHOWN]
    if not recent:
        return []
    return styled_line(("saturated: " + ", ".join(recent), "bad" if is_saturated else "warn"))
