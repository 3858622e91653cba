"""Units that differ by a factor alone: curves of a chart in such units share an axis."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

DEGREE = math.pi / 180.0
UNIT_FAMILIES: tuple[Mapping[str, float], ...] = (  # of one quantity each, in the first unit
    {"m": 1.0, "dm": 0.1, "cm": 1e-2, "mm": 1e-3, "km": 1e3},
    {"m/s": 1.0, "dm/s": 0.1, "cm/s": 1e-2, "mm/s": 1e-3, "km/h": 1.0 / 3.6},
    {"rad": 1.0, "mrad": 1e-3, "deg": DEGREE, "ddeg": 0.1 * DEGREE, "cdeg": 1e-2 * DEGREE, "degE7": 1e-7 * DEGREE},
    {"rad/s": 1.0, "mrad/s": 1e-3, "deg/s": DEGREE, "cdeg/s": 1e-2 * DEGREE},
    {"s": 1.0, "ds": 0.1, "cs": 1e-2, "ms": 1e-3, "us": 1e-6, "ns": 1e-9},
    {"V": 1.0, "cV": 1e-2, "mV": 1e-3},
    {"A": 1.0, "dA": 0.1, "cA": 1e-2, "mA": 1e-3},
    {"J": 1.0, "hJ": 1e2, "kJ": 1e3},
    {"%": 1.0, "d%": 0.1, "c%": 1e-2},
    {"Pa": 1.0, "hPa": 1e2, "kPa": 1e3, "mbar": 1e2},
    {"gauss": 1.0, "mgauss": 1e-3},
    {"degC": 1.0, "cdegC": 1e-2},
    {"Ah": 1.0, "mAh": 1e-3},
)


def shared_units(units: Iterable[str]) -> dict[str, tuple[str, float]]:
    """The unit of the axis of each unit, and the factor into it: of one quantity, the unit that comes first.

    Args:
        units: Of the curves of a chart, in their order.
    """
    shared: dict[str, tuple[str, float]] = {}
    for unit in units:
        family = next((family for family in UNIT_FAMILIES if unit in family), {unit: 1.0})
        first = next((axis for axis, _ in shared.values() if axis in family), unit)
        shared.setdefault(unit, (first, family[unit] / family[first]))
    return shared
