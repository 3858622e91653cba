"""Panels of numbers: the flight, hover or forward flight on the current leg, and the estimate against the truth."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from darko_gcs.state.law_reason import is_wind_guessed, law_reason, why_not_linear
from darko_gcs.state.snapshot import Snapshot
from darko_gcs.state.speed_in_force import speed_in_force
from darko_gcs.state.text import label_of
from darko_gcs.state.values import Decision, Truth
from darko_gcs.tui.render.canvas import StyledLine
from darko_gcs.tui.widgets.panel import Panel, styled_line, table_number
from darko_gcs.tui.widgets.status_bar import charge_style, is_going
from protocol.dialect import mavlink
from protocol.dialect.vocabulary import DecisionReason, LegMode
from protocol.frames import Quaternion, Vector, multiply
from protocol.names import Mode, law_label


class DecisionPanel(Panel):
    """The decision on a leg in full."""

    def draw(self, s: Snapshot, width: int, height: int) -> list[StyledLine]:  # noqa: ARG002 - cut by the panel
        """Choice and reason, both predictions, the leg, the wind."""
        return decision_lines(s)


class BesideDecision(Panel):
    """A panel that tells the decision itself on screens without room for its own panel."""

    _decision: DecisionPanel | None = None

    def has_decision_panel(self) -> bool:
        """True on a screen with room for it, unless the operator has hidden it."""
        if self._decision is None and self.is_mounted:
            self._decision = next(iter(self.screen.query(DecisionPanel)), None)
        return self._decision is not None and self._decision.display


def decision_lines(s: Snapshot) -> list[StyledLine]:
    """The reason of the law, then the decision: in eight lines at most."""
    d, law = s.guidance.decision, law_reason(s)
    stays = [styled_line(law)] if law else []
    if d is None:
        return [*stays, styled_line(("no decision heard yet", "dim"))]
    is_past = _is_past(s, d)
    leg = "leg " if d.seq is None else f"leg to {d.seq}  "
    choice = label_of(LegMode, d.leg_mode)
    climb = f"{round(d.climb, 0) + 0.0:+.0f} m"
    tail, cross = table_number(d.tail_wind, 1, 1), table_number(d.cross_wind, 1, 1)
    difference = _difference_words(d)
    return [
        *stays,
        styled_line(
            (choice, "dim") if is_past else (choice.upper(), "accent"),
            (f"  {label_of(DecisionReason, d.reason)}", "dim" if is_past else ""),
        ),
        _prediction(d, LegMode.HOVER, d.hover_time, d.hover_energy, is_past=is_past),
        _prediction(d, LegMode.FORWARD, d.forward_time, d.forward_energy, is_past=is_past),
        *([styled_line(difference)] if difference else []),
        styled_line((leg, "label"), f"{d.distance:.0f} m", ("  climb ", "label"), climb),
        styled_line(("tail wind ", "label"), tail, ("  cross wind ", "label"), cross),
        styled_line((_age(s, d), "dim")),
    ]


def decision_summary(s: Snapshot, width: int) -> str:
    """The decision in one line of a width: leg, choice, reason, energy saved; without a leg, why the law stays.

    The saving and the reason are left out, in this order, if there is no room.
    """
    d, law = s.guidance.decision, why_not_linear(s)
    if law and len(law) <= width and (d is None or _is_past(s, d)):
        return law
    if d is None:
        return ""
    leg = ("past leg" if _is_past(s, d) else "leg") + ("" if d.seq is None else f" to {d.seq}")
    short = f"{leg}: {label_of(LegMode, d.leg_mode)}"
    saving = f", saves {100.0 * d.saving:.0f} %" if d.reason in FREE_CHOICES and d.saving >= LEAST_SHARE else ""
    reason = f", {label_of(DecisionReason, d.reason)}"
    texts = (short + reason + saving, short + reason, short)
    return next((text for text in texts if len(text) <= width), short)


LEGLESS = frozenset(mode.name for mode in (Mode.POSCTL, Mode.TAKEOFF, Mode.LAND, Mode.MISSION))  # of no own leg


def _is_past(s: Snapshot, d: Decision) -> bool:
    """True if the vehicle does not fly the leg any more."""
    if s.status.landed_state == mavlink.MAV_LANDED_STATE_ON_GROUND:
        return True
    if d.seq is None:
        return s.status.mode in LEGLESS or (s.status.mode == Mode.HOLD.name and not is_going(s))
    return s.mission.state != mavlink.MISSION_STATE_ACTIVE or (s.mission.current or 0) > d.seq


def _age(s: Snapshot, d: Decision) -> str:
    past = "a past leg, " if _is_past(s, d) else ""
    return f"{past}decided" if s.link.boot is None else f"{past}decided {max(0.0, s.link.boot - d.time):.0f} s ago"


def _prediction(d: Decision, leg_mode: LegMode, time: float, energy: float, *, is_past: bool) -> StyledLine:
    name, style = f"{leg_mode.label:<8}", "good" if d.leg_mode == leg_mode and not is_past else "dim"
    if not math.isfinite(time):
        return styled_line((name, style), ("  impossible", "dim"))
    return styled_line((name, style), f"{time:8.1f} s", f"{table_number(energy, 0, 9)} J")


FREE_CHOICES = frozenset({DecisionReason.ENERGY, DecisionReason.DEADLINE, DecisionReason.COMMAND, DecisionReason.ROW})
LEAST_SHARE = 0.005  # of time or energy, which is worth a word


def _difference_words(d: Decision) -> str:
    """Energy and time of the choice beside the alternative's; empty where there was no choice."""
    if d.chosen_and_other is None or d.reason not in FREE_CHOICES:
        return ""
    (chosen, _), (other, _) = d.chosen_and_other
    time = 1.0 - chosen / other if other > 0.0 else math.nan
    return ", ".join(filter(None, (_share_words(d.saving, "energy"), _share_words(time, "time"))))


def _share_words(saving: float, what: str) -> str:
    """A share that is saved, or spent: "65 % less energy"; empty where there is no difference."""
    if not abs(saving) >= LEAST_SHARE:
        return ""
    return f"{100.0 * abs(saving):.0f} % {'less' if saving > 0.0 else 'more'} {what}"


PAIR_WIDTH = 24  # of the panel that has room for two numbers in a line [cells]
WORDS_WIDTH = 36  # of the panel that has room for words instead of abbreviations [cells]
WORDS = {
    "alt": "altitude", "N": "north", "E": "east", "to": "target", "pow": "power", "bat": "battery", "wnd": "wind",
    "true": "true wind", "air": "airspeed", "track": "off track",
}  # fmt: skip
POSITION = ("LOCAL_POSITION_NED", "GLOBAL_POSITION_INT")
MIN_ENERGY_SHOWN = 0.5  # used in one law [J]
MIN_WIND_SHOWN = 0.05  # below which its direction is not shown [m/s]


class FlightPanel(BesideDecision):
    """Position, velocity, path, energy, battery and air, as numbers; in pages if there is no room for all."""

    SOURCES = (*POSITION, "VFR_HUD")
    FRAMES = 2
    page = 0
    _pages = 1  # that there are

    def draw(self, s: Snapshot, width: int, height: int) -> list[StyledLine]:
        """The lines of the current page, most important first."""
        pages = paged(self._all(s, width), height)
        self._pages = len(pages)
        return pages[self.page % self._pages]

    def next_page(self) -> bool:
        """Show the next page; False if there is only one."""
        self.page += 1
        self.redraw()
        return self._pages > 1

    def redraw(self) -> None:
        """Draw again, with the pages counted in the title."""
        super().redraw()
        pages = self._pages
        key = getattr(self.app, "own_keys", {}).get("more", "n") if self.is_attached else "n"
        title = "Flight" if pages == 1 else f"Flight {self.page % pages + 1}/{pages} ({key}: next)"
        if self.border_title != title:
            self.border_title = title

    def _all(self, s: Snapshot, width: int) -> list[list[StyledLine]]:
        """Lines that belong together: the numbers, the energy, the decision."""
        p, v = s.position.from_home or (None,) * 3, s.position.v or (None,) * 3
        up = s.position.relative_altitude if p[2] is None else -p[2]
        climb = None if v[2] is None else -v[2]
        speed = None if v[0] is None or v[1] is None else math.hypot(v[0], v[1])
        if width < PAIR_WIDTH:
            goal = None if s.goal is None or s.position.p is None else math.dist(s.position.p, s.goal)
            numbers = {
                "alt": up,
                "clb": climb,
                "spd": speed,
                "air": s.estimates.airspeed,
                "N": p[0],
                "E": p[1],
                "to": goal,
            }
            lost = {"spd", "N", "E"} if s.estimates.is_place_lost else set()
            return [
                [
                    styled_line((f"{label:<3}", "label"), table_number(n, 1, 5), ("?" * (label in lost), "warn"))
                    for label, n in numbers.items()
                ]
            ]
        words = width >= WORDS_WIDTH
        place, air = self._short_age(s, *POSITION), self._short_age(s, "VFR_HUD")
        level = place or (" (lost)" if s.estimates.is_place_lost else "")  # the height is not lost with it
        over_ground, through_air = _wanted_speeds(s)
        lines = [
            _pair(("alt", up, place), ("climb", climb, place), words=words),
            _pair(("N", p[0], level), ("speed", speed, level), words=words, wanted=over_ground),
            _pair(
                ("E", p[1], level),
                ("air", s.estimates.airspeed, air),
                words=words,
                wanted=through_air,
                is_estimate=s.status.has_measured_air is False,
            ),
            self._target(s, words=words),
            self._power(s, words=words),
            self._battery(s, words=words),
            *self._air(s, words=words),
        ]
        return [lines, self._energy_by_law(s), [] if self.has_decision_panel() else decision_lines(s)]

    def _short_age(self, s: Snapshot, *kinds: str) -> str:
        """Age of a value in brackets; empty while it is fresh, and for a lost link, of which the status bar tells."""
        if s.link.lost:
            return ""
        old = self.age_text(s, *kinds)
        return f" ({old.removesuffix(' old')})" if old else ""

    def _target(self, s: Snapshot, *, words: bool) -> StyledLine:
        distance = math.dist(s.position.p, s.goal) if s.goal is not None and s.position.p is not None else None
        cross_track = None if s.guidance.navigation is None else s.guidance.navigation.cross_track
        ages = (
            self._short_age(s, "POSITION_TARGET_LOCAL_NED", "POSITION_TARGET_GLOBAL_INT"),
            self._short_age(s, "NAV_CONTROLLER_OUTPUT"),
        )
        return _pair(("to", distance, ages[0]), ("track", cross_track, ages[1]), words=words)

    def _power(self, s: Snapshot, *, words: bool) -> StyledLine:
        label = _label("pow", words=words)
        if s.battery.energy is None:
            power, age = s.battery.power, self._short_age(s, "BATTERY_STATUS", "SYS_STATUS")
            return styled_line(label, ("--", "dim") if power is None else f"{power:7.0f} W", (age, "warn"))
        e, age = s.battery.energy, self._short_age(s, "DARKO_ENERGY")
        return styled_line(label, f"{e.power:7.0f} W", (age, "warn"), ("   used ", "label"), f"{e.total / 1e3:.2f} kJ")

    def _battery(self, s: Snapshot, *, words: bool) -> StyledLine:
        label = _label("bat", words=words)
        if s.battery.charge_left is None:
            volts, age = s.battery.voltage, self._short_age(s, "BATTERY_STATUS", "SYS_STATUS")
            return styled_line(label, ("--", "dim") if volts is None else f"{volts:7.1f} V", (age, "warn"))
        style = charge_style(s.battery.charge_left, "")
        voltage = "" if s.battery.voltage is None else f"   {s.battery.voltage:.1f} V"
        age = self._short_age(s, "BATTERY_STATUS", "SYS_STATUS")
        return styled_line(label, (f"{100 * s.battery.charge_left:7.0f} %", style), (age, "warn"), voltage)

    def _air(self, s: Snapshot, *, words: bool) -> list[StyledLine]:
        """The wind as the vehicle estimates it; with DARKO_AIR, the true wind and the true airspeed, too."""
        air = s.estimates.air
        if air is None:
            age = (self._short_age(s, "WIND_COV", "WIND"), "warn")
            return [[*_estimated_wind(s, _label("wnd", words=words), s.estimates.wind), age]]
        age = (self._short_age(s, "DARKO_AIR"), "warn")
        speed = f"{table_number(air.airspeed_true, 1, 7)} m/s", (" in truth" if words else " true", "label")
        return [
            [*_estimated_wind(s, _label("wnd", words=words), air.wind_estimate), age],
            [*_wind(_label("true", words=words), air.wind_true), age],
            styled_line(_label("air", words=words), *speed, age),
        ]

    def _energy_by_law(self, s: Snapshot) -> list[StyledLine]:
        if s.battery.energy is None:
            return []
        used = [(law_label(law), j) for law, j in enumerate(s.battery.energy.by_law) if j > MIN_ENERGY_SHOWN]
        lines = [styled_line((f"  {law:<21}", "dim"), f"{joules:7.0f} J") for law, joules in used]
        return [styled_line(("energy used by each law", "label")), *lines] if lines else []


_Value = tuple[str, float | None, str]  # label, number, age in brackets


def _wanted_speeds(s: Snapshot) -> tuple[str, str]:
    """The speed in force as it stands behind the one over the ground, or behind the one through the air."""
    asked = speed_in_force(s) if s.status.is_airborne else None
    if asked is None:
        return "", ""
    text = f"→{asked.speed:.3g}"
    return (text, "") if asked.over_ground else ("", text)


def _pair(first: _Value, second: _Value, *, words: bool, wanted: str = "", is_estimate: bool = False) -> StyledLine:
    """A length [m] and a second number, each behind its label and, if it is old, before its age.

    Behind the second one stands what is asked for. A number that nothing measures is marked: "~11.5 est".
    """
    (label, length, age), (second_label, number, second_age) = first, second
    if age == second_age:  # once for both
        age = ""
    text = table_number(number, 1, 5)
    if is_estimate and number is not None:
        text = f"~{text.strip()}".rjust(5)
        wanted = wanted or " est" * words
    gap, space, room = (" ", "", 6) if age or second_age else ("   ", " ", 7)  # else the age has none
    return styled_line(
        _label(label, words=words), table_number(length, 1, room), " m", (age, "warn"),
        (f"{gap}{WORDS.get(second_label, second_label) if words and not wanted else second_label:<5}{space}", "label"),
        text, (wanted, "now"), (second_age, "warn"),
    )  # fmt: skip


def _label(text: str, *, words: bool) -> tuple[str, str]:
    return f"{WORDS[text]:<9}" if words else f"{text:<4}", "label"


def _estimated_wind(s: Snapshot, label: tuple[str, str], wind: Vector | None) -> StyledLine:
    """The wind as the vehicle estimates it, with its deviation; of a guess no direction."""
    deviation = s.estimates.wind_deviation
    if wind is None or deviation is None:
        return _wind(label, wind)
    if not is_wind_guessed(s):
        return _wind(label, wind, f" ±{deviation:.1f}")
    text = f"{math.hypot(*wind[:2]):7.1f} ±{deviation:.1f} m/s"
    return styled_line(label, text, (" unobserved", "warn"))


def _wind(label: tuple[str, str], wind: Vector | None, deviation: str = "") -> StyledLine:
    """Wind speed, and the direction that it comes from."""
    if wind is None or not all(map(math.isfinite, wind)):
        return styled_line(label, ("--", "dim"))
    speed = math.hypot(wind[0], wind[1])
    source = math.degrees(math.atan2(-wind[1], -wind[0])) % 360.0
    direction = [(" from ", "label"), (f"{round(source) % 360:03d}°", "")] if speed > MIN_WIND_SHOWN else []
    return styled_line(label, f"{speed:7.1f}{deviation} m/s", *direction)


LEAST_START = 3  # of the lines of a group that is begun on a page where it does not end


def paged(groups: Iterable[Sequence[StyledLine]], height: int) -> list[list[StyledLine]]:
    """Pages of lines: a group that fits on a page stays whole, so that its heading does; no line stands alone.

    Args:
        groups: Lines that belong together.
        height: Of a page [lines].
    """
    pages: list[list[StyledLine]] = [[]]
    for group in groups:
        room = height - len(pages[-1])
        if pages[-1] and len(group) > room and (len(group) <= height or room < LEAST_START):
            pages.append([])
        rest = list(group)
        while rest:
            room = max(1, height - len(pages[-1]))
            if len(rest) == room + 1 and room > LEAST_START:
                room -= 1
            pages[-1] += rest[:room]
            rest = rest[room:]
            if rest:
                pages.append([])
    return pages


MAX_APART = 0.5  # between an estimate and the truth that it is compared with [s]
MANY_DEVIATIONS = 3.0  # beyond which the filter is wrong about itself
QUANTITY_WIDTH = 16  # [cells]


class _Error(NamedTuple):
    """The estimate minus the truth, and the standard deviation that the filter states; NaN for what is not known."""

    label: str
    value: float
    unit: str
    deviation: float
    digits: int = 2


class TruthPanel(Panel):
    """Errors of position, velocity, attitude and wind; beside each, how large the filter believes it to be."""

    SOURCES = ("DARKO_TRUTH",)
    FRAMES = 2
    _truth: Truth | None = None  # the newest
    _acceleration: Vector = (0.0, 0.0, 0.0)  # between the last two [m/s2]

    def show_snapshot(self, s: Snapshot, now: float, *, is_due: bool = True) -> None:
        """Take every snapshot: two true velocities tell the acceleration between them."""
        before, t = self._truth, s.estimates.truth
        if t is not before:
            self._acceleration = _acceleration(before, t)
            self._truth = t
        super().show_snapshot(s, now, is_due=is_due)

    def draw(self, s: Snapshot, width: int, height: int) -> list[StyledLine]:  # noqa: ARG002 - cut by the panel
        """A heading, a line per error, and what the filter says of its readings."""
        if s.estimates.truth is None:
            return [styled_line(("waiting for DARKO_TRUTH: only simulated vehicles send it", "dim"))]
        heading = f"{'':<{QUANTITY_WIDTH}}{'error':>8}     {'1 sigma':>7}  error/sigma"
        return [
            styled_line((heading, "label")),
            *(_line(error) for error in _errors(s, s.estimates.truth, self._acceleration)),
            _readings(s),
        ]


def _errors(s: Snapshot, t: Truth, acceleration: Vector) -> list[_Error]:
    true_p, true_v = _moved(t, acceleration, s.position.time)
    p, v = _difference(s.position.p, true_p), _difference(s.position.v, true_v)
    nan = math.nan
    of_p, of_v, of_q = ((nan,) * 3, nan, nan) if s.estimates.doubt is None else s.estimates.doubt
    wind = _difference(None if s.estimates.air is None else s.estimates.air.wind_estimate, t.wind)
    return [
        _Error("north", p[0], "m", of_p[0]),
        _Error("east", p[1], "m", of_p[1]),
        _Error("height", -p[2], "m", of_p[2]),
        _Error("velocity north", v[0], "m/s", of_v),
        _Error("velocity east", v[1], "m/s", of_v),
        _Error("climb", -v[2], "m/s", of_v),
        _Error("attitude", math.degrees(_angle(s, t)), "deg", math.degrees(of_q)),
        _Error("wind north", wind[0], "m/s", nan),
        _Error("wind east", wind[1], "m/s", nan),
    ]


def _line(e: _Error) -> StyledLine:
    ratio = abs(e.value) / e.deviation if e.deviation > 0.0 else math.nan
    is_many = ratio > MANY_DEVIATIONS
    return styled_line(
        (f"{e.label:<{QUANTITY_WIDTH}}", "label"),
        f"{table_number(e.value, e.digits, 8)} {e.unit:<4}{table_number(e.deviation, e.digits, 7)}",
        (f"{table_number(ratio, 1, 9)}{' > 3' if is_many else ''}", "warn" if is_many else "dim"),
    )


def _readings(s: Snapshot) -> StyledLine:
    """The worst test of a reading; above 1 the filter refuses it."""
    if s.estimates.test_ratio is None:
        return styled_line(
            (
                "no filter: the vehicle flies on the true state"
                if s.estimates.doubt is None
                else "no test of readings",
                "dim",
            )
        )
    reading = s.estimates.worst_reading
    told = (f"refused {reading}", "warn") if s.estimates.test_ratio > 1.0 else (f"accepted {reading}", "dim")
    return styled_line(
        (f"{'worst reading':<{QUANTITY_WIDTH}}", "label"), table_number(s.estimates.test_ratio, 2, 8), "     ", told
    )


def _acceleration(before: Truth | None, t: Truth | None) -> Vector:
    """Between two truths [m/s2]; none if they do not follow each other."""
    if before is None or t is None or not 0.0 < t.time - before.time < MAX_APART:
        return 0.0, 0.0, 0.0
    x, y, z = ((b - a) / (t.time - before.time) for a, b in zip(before.v, t.v, strict=True))
    return x, y, z


def _moved(t: Truth, acceleration: Vector, time: float | None) -> tuple[Sequence[float], Sequence[float]]:
    """The true position and velocity at the time of the estimate: in a turn they change much between messages."""
    if time is None or abs(time - t.time) > MAX_APART:
        return (math.nan,) * 3, (math.nan,) * 3
    step = time - t.time
    p = [p + step * (v + step / 2.0 * a) for p, v, a in zip(t.p, t.v, acceleration, strict=True)]
    return p, [v + step * a for v, a in zip(t.v, acceleration, strict=True)]


def _difference(estimate: Sequence[float] | None, truth: Sequence[float]) -> tuple[float, ...]:
    return (math.nan,) * 3 if estimate is None else tuple(a - b for a, b in zip(estimate, truth, strict=True))


def _angle(s: Snapshot, t: Truth) -> float:
    """Angle between the estimated attitude and the true one, turned on to the time of the estimate [rad]."""
    if s.attitude.q is None or s.attitude.time is None or abs(s.attitude.time - t.time) > MAX_APART:
        return math.nan
    turned = multiply(t.q, _turn(t.rates, s.attitude.time - t.time))
    norm = math.hypot(*s.attitude.q) * math.hypot(*turned)
    if not norm > 0.0:
        return math.nan
    w, x, y, z = multiply(_conjugate(s.attitude.q), turned)
    return 2.0 * math.atan2(math.hypot(x, y, z), abs(w))


def _turn(rates: Vector, time: float) -> Quaternion:
    """The turn at constant rates [rad/s] for some time [s]."""
    half = math.hypot(*rates) * time / 2.0
    share = time / 2.0 if abs(half) < 1e-9 else math.sin(half) / (2.0 * half / time)
    return math.cos(half), rates[0] * share, rates[1] * share, rates[2] * share


def _conjugate(q: Quaternion) -> Quaternion:
    return q[0], -q[1], -q[2], -q[3]
