"""Level trims of the full plant: the attitude, thrust and elevons that fly straight at a speed (report, 4.1)."""

from __future__ import annotations

import math
from typing import NamedTuple

from sitl.errors import SitlError
from sitl.kernels.aerodynamics import wrench
from sitl.kernels.parameters import Airframe


class TrimError(SitlError):
    """The equations have no solution near any guess."""


class Trim(NamedTuple):
    """Straight and level flight at a speed."""

    speed: float  # [m/s]
    theta: float  # nose above the horizon [rad]
    thrust: float  # of each motor [N]
    delta: float  # of each elevon [rad]
    omega: float  # of each propeller [rad/s]
    margin: float  # what the elevons have left [rad]; negative: outside their limits

    @property
    def exists(self) -> bool:
        """Whether the actuators can hold it."""
        return self.margin >= 0.0


def level_trim(a: Airframe, speed: float) -> Trim:
    """The trim at a speed, limits or not.

    Args:
        a: The airframe.
        speed: Through the air [m/s], >= 0.

    Raises:
        TrimError: If no solution is found.
    """
    from scipy.optimize import root  # noqa: PLC0415 - a second that only designs need

    def residual(z: tuple[float, float, float]) -> tuple[float, float, float]:
        theta, thrust, delta = z
        w = math.sqrt(max(thrust, 0.0) / a.k_f)
        vx, vz = speed * math.cos(theta), -speed * math.sin(theta)
        Fx, _, Fz, _, My, _ = wrench(vx, 0.0, vz, 0.0, 0.0, 0.0, w, w, delta, delta, a)
        weight = a.m * a.g
        return Fx - weight * math.sin(theta), Fz - weight * math.cos(theta), 100.0 * My

    hover = 0.5 * a.m * a.g
    for guess in (max(0.5 * math.pi - 0.11 * speed, 0.05), 1.0, 0.5, 0.2, 0.08):
        found = root(residual, (guess, hover * max(0.25, math.sin(guess)), 0.2))
        if found.success and found.x[1] > 0.0:
            theta, thrust, delta = (float(value) for value in found.x)
            return Trim(speed, theta, thrust, delta, math.sqrt(thrust / a.k_f), a.delta_max - abs(delta))
    raise TrimError(f"no level trim found at {speed:g} m/s")
