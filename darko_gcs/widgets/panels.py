"""The panels of the flight screen that draw: laws, actuators, attitude, messages."""

from __future__ import annotations

import math
from textwrap import wrap

from darko_gcs.render.attitude import attitude, compass
from darko_gcs.render.bars import bar
from darko_gcs.render.chart import log_chart
from darko_gcs.snapshot import ATTITUDE_LAW, FORWARD_LAWS, GIVEN_UP, LAWS, REASONS, Snapshot
from darko_gcs.widgets.panel import Line, Panel, text_line
from protocol.frames import FLYING_DISPLAY, Quaternion, displayed, euler_from_quaternion, rotate

__all__ = ["ActuatorPanel", "AttitudePanel", "HybridPanel", "MessagePanel", "display_offset"]

CHART_WINDOW = 60.0  # [s]
GIVEN_UP_SHOWN = 1.0  # [s] that something given up stays in view
NOSE = (1.0, 0.0, 0.0)
STEEP = 75.0  # nose elevation beyond which a bank angle says nothing [deg]
SEVERITY = ("bad", "bad", "bad", "bad", "warn", "accent", "", "dim")
SMALL_V = 1e-4  # smaller values of V say no more than this
LAW_STYLES = {1: "good", 6: "good", 8: "bad"}  # the linear laws, the failsafe


class HybridPanel(Panel):
    """Law in force, V of both linear laws with their thresholds, and a chart of them with the jumps."""

    def draw(self, s: Snapshot, width: int, height: int) -> list[Line]:
        """Three lines of words, the rest chart."""
        h = s.hybrid
        if h is None:
            return [text_line(("no hybrid state from this vehicle", "dim"))]
        forward = h.law in FORWARD_LAWS
        chart = log_chart(
            [t for t, _, _ in s.v_history],
            ([v for _, v, _ in s.v_history], "track"),
            ([v for _, _, v in s.v_history], "plan"),
            width=width,
            height=max(1, height - 3),
            window=CHART_WINDOW,
            thresholds=_thresholds(s.forward_limits if forward else s.hover_limits),
            jumps=tuple((j.time, j.name) for j in s.jumps),
            now=h.time,
        )
        values = text_line(
            *_value_of_v("hover", h.v_hover, s.hover_limits, "dim" if forward else ""),
            "  ",
            *_value_of_v("fwd", h.v_forward, s.forward_limits, "" if forward else "dim"),
        )
        return [self._law(s), values, self._last_jump(s), *chart]

    def _law(self, s: Snapshot) -> Line:
        h = s.hybrid
        if h is None:
            return []
        v = h.v_attitude if h.law == ATTITUDE_LAW else h.v_forward if h.law in FORWARD_LAWS else h.v_hover
        since = f" {h.time - s.law_since:.0f} s" if s.law_since is not None else ""
        style = LAW_STYLES.get(h.law, "accent")
        governor = (f"  gov {100 * h.governor:.0f} %", "warn") if h.governor > 0.01 else ("", "")
        return text_line(((s.law or "").upper(), style), (since, "dim"), ("  V ", "label"), number_of_v(v), governor)

    def _last_jump(self, s: Snapshot) -> Line:
        h = s.hybrid
        if h is None or h.jumps == 0:
            return text_line(("j 0  no jump yet", "dim"))
        reason = REASONS[h.last_reason] if h.last_reason < len(REASONS) else "?"
        source = LAWS[h.last_law] if h.last_law < len(LAWS) else "?"
        return text_line((f"j {h.jumps}  ", "label"), (f"from {source}: {reason}", "dim"))


def number_of_v(v: float) -> str:
    """V in four digits at most."""
    if not math.isfinite(v):
        return "--"
    if v < SMALL_V:
        return f"<{SMALL_V:g}"
    return f"{v:.2g}" if v < 10 else f"{v:.0f}"


def _thresholds(limits: tuple[float, float] | None) -> tuple[tuple[float, str], ...]:
    if limits is None:
        return ()
    return (limits[1], f"leave {limits[1]:g}"), (limits[0], f"enter {limits[0]:g}")


def _value_of_v(name: str, v: float, limits: tuple[float, float] | None, style: str) -> Line:
    between = "" if limits is None else f" ({limits[0]:g}/{limits[1]:g})"
    return text_line((f"{name} ", "label"), (number_of_v(v), style), (between, "dim"))


class ActuatorPanel(Panel):
    """Motors and elevons against their limits."""

    def draw(self, s: Snapshot, width: int, height: int) -> list[Line]:
        """A line per actuator, then limits and what was given up, in one line where there is room for no more."""
        a = s.actuators
        if a is None:
            return [text_line(("no actuator state", "dim"))]
        lines = []
        room = max(4, width - 17)
        for side, name in enumerate(("L", "R")):
            hit = bool(a.limits & (1 << side))
            cells = bar(a.motor[side], 0.0, a.motor_max, width=room, command=a.motor_command[side], saturated=hit)
            value = f"{a.motor[side]:5.0f} rad/s"
            lines.append([(f"M{name} ", "label"), *cells, (value, "bad" if hit else "")])
        for side, name in enumerate(("L", "R")):
            hit = bool(a.limits & (4 << side))
            low = -a.elevon_max
            cells = bar(
                a.elevon[side], low, a.elevon_max, width=room, command=a.elevon_command[side], saturated=hit, centre=0.0
            )
            value = f"{math.degrees(a.elevon[side]):+7.1f} deg"
            lines.append([(f"E{name} ", "label"), *cells, (value, "bad" if hit else "")])
        limits, given_up = self._limits(a.limits), self._given_up(s)
        if height > len(lines) + 1:
            return [*lines, limits, given_up]
        return [*lines, given_up or limits]

    def _limits(self, limits: int) -> Line:
        names = ("motor L", "motor R", "elevon L", "elevon R")
        position = [name for bit, name in enumerate(names) if limits & (1 << bit)]
        rate = [name for bit, name in enumerate(names) if limits & (16 << bit)]
        if not position and not rate:
            return text_line(("within all limits", "dim"))
        parts = ["at limit: " + ", ".join(position)] if position else []
        parts += ["rate: " + ", ".join(rate)] if rate else []
        return text_line((" · ".join(parts), "bad" if position else "warn"))

    def _given_up(self, s: Snapshot) -> Line:
        """What allocation could not give, now (bad) or within the last second (warn)."""
        now, bits = s.boot or 0.0, s.actuators.given_up if s.actuators else 0
        recent = [bit for bit, at in enumerate(s.given_up_at) if now - at <= GIVEN_UP_SHOWN]
        if not recent:
            return []
        return text_line(("gave up: " + ", ".join(GIVEN_UP[bit] for bit in recent), "bad" if bits else "warn"))


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
