"""The three constants of the aircraft's set that its flight before the wind wall was asked for, fitted anew.

Only the stretches that are shared are looked at. What the thesis measured stays: the moment of the elevons in the
hover, by which their share of the wing's force follows, and where a plate across the stream has its force.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from sitl import Airframe, Array
from sitl.lab.validation.wall_flight import FLIGHT, Comparison, FlownRow, compared
from sitl.model.airframe import elevon_arm, slipstream_slope

THRUST_DEVIATION = 0.02  # as a share, that counts for as much as a degree of pitch or elevon
FIT_STEP = 1e-3  # of the differences, as a share


class WallFit(NamedTuple):
    """Constants that the flight tells."""

    C_d0: float  # by the motors' speed [-]
    stall_angle: float  # by the pitch and the elevons [deg]
    C_90: float  # likewise [-]
    airframe: Airframe  # with these


def fit(a: Airframe, flight: Sequence[FlownRow] = FLIGHT) -> WallFit:
    """Least squares of pitch, elevons and thrust over the fitted rows, from the set's own constants on."""
    shared = [row for row in flight if row.fitted]
    start = np.array([a.C_d0, 1.0 / math.sqrt(a.per_stall), a.C_90])

    def residuals(x: Array) -> Array:
        return np.concatenate([_weighed(row) for row in compared(_with(a, x), shared)])

    found = least_squares(residuals, start, x_scale=start, diff_step=FIT_STEP).x
    C_d0, sine, C_90 = (float(value) for value in found)
    return WallFit(C_d0, math.degrees(math.asin(sine)), C_90, _with(a, found))


def _weighed(row: Comparison) -> Array:
    return np.array([row.pitch_error, row.elevon_error, row.thrust_error / THRUST_DEVIATION])


def _with(a: Airframe, x: Array) -> Airframe:
    """The airframe with other constants, the elevons' moment in the hover and the plate's force where they were."""
    C_d0, sine, C_90 = (float(value) for value in x)
    other = a._replace(C_d0=C_d0, per_stall=1.0 / sine**2, C_90=C_90)
    xi_f = a.xi_f * slipstream_slope(a) / slipstream_slope(other)
    kept = a.cp_shift * (1.0 - a.xi_f)
    return other._replace(xi_f=xi_f, xi_m=elevon_arm(a) / a.Delta_r * xi_f, cp_shift=kept / (1.0 - xi_f))


def as_text(found: WallFit) -> list[str]:
    """The fitted constants, as lines of text."""
    return [
        "fitted to the shared stretches alone, from the set's constants on:",
        f"C_d0 {found.C_d0:.4f}, stall_angle {found.stall_angle:.2f} deg, C_90 {found.C_90:.3f}; "
        f"with these xi_f {found.airframe.xi_f:.4f}",
    ]
