"""The panels of the flight screen."""

from __future__ import annotations

import math
from textwrap import wrap

from darko_gcs.render.attitude import attitude, compass
from darko_gcs.render.bars import bar
from darko_gcs.render.chart import log_chart
from darko_gcs.render.map import draw_map
from darko_gcs.snapshot import LAWS, REASONS, Snapshot
from darko_gcs.widgets.panel import Line, Panel, text_line
from protocol.dialect import mavlink
from protocol.frames import FLYING_DISPLAY, Geodetic, LocalFrame, displayed, rotate
from protocol.plans.mission import MissionItem
from protocol.units import from_e7, from_local_e4, is_global_frame

__all__ = ["ActuatorPanel", "AttitudePanel", "FlightPanel", "HybridPanel", "MapPanel", "MessagePanel", "waypoints"]

CHART_WINDOW = 60.0  # [s]
NOSE = (1.0, 0.0, 0.0)
SEVERITY = ("bad", "bad", "bad", "bad", "warn", "accent", "", "dim")
ZOOM = 2.0
SMALL_V = 1e-4  # smaller values of V say no more than this


def number(value: float | None, digits: int, width: int) -> str:
    """A number of fixed width; dashes for none."""
    if value is None or not math.isfinite(value):
        return "--".rjust(width)
    return f"{round(value, digits) + 0.0:{width}.{digits}f}"  # + 0.0: never a negative zero


class HybridPanel(Panel):
    """Law in force, and V on a log scale with both thresholds and the jumps."""

    def draw(self, s: Snapshot, width: int, height: int) -> list[Line]:
        """Two lines of words, the rest chart."""
        h = s.hybrid
        if h is None:
            return [text_line(("no hybrid state from this vehicle", "dim"))]
        law = (s.law or "").upper()
        style = "good" if h.law == 1 else "accent"
        since = f" {h.time - s.law_since:.0f} s" if s.law_since is not None else ""
        first = text_line((law, style), (since, "dim"), ("  V ", "label"), number_of_v(h.v_hover), self._governor(s))
        chart = log_chart(
            [t for t, _ in s.v_history],
            [v for _, v in s.v_history],
            width=width,
            height=max(1, height - 2),
            window=CHART_WINDOW,
            thresholds=((h.v_leave, f"leave {h.v_leave:g}"), (h.v_enter, f"enter {h.v_enter:g}")),
            jumps=tuple((j.time, j.name) for j in s.jumps),
            now=h.time,
        )
        return [first, self._last_jump(s), *chart]

    def _governor(self, s: Snapshot) -> tuple[str, str]:
        share = s.hybrid.governor if s.hybrid else 0.0
        return (f"  governor {100 * share:.0f} %", "warn") if share > 0.01 else ("", "")

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


class ActuatorPanel(Panel):
    """Motors and elevons against their limits."""

    def draw(self, s: Snapshot, width: int, height: int) -> list[Line]:  # noqa: ARG002 - four lines at any height
        """A line per actuator."""
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
        lines.append(self._limits(a.limits))
        return lines

    def _limits(self, limits: int) -> Line:
        names = ("motor L", "motor R", "elevon L", "elevon R")
        position = [name for bit, name in enumerate(names) if limits & (1 << bit)]
        rate = [name for bit, name in enumerate(names) if limits & (16 << bit)]
        if not position and not rate:
            return text_line(("within all limits", "dim"))
        parts = ["at limit: " + ", ".join(position)] if position else []
        parts += ["rate: " + ", ".join(rate)] if rate else []
        return text_line((" · ".join(parts), "bad" if position else "warn"))


class AttitudePanel(Panel):
    """Horizon as the vehicle is shown (hover is level), heading tape, nose elevation."""

    def draw(self, s: Snapshot, width: int, height: int) -> list[Line]:
        """Heading tape, horizon, one line of words."""
        if s.q is None:
            return [text_line(("no attitude", "dim"))]
        shown = displayed(s.q, s.repr_offset or FLYING_DISPLAY)
        nose = rotate(s.q, NOSE)
        elevation = math.degrees(math.asin(max(-1.0, min(1.0, -nose[2]))))
        words = text_line(("nose ", "label"), f"{elevation:+.0f}°", ("  tilt ", "label"), f"{90.0 - elevation:.0f}°")
        return [
            compass(s.heading or 0.0, width),
            *attitude(shown, width=width, height=max(1, height - 2)),
            words,
        ]


class FlightPanel(Panel):
    """Position, velocity, energy, battery, wind, as numbers."""

    def draw(self, s: Snapshot, width: int, height: int) -> list[Line]:  # noqa: ARG002 - cut by the panel
        """Most wanted first."""
        p, v = s.p or (None,) * 3, s.v or (None,) * 3
        up = None if p[2] is None else -p[2]
        climb = None if v[2] is None else -v[2]
        speed = None if v[0] is None or v[1] is None else math.hypot(v[0], v[1])
        height_above = up if up is not None else s.relative_altitude
        lines = [
            text_line(("alt ", "label"), number(height_above, 1, 7), " m", ("   climb ", "label"), number(climb, 1, 5)),
            text_line(("N   ", "label"), number(p[0], 1, 7), " m", ("   speed ", "label"), number(speed, 1, 5)),
            text_line(("E   ", "label"), number(p[1], 1, 7), " m", ("   air   ", "label"), number(s.airspeed, 1, 5)),
            self._target(s),
            self._power(s),
            self._battery(s),
            self._wind(s),
        ]
        return lines + self._by_law(s)

    def _target(self, s: Snapshot) -> Line:
        if s.target is None or s.p is None:
            return text_line(("to  ", "label"), ("--", "dim"))
        return text_line(("to  ", "label"), number(math.dist(s.p, s.target), 1, 7), " m")

    def _power(self, s: Snapshot) -> Line:
        if s.energy is None:
            return text_line(("pow ", "label"), ("--", "dim"))
        e = s.energy
        return text_line(("pow ", "label"), f"{e.power:7.0f} W", ("   used ", "label"), f"{e.total / 1e3:.2f} kJ")

    def _battery(self, s: Snapshot) -> Line:
        if s.battery is None:
            return text_line(("bat ", "label"), ("--", "dim"))
        style = "bad" if s.battery < 0.15 else "warn" if s.battery < 0.3 else ""
        volts = "" if s.voltage is None else f"   {s.voltage:.1f} V"
        return text_line(("bat ", "label"), (f"{100 * s.battery:7.0f} %", style), volts)

    def _wind(self, s: Snapshot) -> Line:
        if s.wind is None:
            return text_line(("wnd ", "label"), ("--", "dim"))
        speed = math.hypot(s.wind[0], s.wind[1])
        source = math.degrees(math.atan2(-s.wind[1], -s.wind[0])) % 360.0
        return text_line(("wnd ", "label"), f"{speed:7.1f} m/s", f" from {source:03.0f}°" if speed > 0.05 else "")

    def _by_law(self, s: Snapshot) -> list[Line]:
        if s.energy is None:
            return []
        used = [(law, joules) for law, joules in zip(LAWS, s.energy.by_law, strict=False) if joules > 0.5]
        return [text_line((f"  {law:<18}", "dim"), f"{joules:8.0f} J") for law, joules in used]


class MapPanel(Panel):
    """Home, mission, track and vehicle, north up."""

    scale: float | None = None  # metres per cell height; None: fit everything

    def draw(self, s: Snapshot, width: int, height: int) -> list[Line]:
        """The whole panel is map."""
        here = None if s.p is None else (s.p[0], s.p[1], s.heading or 0.0)
        lines, self._shown = draw_map(
            width=width,
            height=height,
            scale=self.scale,
            centre=None if self.scale is None or s.p is None else (s.p[0], s.p[1]),
            home=(0.0, 0.0),
            track=s.track,
            waypoints=waypoints(s),
            vehicle=here,
            target=None if s.target is None or s.landed_state == mavlink.MAV_LANDED_STATE_ON_GROUND else s.target[:2],
        )
        return lines

    def zoom(self, step: int) -> None:
        """In (+1), out (-1), or fit everything again (0)."""
        self.scale = None if step == 0 else (self.scale or self._shown) / ZOOM**step
        self.redraw()

    _shown: float = 1.0


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


def waypoints(s: Snapshot) -> list[tuple[int, float, float, str]]:
    """Number, north, east [m] and state of every mission item that names a place."""
    frame = None if s.home is None else LocalFrame(s.home)
    found = []
    for seq, item in enumerate(s.mission):
        place = _place(item, frame)
        if place is not None:
            active = s.mission_current == seq and s.mission_state != mavlink.MISSION_STATE_COMPLETE
            state = "done" if seq in s.reached else "current" if active else "todo"
            found.append((seq, *place, state))
    return found


def _place(item: MissionItem, frame: LocalFrame | None) -> tuple[float, float] | None:
    if (item.x == 0 and item.y == 0 and is_global_frame(item.frame)) or item.frame == mavlink.MAV_FRAME_MISSION:
        return None
    if not is_global_frame(item.frame):
        return from_local_e4(item.x), from_local_e4(item.y)
    if frame is None:
        return None
    north, east, _ = frame.to_ned(Geodetic(from_e7(item.x), from_e7(item.y), frame.origin.alt))
    return north, east
