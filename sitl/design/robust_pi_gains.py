"""Gains of the robust PI law, from the numbers that its author published, in the frames and signs of this product.

The C headers are for the world NED, the body FRD, the error e = target - state and elevons that lift the trailing edge;
here it is NWU, FLU, x = state - target and elevons that lower it. By the eigenvalues of the closed loop this is the one
choice of signs of which any of the headers is stable (``tests/sitl/lab/studies/test_claims.py``).
"""

from __future__ import annotations

import math
import tomllib
from functools import lru_cache
from importlib.resources import files
from typing import Any

import numpy as np

from sitl.control.robust_pi import RobustPiGains

# Tunings: that which flew, one that knows no wind, the table of the thesis.
WINDY_TUNING, CALM_TUNING, PRINTED_TUNING = "windy", "calm", "printed"
PER_RPM = (30.0 / math.pi) ** 2  # k_f per (rad/s)^2 over that per rpm^2
# Of x over e, NED and FRD to NWU and FLU.
COLUMN_SIGNS = np.array((-1.0, 1.0, 1.0, -1.0, 1.0, 1.0, -1.0, 1.0, -1.0, 1.0, 1.0))
OUTPUT_SIGNS = np.array((1.0, 1.0, -1.0, -1.0))[:, None]  # thrusts, elevons
INTEGRAL_SIGNS = np.array((1.0, -1.0))[:, None]
SET_POINT_SPEED = 1.0  # the pilot's stick moved it by 5 mm in a tick, 2.5 m/s, by hand and not for long [m/s]
HELD_TURN_RATE = 0.5  # of the heading, which the source keeps to the north [rad/s]


@lru_cache(maxsize=4)
def robust_pi_gains(tuning: str = WINDY_TUNING) -> RobustPiGains:
    """The gains of a tuning.

    Args:
        tuning: ``WINDY_TUNING``, ``CALM_TUNING`` or ``PRINTED_TUNING``.
    """
    table: dict[str, Any] = tomllib.loads((files("sitl.design") / "robust_pi.toml").read_text(encoding="utf-8"))
    printed = table[tuning]
    return RobustPiGains(
        K=np.array(printed["K"]) * COLUMN_SIGNS * OUTPUT_SIGNS,
        H=np.array(printed["H"]) * COLUMN_SIGNS * INTEGRAL_SIGNS,
        ahead=np.array(printed["ahead"]),
        back=np.array(printed["back"]),
        thrust=float(printed["thrust"]),
        k_f=float(printed["k_f"]) * PER_RPM,
        set_point_speed=SET_POINT_SPEED,
        turn_rate=HELD_TURN_RATE,
    )
