"""The panels of the flight screen that draw: laws, actuators, attitude, messages."""

from __future__ import annotations

import math
from textwrap import wrap

from darko_gcs.render.attitude import attitude, compass
from darko_gcs.render.bars import bar
from darko_gcs.render.chart import log_chart
from darko_gcs.snapshot import Snapshot, Thresholds
from darko_gcs.widgets.panel import Line, Panel, text_line
from darko_gcs.words import known, label
from protocol.dialect.vocabulary import Law, Limit, Reason
from protocol.frames import FLYING_DISPLAY, Quaternion, displayed, euler_from_quaternion, rotate

__all__ = ["ActuatorPanel", "AttitudePanel", "HybridPanel", "MessagePanel", "display_offset"]

CHART_WINDOW = 60.0  # [s]
SATURATION_SHOWN = 1.0  # [s] that a saturated axis stays in view
NOSE = (1.0, 0.0, 0.0)
STEEP = 75.0  # nose elevation beyond which a bank angle says nothing [deg]
SEVERITY = ("bad", "bad", "bad", "bad", "warn", "accent", "", "dim")
SMALL_V = 1e-4  # smaller values of V say no more than this
LAW_STYLES = dict.fromkeys(Law, "accent") | {
    Law.HOVER_LINEAR: "good",
    Law.FORWARD_LINEAR: "good",
    Law.FAILSAFE: "bad",
}
MOTORS = (("L", Limit.MOTOR_LEFT), ("R", Limit.MOTOR_RIGHT))
ELEVONS = (("L", Limit.ELEVON_LEFT), ("R", Limit.ELEVON_RIGHT))
AT_POSITION = Limit.MOTOR_LEFT | Limit.MOTOR_RIGHT | Limit.ELEVON_LEFT | Limit.ELEVON_RIGHT


class HybridPanel(Panel):
    """Law in force, V of both linear laws with their thresholds, and a chart of them with the jumps."""

    def draw(self, s: Snapshot, width: int, height: int) -> list[Line]:
        """Three lines of words, the rest chart."""
        h = s.hybrid
        if h is None:
            return [text_line(("no hybrid state from this vehicle", "dim"))]
        chart = log_chart(
            [t for t, _, _ in s.v_history],
            ([v for _, v, _ in s.v_history], "track"),
            ([v for _, _, v in s.v_history], "plan"),
            width=width,
            height=max(1, height - 3),
            window=CHART_WINDOW,
            thresholds=_thresholds(h.forward if h.is_forward else h.hover),
            jumps=tuple((j.time, j.name) for j in s.jumps),
            now=h.time,
        )
        values = text_line(
            *_value_of_v("hover", h.v_hover, h.hover, "dim" if h.is_forward else ""),
            "  ",
            *_value_of_v("fwd", h.v_forward, h.forward, "" if h.is_forward else "dim"),
        )
        return [self._law(s), values, self._last_jump(s), *chart]

    def _law(self, s: Snapshot) -> Line:
        h = s.hybrid
        if h is None:
            return []
        since = f" {h.time - s.law_since:.0f} s" if s.law_since is not None else ""
        law = known(Law, h.law)
        style = "warn" if law is None else LAW_STYLES[law]
        governor = (f"  gov {100 * h.governor:.0f} %", "warn") if h.governor > 0.01 else ("", "")
        return text_line(((s.law or "").upper(), style), (since, "dim"), ("  V ", "label"), number_of_v(h.v), governor)

    def _last_jump(self, s: Snapshot) -> Line:
        h = s.hybrid
        if h is None or h.jumps == 0:
            return text_line(("j 0  no jump yet", "dim"))
        jump = f"from {label(Law, h.last_law)}: {label(Reason, h.last_reason)}"
        return text_line((f"j {h.jumps}  ", "label"), (jump, "dim"))


def number_of_v(v: float) -> str:
    """V in four digits at most."""
    if not math.isfinite(v):
        return "--"
    if v < SMALL_V:
        return f"<{SMALL_V:g}"
    return f"{v:.2g}" if v < 10 else f"{v:.0f}"


def _thresholds(between: Thresholds) -> tuple[tuple[float, str], ...]:
    return (between.leave, f"leave {between.leave:g}"), (between.enter, f"enter {between.enter:g}")


def _value_of_v(name: str, v: float, between: Thresholds, style: str) -> Line:
    words = f" ({between.enter:g}/{between.leave:g})"
    return text_line((f"{name} ", "label"), (number_of_v(v), style), (words, "dim"))


class ActuatorPanel(Panel):
    """Motors and elevons against their limits."""

    def draw(self, s: Snapshot, width: int, height: int) -> list[Line]:
        """A line per actuator, then limits and saturated axes, in one line where there is room for no more."""
        a = s.actuators
        if a is None:
            return [text_line(("no actuator state", "dim"))]
        lines = []
        room = max(4, width - 17)
        for side, (name, limit) in enumerate(MOTORS):
            hit = limit in a.limits
            cells = bar(a.motor[side], 0.0, a.motor_max, width=room, command=a.motor_command[side], saturated=hit)
            value = f"{a.motor[side]:5.0f} rad/s"
            lines.append([(f"M{name} ", "label"), *cells, (value, "bad" if hit else "")])
        for side, (name, limit) in enumerate(ELEVONS):
            hit = limit in a.limits
            low = -a.elevon_max
            cells = bar(
                a.elevon[side], low, a.elevon_max, width=room, command=a.elevon_command[side], saturated=hit, centre=0.0
            )
            value = f"{math.degrees(a.elevon[side]):+7.1f} deg"
            lines.append([(f"E{name} ", "label"), *cells, (value, "bad" if hit else "")])
        limits, saturated = self._limits(a.limits), self._saturated(s)
        if height > len(lines) + 1:
            return [*lines, limits, saturated]
        return [*lines, saturated or limits]

    def _limits(self, limits: Limit) -> Line:
        if not limits.label:
            return text_line(("within all limits", "dim"))
        return text_line((f"at limit: {limits.label}", "bad" if limits & AT_POSITION else "warn"))

    def _saturated(self, s: Snapshot) -> Line:
        """Axes on which the allocation falls short, now (bad) or within the last second (warn)."""
        now, at_present = s.boot or 0.0, s.actuators is not None and s.actuators.saturation
        recent = [axis.label for axis, at in sorted(s.saturated_at.items()) if now - at <= SATURATION_SHOWN]
        if not recent:
            return []
        return text_line(("saturated: " + ", ".join(recent), "bad" if at_present else "warn"))


def display_offset(s: Snapshot) -> Quaternion:
    """What the attitude is turned by to be shown: the vehicle's offset upright, none on the wing.

    It changes once per transition, at its end, when the nose is where the new view calls level. Vehicles that give
    no offset are shown as they fly.
    """
    return FLYING_DISPLAY if s.is_forward or s.repr_offset is None else s.repr_offset


class AttitudePanel(Panel):
    """Horizon (the title says whose: hover is level nose-up), heading tape, nose elevation."""

    def watch_snapshot(self) -> None:
        """The title names the view."""
        hover = display_offset(self.snapshot) != FLYING_DISPLAY
        title = "Attitude: nose-up is level" if hover else "Attitude"
        if self.border_title != title:
            self.border_title = title
        super().watch_snapshot()

    def draw(self, s: Snapshot, width: int, height: int) -> list[Line]:
        """Heading tape, horizon, one line of words."""
        if s.q is None:
            return [text_line(("no attitude", "dim"))]
        shown = displayed(s.q, display_offset(s))
        return [
            compass(s.heading or 0.0, width),
            *attitude(shown, width=width, height=max(1, height - 2)),
            _nose_words(s.q, hover=display_offset(s) != FLYING_DISPLAY),
        ]


def _nose_words(q: Quaternion, *, hover: bool) -> Line:
    elevation = math.degrees(math.asin(max(-1.0, min(1.0, -rotate(q, NOSE)[2]))))
    words = text_line(("nose ", "label"), f"{elevation:+.0f}°")
    if hover:
        return [*words, ("  tilt ", "label"), (f"{90.0 - elevation:.0f}°", "")]
    bank = f"{math.degrees(euler_from_quaternion(q)[0]):+.0f}°" if abs(elevation) < STEEP else "--"
    return [*words, ("  bank ", "label"), (bank, "")]


class MessagePanel(Panel):
    """The newest lines of the log, newest last."""

    def draw(self, s: Snapshot, width: int, height: int) -> list[Line]:
        """As many as fit, long ones on several rows."""
        rows: list[Line] = []
        for line in s.messages[-height:]:
            style = SEVERITY[min(line.severity, 7)]
            parts = wrap(line.text, max(width, 8), subsequent_indent="  ") or [""]
            rows += [text_line((part, style)) for part in parts]
        return rows[-height:]
