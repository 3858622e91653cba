"""Legs of a mission in a log: what each took, from the decision how to fly it until its item was reached."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from protocol.dialect.vocabulary import LegMode
from protocol.flight_log.flight_clock import FlightClock
from protocol.flight_log.leg_bounds import AIRFRAME, LegCost, leg_bound
from protocol.units import NO_ITEM

STANDS = 1.5  # slower over ground, a leg begins and ends in a hover, as the bounds do [m/s]
LEGS_TITLE = f"legs as flown, of the least of {AIRFRAME} from hover to hover, interpolated"

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class LoggedLeg:
    """A leg that was flown to its end, on the vehicle's clock."""

    time: float  # of its beginning in the log [s]
    seq: int  # mission item at its end
    distance: float  # [m]
    climb: float  # [m]
    flown_time: float  # [s]
    flown_energy: float  # [J]
    predicted_time: float = math.nan  # of the way that was decided; NaN: of none, or an impossible one [s]
    predicted_energy: float = math.nan  # likewise [J]
    bound_time: float  # NaN: outside of the table, or not from hover to hover [s]
    bound_energy: float  # likewise [J]


def flown_legs(clock: FlightClock) -> tuple[LoggedLeg, ...]:
    """Legs of a vehicle with a decision at their beginning, in order.

    Args:
        clock: The vehicle's, in its log.
    """
    reader, source = clock.reader, clock.source
    rows, told = reader.rows("DARKO_DECISION", source), reader.columns("DARKO_DECISION", source)
    reached = reader.rows("MISSION_ITEM_REACHED", source)
    items = reader.columns("MISSION_ITEM_REACHED", source)["seq"]
    found = []
    for k, row in enumerate(rows.tolist()):
        until = rows[k + 1] if k + 1 < len(rows) else len(reader)
        ends = reached[(reached > row) & (reached < until) & (items == told["seq"][k])]
        if told["seq"][k] == NO_ITEM or not len(ends):
            continue
        begin, end = float(clock.arrivals[row]), float(clock.arrivals[ends[0]])
        leg = tuple(float(told[name][k]) for name in ("distance", "climb", "tail_wind", "cross_wind"))
        bound = leg_bound(*leg) if max(_speed(clock, begin), _speed(clock, end)) <= STANDS else None
        least = bound or LegCost(math.nan, math.nan)
        predicted = _predicted({name: column[k].item() for name, column in told.items()})
        found.append(
            LoggedLeg(
                time=begin,
                seq=int(told["seq"][k]),
                distance=leg[0],
                climb=leg[1],
                flown_time=end - begin,
                flown_energy=_drawn(clock, end) - _drawn(clock, begin),
                predicted_time=predicted.time,
                predicted_energy=predicted.energy,
                bound_time=least.time,
                bound_energy=least.energy,
            )
        )
    return tuple(found)


def _predicted(decision: Mapping[str, Any]) -> LegCost:
    """Time and energy of the way that a decision chose; NaN of none, or of an impossible one."""
    way = {LegMode.HOVER: "hover", LegMode.FORWARD: "forward"}.get(decision["way"])
    time, energy = (math.nan, math.nan) if way is None else (decision[f"{way}_time"], decision[f"{way}_energy"])
    return LegCost(time, energy) if math.isfinite(time) and math.isfinite(energy) else LegCost(math.nan, math.nan)


def leg_costs(leg: LoggedLeg) -> str:
    """Time and energy of a leg in words, with its prediction, and its bound and the ratio where it has one."""
    time = f"{leg.flown_time:.1f} s{_over(leg.flown_time, leg.bound_time, 1)}"
    costs = f"{time}, {leg.flown_energy:.0f} J{_over(leg.flown_energy, leg.bound_energy, 0)}"
    if math.isnan(leg.predicted_time):
        return costs
    return f"{costs} (predicted {leg.predicted_time:.1f} s, {leg.predicted_energy:.0f} J)"


def _over(flown: float, least: float, places: int) -> str:
    return "" if math.isnan(least) else f" of {least:.{places}f}: {flown / least:.2f}"


def _drawn(clock: FlightClock, time: float) -> float:
    """Energy used until a time [J]; NaN without the message that tells it."""
    return _at(clock, "DARKO_ENERGY", clock.reader.columns("DARKO_ENERGY", clock.source)["energy"], time)


def _speed(clock: FlightClock, time: float) -> float:
    """Speed over ground [m/s]; NaN without positions, so that nothing is known to hover."""
    fields = clock.reader.columns("LOCAL_POSITION_NED", clock.source)
    speeds = np.sqrt(sum(fields[axis].astype(np.float64) ** 2 for axis in ("vx", "vy", "vz")))
    return _at(clock, "LOCAL_POSITION_NED", speeds, time)


def _at(clock: FlightClock, name: str, values: Floats, time: float) -> float:
    """A message's value between the two around a time; NaN without any."""
    times = clock.times_of(name)
    order = np.argsort(times, kind="stable")
    return float(np.interp(time, times[order], values[order])) if len(times) else float("nan")
