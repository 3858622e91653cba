"""The aircraft that was built before a wind wall, and what the model says of it: steady attitude, elevons and motors.

The flight is that of F. Sansou's thesis (2024, chapter 6), read out of its published figures and averaged over the
stretches in which wind and attitude stand still. The rows that are not ``fitted`` took no part in choosing any constant
of an airframe: there the model predicts.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from sitl import Airframe, Array
from sitl.design.trim import level_trim

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# The flight's thrusts are reckoned from its motors' speeds by this constant of its gain headers [N/rpm2].
FLIGHT_THRUST = 1.9412e-8
RPM = 30.0 / math.pi  # of a rad/s
PITCH_LIMIT, PITCH_RMS, ELEVON_LIMIT = 3.0, 2.0, 3.0  # [deg]
THRUST_LIMIT = 0.04  # as a share
DRAWN_WINDS = np.linspace(0.0, 7.0, 57)  # [m/s]


class SteadyFlight(NamedTuple):
    """Hover at a point in a steady wind."""

    wind: float  # [m/s]
    pitch: float  # of the nose above the horizon [deg]
    elevon: float  # mean of both, positive nose-up [deg]
    thrust: float  # mean of both motors, by FLIGHT_THRUST from their speed [N]; NaN: not told


class FlownRow(NamedTuple):
    """Steady flight of the aircraft, and whether the airframe was fitted to it."""

    flown: SteadyFlight
    fitted: bool


class Comparison(NamedTuple):
    """Flight and model at one wind."""

    flown: SteadyFlight
    model: SteadyFlight
    fitted: bool

    @property
    def pitch_error(self) -> float:
        """Model less flight [deg]."""
        return self.model.pitch - self.flown.pitch

    @property
    def elevon_error(self) -> float:
        """Model less flight [deg]."""
        return self.model.elevon - self.flown.elevon

    @property
    def thrust_error(self) -> float:
        """Model less flight, as a share; NaN where the flight does not tell."""
        return self.model.thrust / self.flown.thrust - 1.0


FLIGHT = (
    FlownRow(SteadyFlight(0.29, 87.93, -0.50, 2.983), fitted=True),
    FlownRow(SteadyFlight(1.74, 86.8, 0.8, math.nan), fitted=False),
    FlownRow(SteadyFlight(2.57, 82.22, 0.74, 2.969), fitted=True),
    FlownRow(SteadyFlight(3.38, 74.4, 2.1, math.nan), fitted=False),
    FlownRow(SteadyFlight(4.15, 71.10, 5.63, 2.779), fitted=True),
    FlownRow(SteadyFlight(4.91, 67.7, 8.5, math.nan), fitted=False),
    FlownRow(SteadyFlight(5.75, 61.40, 11.53, 2.634), fitted=True),
    FlownRow(SteadyFlight(6.54, 56.8, 14.8, math.nan), fitted=False),
)


def predicted(a: Airframe, wind: float) -> SteadyFlight:
    """The hover in a level wind [m/s] as the model has it."""
    trim = level_trim(a, wind)
    return SteadyFlight(
        wind=wind,
        pitch=math.degrees(trim.theta),
        elevon=math.degrees(trim.delta),
        thrust=FLIGHT_THRUST * (RPM * trim.omega) ** 2,
    )


def compared(a: Airframe, flight: Sequence[FlownRow] = FLIGHT) -> list[Comparison]:
    """Flight and model at each wind of the flight."""
    return [Comparison(row.flown, predicted(a, row.flown.wind), row.fitted) for row in flight]


def faults(rows: Sequence[Comparison]) -> list[str]:
    """Limits that the model misses the flight by, in words; empty if it keeps all."""
    found = []
    for row in rows:
        wind = f"in {row.flown.wind:g} m/s"
        for name, error, limit in (("pitch", row.pitch_error, PITCH_LIMIT), ("elevon", row.elevon_error, ELEVON_LIMIT)):
            if not abs(error) <= limit:
                found.append(f"{wind}: {name} {error:+.1f} deg, allowed {limit:g}")
        if abs(row.thrust_error) > THRUST_LIMIT:
            found.append(f"{wind}: thrust {100.0 * row.thrust_error:+.1f} %, allowed {100.0 * THRUST_LIMIT:g}")
    rms = _rms([row.pitch_error for row in rows])
    if not rms <= PITCH_RMS:
        found.append(f"pitch {rms:.1f} deg rms, allowed {PITCH_RMS:g}")
    return found


def _rms(errors: Sequence[float]) -> float:
    return float(np.sqrt(np.mean(np.square(errors))))


def table(rows: Sequence[Comparison]) -> list[str]:
    """Flight and model side by side, as lines of text."""
    lines = [f"{'wind':>6}{'pitch [deg]':>24}{'elevon [deg]':>24}{'thrust [N]':>26}", f"{'m/s':>6}" + _HEAD * 3]
    for row in rows:
        thrust = f"{'-':>8}{row.model.thrust:>8.2f}{'':>8}"
        if not math.isnan(row.flown.thrust):
            thrust = f"{row.flown.thrust:>8.2f}{row.model.thrust:>8.2f}{100.0 * row.thrust_error:>+7.1f}%"
        lines.append(
            f"{row.flown.wind:>6.2f}{row.flown.pitch:>8.1f}{row.model.pitch:>8.1f}{row.pitch_error:>+8.1f}"
            f"{row.flown.elevon:>8.1f}{row.model.elevon:>8.1f}{row.elevon_error:>+8.1f}{thrust}"
            f"  {'fitted to' if row.fitted else 'predicted'}"
        )
    for name, group in (("fitted to", True), ("predicted", False)):
        chosen = [row for row in rows if row.fitted == group]
        worst = max((abs(row.elevon_error) for row in chosen), default=0.0)
        rms = _rms([row.pitch_error for row in chosen]) if chosen else 0.0
        lines.append(f"{name}: pitch {rms:.1f} deg rms, elevons within {worst:.1f} deg")
    return lines


_HEAD = f"{'flight':>8}{'model':>8}{'':>8}"


def draw(axes: Sequence[Axes], a: Airframe, rows: Sequence[Comparison]) -> None:
    """Draw the model's curves over the wind with the flight's points: pitch, elevons and thrust.

    Args:
        axes: Three, above one another.
        a: The airframe.
        rows: The comparison.
    """
    curve = [predicted(a, float(wind)) for wind in DRAWN_WINDS]
    for axis, field, label in zip(axes, ("pitch", "elevon", "thrust"), LABELS, strict=True):
        _draw(axis, DRAWN_WINDS, np.array([getattr(at, field) for at in curve]), rows, field)
        axis.set_ylabel(label)
    axes[0].legend(fontsize=7.0)
    axes[-1].set_xlabel("wind [m/s]")


LABELS = ("pitch [deg]", "elevons [deg]", "thrust of rpm [N]")


def _draw(axis: Axes, winds: Array, values: Array, rows: Sequence[Comparison], field: str) -> None:
    axis.plot(winds, values, color="tab:blue", linewidth=1.2, label="model")
    for group, marker, label in ((True, "o", "flight, fitted to"), (False, "x", "flight, predicted")):
        chosen = [row.flown for row in rows if row.fitted == group]
        axis.plot(
            [at.wind for at in chosen], [getattr(at, field) for at in chosen], marker, color="tab:orange", label=label
        )
    axis.grid(alpha=0.3)
