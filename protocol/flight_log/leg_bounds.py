"""Least time and energy of a leg, interpolated in a small table: no flight of the airframe ``darko`` needs less.

The table, ``leg_bounds.toml``, is of legs from hover to hover that leave 30 % of the actuators for feedback. It is made
by ``scripts/build_leg_bounds.py`` of the answers of ``darko-sitl optimal`` (docs/optimal.md).
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Sequence
from functools import cache
from importlib.resources import files
from typing import Any, NamedTuple

AIRFRAME = "darko"  # of the table
FAINT = 1.0  # crosswinds below this leave a bound as it is [m/s]
AHEAD, BEHIND, ASIDE = "ahead", "behind", "aside"  # from where its wind blows


class LegCost(NamedTuple):
    """Time and energy of a leg."""

    time: float  # [s]
    energy: float  # [J]


@cache
def bound_table() -> dict[str, Any]:
    """The table: ``climb`` [m] and ``wind`` [m/s] of its kinds of leg, ``distances`` [m], each kind's costs."""
    text = files("protocol.flight_log").joinpath("leg_bounds.toml").read_text(encoding="utf-8")
    return tomllib.loads(text)


def leg_bound(distance: float, climb: float, tail_wind: float, cross_wind: float) -> LegCost | None:
    """The bound of a leg from hover to hover; None outside of the table.

    Between the table's rows it goes with the logarithm of the distance, and linearly with climb and winds, whose
    shares add up.

    Args:
        distance: [m].
        climb: [m].
        tail_wind: Wind along the leg [m/s].
        cross_wind: Wind across it, from either side [m/s].
    """
    table = bound_table()
    distances, climbs, wind = table["distances"], table["climb"], table["wind"]
    inside = distances[0] <= distance <= distances[-1] and abs(climb) <= climbs
    if not (inside and abs(tail_wind) <= wind and abs(cross_wind) <= wind):
        return None
    shares = {
        "up" if climb > 0.0 else "down": abs(climb) / climbs,
        BEHIND if tail_wind > 0.0 else AHEAD: abs(tail_wind) / wind,
        ASIDE: abs(cross_wind) / wind if abs(cross_wind) >= FAINT else 0.0,
    }
    level = _at(distance, distances, table["level"])
    times, energies = [level.time], [level.energy]
    for kind, share in shares.items():
        if share == 0.0:
            continue
        if distance > distances[len(table[kind]["time"]) - 1]:
            return None  # the kind has no row so long
        full = _at(distance, distances, table[kind])
        times.append(share * (full.time - level.time))
        energies.append(share * (full.energy - level.energy))
    return LegCost(sum(times), sum(energies))


def lacks_bound(distance: float, climb: float, tail_wind: float, cross_wind: float) -> str:
    """The reason why a leg has no bound, in few words, arguments as of ``leg_bound``; empty where it has one."""
    if leg_bound(distance, climb, tail_wind, cross_wind) is not None:
        return ""
    table = bound_table()
    shortest, longest = table["distances"][0], table["distances"][-1]
    if not all(map(math.isfinite, (distance, climb, tail_wind, cross_wind))):
        return "length or wind not told"
    if distance < shortest:
        return f"shorter than {shortest:.0f} m"
    if distance > longest:
        return f"longer than {longest:.0f} m"
    if abs(climb) > table["climb"]:
        return f"climbs or sinks more than {table['climb']:.0f} m"
    if max(abs(tail_wind), abs(cross_wind)) > table["wind"]:
        return f"wind over {table['wind']:.0f} m/s"
    return "too long for the table with this climb and wind"


def _at(distance: float, distances: Sequence[float], costs: dict[str, list[float]]) -> LegCost:
    """Costs of a kind of leg at a distance within those of the table."""
    after = next(i for i, one in enumerate(distances) if i and distance <= one)
    low, high = distances[after - 1], distances[after]
    share = math.log(distance / low) / math.log(high / low)
    parts = [costs[name][after - 1] + share * (costs[name][after] - costs[name][after - 1]) for name in LegCost._fields]
    return LegCost(*parts)
