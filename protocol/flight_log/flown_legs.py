"""Legs in a log: what each took, from the decision how to fly it until the vehicle arrived, before any hold.

A leg of a mission ends where its item is reached, or where the vehicle came to rest at it before that: within
``WITHIN`` and ``AT_REST``, as the bounds count. One to a place of no mission (a go-to, a stage of a flight plan) ends
where it comes to rest at its target.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from protocol.dialect.vocabulary import LegMode
from protocol.flight_log.flight_clock import FlightClock
from protocol.flight_log.leg_bounds import AIRFRAME, LegCost, lacks_bound, leg_bound
from protocol.units import NO_ITEM

STANDS = 1.5  # slower over ground, a leg begins and ends in a hover, as the bounds do [m/s]
WITHIN, AT_REST = 0.5, 0.5  # of its end: the vehicle has arrived [m], [m/s]
END_STRETCH = 10.0  # the first and the last part of a leg, a third of short ones [m]
TARGET_ERROR, TARGET_SHARE = 1.0, 0.05  # of a leg's length, by which its target may lie off [m], [m/m]
LEGS_TITLE = f"legs as flown, of the least of {AIRFRAME} from hover to hover, interpolated"

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class LoggedLeg:
    """A leg that was flown to its end, on the vehicle's clock."""

    time: float  # of its beginning in the log [s]
    seq: int | None  # mission item at its end
    distance: float  # [m]
    climb: float  # [m]
    flown_time: float  # [s]
    flown_energy: float  # [J]
    predicted_time: float = math.nan  # of the way that was decided; NaN: of none, or an impossible one [s]
    predicted_energy: float = math.nan  # likewise [J]
    bound_time: float  # NaN: outside of the table, or not from hover to hover [s]
    bound_energy: float  # likewise [J]
    no_bound: str = ""  # why there is none, in few words
    parts: tuple[LegCost, ...] = ()  # its start, middle and stop; empty without positions, or of a leg too short


def flown_legs(clock: FlightClock) -> tuple[LoggedLeg, ...]:
    """Legs of a vehicle with a decision at their beginning, in order.

    Args:
        clock: The vehicle's, in its log.
    """
    record, told = _Record(clock), clock.reader.columns("DARKO_DECISION", clock.source)
    made = clock.times_of("DARKO_DECISION").tolist()
    decisions = [{name: column[k].item() for name, column in told.items()} for k in range(len(made))]
    found, passed = [], -math.inf
    for k, decision in enumerate(decisions):
        begin = max(made[k], passed)  # a leg behind one that was flown through is decided before that ends
        end = _end(record, decision, begin, [*made[k + 1 : k + 3], math.inf])
        passed = end if end is not None else -math.inf
        if end is not None:
            found.append(_leg(record, decision, begin, end))
    return tuple(found)


def _end(record: _Record, decision: Mapping[str, Any], begin: float, later: list[float]) -> float | None:
    """Time at which a leg was over [s]; None if it never was.

    Args:
        record: Of the flight.
        decision: DARKO_DECISION.
        begin: Of the leg [s].
        later: Times of the next decisions, then infinity [s]: one that is flown through is reached behind the next.
    """
    if decision["seq"] == NO_ITEM:
        place = record.target_from(begin, later[0], decision["distance"])
        return None if place is None else record.arrival(place, begin, later[0])
    reached = record.reached_at(decision["seq"], begin, later[min(1, len(later) - 1)])
    if reached is None:
        return None
    place = record.target_from(begin, reached, decision["distance"])
    return (None if place is None else record.arrival(place, begin, reached)) or reached


def _leg(record: _Record, decision: Mapping[str, Any], begin: float, end: float) -> LoggedLeg:
    question = tuple(float(decision[name]) for name in ("distance", "climb", "tail_wind", "cross_wind"))
    no_bound = _not_from_hover_to_hover(record.speed(begin), record.speed(end)) or lacks_bound(*question)
    least = (None if no_bound else leg_bound(*question)) or LegCost(math.nan, math.nan)
    predicted = _predicted(decision)
    return LoggedLeg(
        time=begin,
        seq=None if decision["seq"] == NO_ITEM else int(decision["seq"]),
        distance=question[0],
        climb=question[1],
        flown_time=end - begin,
        flown_energy=record.drawn(end) - record.drawn(begin),
        predicted_time=predicted.time,
        predicted_energy=predicted.energy,
        bound_time=least.time,
        bound_energy=least.energy,
        no_bound=no_bound,
        parts=record.parts(begin, end),
    )


def _not_from_hover_to_hover(before: float, after: float) -> str:
    """The reason why a leg with these speeds over ground at its ends [m/s] has no bound; empty if they do not say."""
    if math.isnan(before) or math.isnan(after):
        return "no positions in the log"
    if before > STANDS:
        return "begins in flight"
    return "passes its end without a stop" if after > STANDS else ""


def _predicted(decision: Mapping[str, Any]) -> LegCost:
    """Time and energy of the way that a decision chose; NaN of none, or of an impossible one."""
    way = {LegMode.HOVER: "hover", LegMode.FORWARD: "forward"}.get(decision["way"])
    time, energy = (math.nan, math.nan) if way is None else (decision[f"{way}_time"], decision[f"{way}_energy"])
    return LegCost(time, energy) if math.isfinite(time) and math.isfinite(energy) else LegCost(math.nan, math.nan)


def leg_name(leg: LoggedLeg) -> str:
    """A leg by its item and its length: "leg to 3, 40 m", or "leg, 40 m" to no item."""
    return f"leg{'' if leg.seq is None else f' to {leg.seq}'}, {leg.distance:.0f} m"


def leg_costs(leg: LoggedLeg) -> str:
    """Time and energy of a leg in words, with its bound and the ratio, or why there is none, and its prediction."""
    time = f"{leg.flown_time:.1f} s{_over(leg.flown_time, leg.bound_time, 1)}"
    costs = f"{time}, {leg.flown_energy:.0f} J{_over(leg.flown_energy, leg.bound_energy, 0)}"
    if leg.no_bound:
        costs += f" (no least: {leg.no_bound})"
    if math.isnan(leg.predicted_time):
        return costs
    return f"{costs} (predicted {leg.predicted_time:.1f} s, {leg.predicted_energy:.0f} J)"


def leg_parts(leg: LoggedLeg) -> str:
    """Time and energy of a leg's parts: "start 2.9 s 410 J, middle 4.1 s 350 J, stop 5.7 s 640 J"; or empty."""
    named = zip(("start", "middle", "stop"), leg.parts, strict=False)
    return ", ".join(f"{name} {part.time:.1f} s {part.energy:.0f} J" for name, part in named)


def _over(flown: float, least: float, places: int) -> str:
    return "" if math.isnan(least) else f" of {least:.{places}f}: {flown / least:.2f}"


class _Record:
    """The messages that legs are read from, in the order in which the vehicle made them.

    Args:
        clock: The vehicle's, in its log.
    """

    def __init__(self, clock: FlightClock) -> None:
        self._clock = clock

    def _series(self, name: str, fields: str | tuple[str, ...]) -> tuple[Floats, Floats]:
        """Times of a message [s], shape (n,), and fields of it, shape (n, k)."""
        times = self._clock.times_of(name)
        order = np.argsort(times, kind="stable")
        columns = self._clock.reader.columns(name, self._clock.source)
        values = np.stack([columns[field].astype(np.float64) for field in fields], axis=1)
        return times[order], values[order]

    @cached_property
    def _motion(self) -> tuple[Floats, Floats]:
        return self._series("LOCAL_POSITION_NED", ("x", "y", "z", "vx", "vy", "vz"))

    @cached_property
    def _targets(self) -> tuple[Floats, Floats]:
        return self._series("POSITION_TARGET_LOCAL_NED", ("x", "y", "z"))

    @cached_property
    def _energy(self) -> tuple[Floats, Floats]:
        return self._series("DARKO_ENERGY", ("energy",))

    @cached_property
    def _reached(self) -> tuple[Floats, Floats]:
        return self._series("MISSION_ITEM_REACHED", ("seq",))

    def drawn(self, time: float) -> float:
        """Energy used until a time [J]; NaN without the message that tells it."""
        times, energy = self._energy
        return float(np.interp(time, times, energy[:, 0])) if len(times) else math.nan

    def speed(self, time: float) -> float:
        """Speed over ground [m/s]; NaN without positions, so that nothing is known to hover."""
        times, motion = self._motion
        return float(np.interp(time, times, np.linalg.norm(motion[:, 3:], axis=1))) if len(times) else math.nan

    def place(self, time: float) -> Floats:
        """Position NED [m], shape (3,)."""
        times, motion = self._motion
        return np.array([np.interp(time, times, motion[:, axis]) for axis in range(3)])

    def reached_at(self, seq: int, begin: float, until: float) -> float | None:
        """Time at which an item was told to be reached, within a span [s]."""
        times, items = self._reached
        found = times[(times > begin) & (times <= until) & (items[:, 0] == seq)]
        return float(found[0]) if len(found) else None

    def target_from(self, begin: float, until: float, distance: float) -> Floats | None:
        """The target of a leg so long (level) [m], NED [m]; None if none is told within a span, or no positions."""
        times, targets = self._targets
        if not len(self._motion[0]):
            return None
        off = np.linalg.norm(targets[:, :2] - self.place(begin)[:2], axis=1) - distance
        found = targets[(times >= begin) & (times < until) & (np.abs(off) <= TARGET_ERROR + TARGET_SHARE * distance)]
        return found[0] if len(found) else None

    def arrival(self, place: Floats, begin: float, until: float) -> float | None:
        """Time at which the vehicle came to rest at a place, within a span [s]; None if it did not."""
        times, motion = self._motion
        at_rest = np.linalg.norm(motion[:, 3:], axis=1) <= AT_REST
        there = (np.linalg.norm(motion[:, :3] - place, axis=1) <= WITHIN) & at_rest
        found = times[there & (times > begin) & (times <= until)]
        return float(found[0]) if len(found) else None

    def parts(self, begin: float, end: float) -> tuple[LegCost, ...]:
        """Time and energy of the first metres of a leg, of what is between, and of the last metres."""
        times, motion = self._motion
        if not len(times):
            return ()
        start, way = self.place(begin), (self.place(end) - self.place(begin))[:2]
        length = float(np.linalg.norm(way))
        if length < END_STRETCH:
            return ()
        within = (times >= begin) & (times <= end)
        along = (motion[within, :2] - start[:2]) @ way / length
        edge = min(END_STRETCH, length / 3.0)
        marks = [begin, *self._passed(times[within], along, (edge, length - edge)), end]
        return tuple(
            LegCost(after - before, self.drawn(after) - self.drawn(before)) for before, after in pairwise(marks)
        )

    @staticmethod
    def _passed(times: Floats, along: Floats, lengths: tuple[float, float]) -> Iterator[float]:
        """The first times at which the vehicle was so far along [s]."""
        for length in lengths:
            beyond = np.flatnonzero(along >= length)
            yield float(times[beyond[0]] if len(beyond) else times[-1])
