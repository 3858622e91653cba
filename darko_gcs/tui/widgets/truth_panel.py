"""The panel that holds the vehicle's estimate against the truth of a simulation, and against its own doubts."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from darko_gcs.state.snapshot import Snapshot
from darko_gcs.state.values import Truth
from darko_gcs.tui.render.canvas import StyledLine
from darko_gcs.tui.widgets.panel import Panel, styled_line
from darko_gcs.tui.widgets.table_number import table_number
from protocol.frames import Quaternion, Vector, multiply

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
    _truth: Truth | None = None  # the newest
    _acceleration: Vector = (0.0, 0.0, 0.0)  # between the last two [m/s2]

    def watch_snapshot(self) -> None:
        """Show a new snapshot; two true velocities tell the acceleration between them."""
        before, t = self._truth, self.snapshot.truth
        if t is not before:
            self._acceleration = _acceleration(before, t)
            self._truth = t
        super().watch_snapshot()

    def draw(self, s: Snapshot, width: int, height: int) -> list[StyledLine]:  # noqa: ARG002 - cut by the panel
        """A heading, a line per error, and what the filter says of its readings."""
        if s.truth is None:
            return [styled_line(("waiting for DARKO_TRUTH: only simulated vehicles send it", "dim"))]
        heading = f"{'':<{QUANTITY_WIDTH}}{'error':>8}     {'1 sigma':>7}  error/sigma"
        return [
            styled_line((heading, "label")),
            *(_line(error) for error in _errors(s, s.truth, self._acceleration)),
            _readings(s),
        ]


def _errors(s: Snapshot, t: Truth, acceleration: Vector) -> list[_Error]:
    true_p, true_v = _moved(t, acceleration, s.p_time)
    p, v = _difference(s.p, true_p), _difference(s.v, true_v)
    nan = math.nan
    of_p, of_v, of_q = ((nan,) * 3, nan, nan) if s.doubt is None else s.doubt
    wind = _difference(None if s.air is None else s.air.wind_estimate, t.wind)
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
        (f"{table_number(ratio, 1, 9)}{' !' if is_many else ''}", "warn" if is_many else "dim"),
    )


def _readings(s: Snapshot) -> StyledLine:
    """The worst test of a reading; above 1 the filter refuses it."""
    if s.test_ratio is None:
        return styled_line(
            ("no filter: the vehicle flies on the true state" if s.doubt is None else "no test of readings", "dim")
        )
    told = ("refused", "warn") if s.test_ratio > 1.0 else ("accepted", "dim")
    return styled_line(
        (f"{'worst reading':<{QUANTITY_WIDTH}}", "label"), table_number(s.test_ratio, 2, 8), "     ", told
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
    if s.q is None or s.q_time is None or abs(s.q_time - t.time) > MAX_APART:
        return math.nan
    turned = multiply(t.q, _turn(t.rates, s.q_time - t.time))
    norm = math.hypot(*s.q) * math.hypot(*turned)
    if not norm > 0.0:
        return math.nan
    w, x, y, z = multiply(_conjugate(s.q), turned)
    return 2.0 * math.atan2(math.hypot(x, y, z), abs(w))


def _turn(rates: Vector, time: float) -> Quaternion:
    """The turn at constant rates [rad/s] for some time [s]."""
    half = math.hypot(*rates) * time / 2.0
    share = time / 2.0 if abs(half) < 1e-9 else math.sin(half) / (2.0 * half / time)
    return math.cos(half), rates[0] * share, rates[1] * share, rates[2] * share


def _conjugate(q: Quaternion) -> Quaternion:
    return q[0], -q[1], -q[2], -q[3]
