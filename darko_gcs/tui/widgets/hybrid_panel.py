"""Panels of attitude, motors and elevons, and the hybrid controller: law in force, Lyapunov values, jumps."""

from __future__ import annotations

import math
from textwrap import wrap

from darko_gcs.state.snapshot import Snapshot
from darko_gcs.state.text import jump_cause, v_text
from darko_gcs.state.values import Actuators, HybridState, Thresholds
from darko_gcs.tui.render.canvas import StyledLine
from darko_gcs.tui.render.chart import chart_edge, log_chart
from darko_gcs.tui.render.horizon import bar, heading_tape, horizon, tape
from darko_gcs.tui.widgets.panel import Panel, styled_line
from protocol.dialect.vocabulary import Law, Limit
from protocol.frames import SHOW_AS_TOLD, SHOW_PITCHED_DOWN, Quaternion, displayed, euler_from_quaternion, rotate
from protocol.names import as_member, law_label

NOSE = (1.0, 0.0, 0.0)  # in the body frame
TAPE_WIDTH = 9  # [cells]
TAPES_WIDTH, TAPE_ROWS = 34, 7  # of a panel that has room for both tapes [cells]
HALF_PITCHED = math.sin(math.pi / 4.0)  # how far down the nose of a display points that is pitched by half of 90 deg
MAX_BANK_ELEVATION = 75.0  # nose elevation above which a bank angle means nothing [deg]


def display_offset(s: Snapshot) -> Quaternion:
    """Rotation of the attitude for display: the vehicle's offset in hover, none in forward flight.

    It changes once per transition, at its end, when the nose is where the new view has its level. A tail-sitter that
    sends no offset is shown pitched down in hover, any other vehicle as it flies.
    """
    if s.status.is_forward:
        return SHOW_AS_TOLD
    if s.attitude.repr_offset is not None:
        return s.attitude.repr_offset
    return SHOW_PITCHED_DOWN if s.identity.tells_hover_frame else SHOW_AS_TOLD


class AttitudePanel(Panel):
    """Horizon, heading tape and nose elevation; the title says if the view is that of the hover (level is nose-up).

    Where there is room, tapes of airspeed and height stand beside the horizon.
    """

    SOURCES = ("ATTITUDE_QUATERNION", "ATTITUDE")

    def watch_snapshot(self) -> None:
        """Show a new snapshot, with the view named in the title."""
        title = "Attitude: nose-up is level" if _is_hover_view(self.snapshot) else "Attitude"
        if self.border_title != title:
            self.border_title = title
        super().watch_snapshot()

    def draw(self, s: Snapshot, width: int, height: int) -> list[StyledLine]:
        """Heading tape, horizon, one line of angles."""
        if s.attitude.q is None:
            return [styled_line(("no attitude", "dim"))]
        rows = max(1, height - 2)
        tapes = width >= TAPES_WIDTH and rows >= TAPE_ROWS
        view = horizon(displayed(s.attitude.q, display_offset(s)), width=width - 2 * TAPE_WIDTH * tapes, height=rows)
        if tapes:
            left, right = self._speed(s, rows), self._height(s, rows)
            view = [[*a, *b, *c] for a, b, c in zip(left, view, right, strict=True)]
        return [heading_tape(s.attitude.heading or 0.0, width), *view, _angles(s.attitude.q, hover=_is_hover_view(s))]

    def _speed(self, s: Snapshot, rows: int) -> list[StyledLine]:
        title = self.age_text(s, "VFR_HUD") or ("est. m/s" if s.status.has_measured_air is False else "air m/s")
        return tape(s.estimates.airspeed, title=title, per_row=0.5, width=TAPE_WIDTH, height=rows, least=0.0)

    def _height(self, s: Snapshot, rows: int) -> list[StyledLine]:
        height = s.position.relative_altitude if s.position.from_home is None else -s.position.from_home[2]
        title = self.age_text(s, "LOCAL_POSITION_NED", "GLOBAL_POSITION_INT") or "height m"
        return tape(height, title=title, per_row=0.5, width=TAPE_WIDTH, height=rows)


def _is_hover_view(s: Snapshot) -> bool:
    return rotate(display_offset(s), NOSE)[2] > HALF_PITCHED


def _angles(q: Quaternion, *, hover: bool) -> StyledLine:
    elevation = math.degrees(math.asin(max(-1.0, min(1.0, -rotate(q, NOSE)[2]))))
    nose = styled_line(("nose ", "label"), f"{elevation:+.0f}°")
    if hover:
        return [*nose, ("  tilt ", "label"), (f"{90.0 - elevation:.0f}°", "")]
    bank = f"{math.degrees(euler_from_quaternion(q)[0]):+.0f}°" if abs(elevation) < MAX_BANK_ELEVATION else "--"
    return [*nose, ("  bank ", "label"), (bank, "")]


SATURATION_SHOWN = 1.0  # for which a saturated axis stays in view [s]
MOTOR_LIMITS = (("L", Limit.MOTOR_LEFT), ("R", Limit.MOTOR_RIGHT))
ELEVON_LIMITS = (("L", Limit.ELEVON_LEFT), ("R", Limit.ELEVON_RIGHT))
POSITION_LIMITS = Limit.MOTOR_LEFT | Limit.MOTOR_RIGHT | Limit.ELEVON_LEFT | Limit.ELEVON_RIGHT
PULSES = (1000.0, 2000.0)  # of a servo from end to end [us]
SERVO_TEXT_WIDTH = 13  # number and pulse beside a bar [cells]
TEXT_WIDTH = 17  # name and value beside a bar [cells]


class ActuatorPanel(Panel):
    """Motors and elevons between their limits."""

    FRAMES = 2
    SOURCES = ("DARKO_ACTUATORS", "SERVO_OUTPUT_RAW")

    def draw(self, s: Snapshot, width: int, height: int) -> list[StyledLine]:
        """A line per actuator, then limits and saturated axes, in one line if there is no room for two."""
        a = s.actuation.actuators
        if a is None:
            return _servos(s.actuation.servos, width, height)
        room = max(4, width - TEXT_WIDTH)
        lines = [_motor(a, side, room) for side in range(2)] + [_elevon(a, side, room) for side in range(2)]
        limits, saturated = _limits(a.limits), _saturated(s)
        if limits and saturated and height > len(lines) + 1:
            return [*lines, limits, saturated]
        return [*lines, saturated or limits or styled_line(("within all limits", "dim"))]


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
    """The limits that are reached; empty within all."""
    if not limits.label:
        return []
    return styled_line((f"at limit: {limits.label}", "bad" if limits & POSITION_LIMITS else "warn"))


def _saturated(s: Snapshot) -> StyledLine:
    """Axes on which the control allocation saturates now (bad) or did within the last second (warn)."""
    now, is_saturated = s.link.boot or 0.0, s.actuation.actuators is not None and s.actuation.actuators.saturation
    recent = [axis.label for axis, at in sorted(s.actuation.saturated_at.items()) if now - at <= SATURATION_SHOWN]
    if not recent:
        return []
    return styled_line(("saturated: " + ", ".join(recent), "bad" if is_saturated else "warn"))


CHART_WINDOW = 60.0  # [s]
MIN_GOVERNOR_SHOWN = 0.01
MIN_JUMP_WIDTH = 8  # [cells]
LAW_STYLES = dict.fromkeys(Law, "accent") | {
    Law.HOVER_LINEAR: "good",
    Law.FORWARD_LINEAR: "good",
    Law.FAILSAFE: "bad",
    Law.CRASHED: "bad",
}


class HybridPanel(Panel):
    """Law in force, V of both linear laws with their thresholds, and a chart of V with the jumps."""

    SOURCES = ("DARKO_HYBRID_STATE",)
    FRAMES = 2
    _chart_key: tuple[object, ...] = ()  # what the chart was drawn for
    _chart: list[StyledLine]

    def draw(self, s: Snapshot, width: int, height: int) -> list[StyledLine]:
        """Three lines of text, the rest chart."""
        h = s.hybrid.state
        if h is None:
            return [
                styled_line(
                    ("no vehicle yet" if s.identity.source is None else "no hybrid state from this vehicle", "dim")
                )
            ]
        jump = _last_jump(h, width)
        height = max(1, height - 2 - len(jump))
        key = (chart_edge(h.time, width, CHART_WINDOW), width, height, h.law, h.hover, h.forward, s.hybrid.jumps)
        if key != self._chart_key:  # the chart is much work, and moves by a dot twice a second
            self._chart_key, self._chart = key, _chart(s, h, width, height)
        hover = _v_with_thresholds("hover", h.v_hover, h.hover, "hover")
        forward = _forward_off(s, h, width - sum(len(text) for text, _ in hover)) or _v_with_thresholds(
            "fwd", h.v_forward, h.forward, "forward"
        )
        room = width - sum(len(text) for text, _ in (*hover, *forward))
        values = [*hover, (" " * min(max(room, 1), 2), ""), *forward]
        return [_law(h, s.hybrid.law_since, width), values, *jump, *self._chart]


FORWARD_LINEAR_USED = "DRK_FWD_LIN"  # 0: straight legs are not handed to the linear law of forward flight


def _forward_off(s: Snapshot, h: HybridState, room: int) -> StyledLine:
    """Words in place of a V that this vehicle never has; empty unless its law is known to be off."""
    if math.isfinite(h.v_forward) or s.parameters.values.get(FORWARD_LINEAR_USED) != 0.0:
        return []
    text = f"off ({FORWARD_LINEAR_USED})"
    return styled_line(("fwd ", "forward"), (text if len(text) + len(" fwd ") <= room else "off", "dim"))


def _chart(s: Snapshot, h: HybridState, width: int, height: int) -> list[StyledLine]:
    return log_chart(
        [t for t, _, _ in s.hybrid.v_history],
        ([v for _, v, _ in s.hybrid.v_history], "hover", "h"),
        ([v for _, _, v in s.hybrid.v_history], "forward", "f"),
        width=width,
        height=height,
        window=CHART_WINDOW,
        thresholds=_labelled("forward", h.forward) if h.is_forward else _labelled("hover", h.hover),
        jumps=tuple((jump.time, law_label(jump.target)) for jump in s.hybrid.jumps),
        now=h.time,
    )


def _law(h: HybridState, law_since: float | None, width: int) -> StyledLine:
    """The law in force, for how long, its V, and what the governor does; V is also in the next line."""
    since = f" {max(h.time - law_since, 0.0):.0f} s" if law_since is not None else ""
    law = as_member(Law, h.law)
    style = "warn" if law is None else LAW_STYLES[law]
    governor = (f"  governor {100 * h.governor:.0f} %", "accent") if h.governor > MIN_GOVERNOR_SHOWN else ("", "")
    name = law_label(h.law).upper()
    v = [("  V ", "label"), (v_text(h.v), "")]
    if len(name) + len(since) + len(governor[0]) + sum(len(text) for text, _ in v) > width:
        v = []
    return styled_line((name, style), (since, "dim"), *v, governor)


def _last_jump(h: HybridState, width: int) -> list[StyledLine]:
    """The number of jumps and the last one with its cause, in two lines if one has no room."""
    if h.jumps == 0:
        return [styled_line(("no jump yet", "dim"))]
    text = f"jump {h.jumps} from {law_label(h.last_law)}: {jump_cause(h.last_law, h.law, h.last_reason)}"
    return [styled_line((line, "dim")) for line in wrap(text, max(width, MIN_JUMP_WIDTH))[:2]]


def _labelled(law: str, thresholds: Thresholds) -> tuple[tuple[float, str, str], ...]:
    """Both thresholds of a linear law, with its name and style."""
    return (
        (thresholds.leave, f"{law} leave {thresholds.leave:g}", law),
        (thresholds.enter, f"{law} enter {thresholds.enter:g}", law),
    )


def _v_with_thresholds(name: str, v: float, thresholds: Thresholds, style: str) -> StyledLine:
    text = f" ({thresholds.enter:g}/{thresholds.leave:g})"
    return styled_line((f"{name} ", style), v_text(v), (text, "dim"))
