"""Trims of the full plant: attitude, thrust and elevons of straight flight at a speed (report, section 4.1).

In symmetric flight without rates the moment fixes the elevons' share of the normal force whatever the thrust is,
so that the attitude, then the thrust and the elevons, follow in closed form.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sitl.kernels.parameters import Airframe


class Trim(NamedTuple):
    """Straight flight at a speed, whether the actuators can hold it or not."""

    speed: float  # through the air [m/s]
    climb: float  # angle of the path above the horizon [rad]
    theta: float  # nose above the horizon [rad]
    thrust: float  # of each motor [N]
    delta: float  # of each elevon [rad]
    omega: float  # of each propeller [rad/s]; 0 where the thrust would have to be negative
    margin: float  # what the elevons have left [rad]; negative: outside their limits
    motor_margin: float  # what the motors have left to their nearer limit [rad/s]

    @property
    def exists(self) -> bool:
        """Whether the actuators can hold it."""
        return self.margin >= 0.0 and self.motor_margin >= 0.0


def level_trim(a: Airframe, speed: float, climb: float = 0.0) -> Trim:
    """The trim at a speed.

    The nose's elevation does not depend on the elevons' effectiveness, only on the ratio xi_f / xi_m: that is the
    elevons' download over the wing's lift when their moments cancel.

    Args:
        a: The airframe.
        speed: Through the air [m/s], >= 0.
        climb: Angle of the path above the horizon [rad], level by default.
    """
    h, weight = 0.5 * a.rho * a.S * speed, a.m * a.g
    lift = h * a.C_l * (1.0 - a.xi_f / a.xi_m) * speed  # of wing and elevons together, per sine of incidence
    theta = math.atan2(weight + lift * math.sin(climb), lift * math.cos(climb))
    vx, vz = speed * math.cos(theta - climb), -speed * math.sin(theta - climb)

    # 2 (1 - X C_d0) T = m g sin(theta) + h C_d0 (vx - xi_f delta vz) makes T = T0 + T1 delta
    both = 2.0 * (1.0 - a.S_ratio * a.C_d0)
    T0, T1 = (weight * math.sin(theta) + h * a.C_d0 * vx) / both, -h * a.C_d0 * a.xi_f * vz / both
    # and the elevons' force, 2 delta C_l xi_f (X T + h vx / 2) = -h C_l vz xi_f / xi_m, a quadratic in delta
    quadratic, linear = a.S_ratio * T1, a.S_ratio * T0 + 0.5 * h * vx
    needed = -0.5 * h * vz / a.xi_m
    delta = 0.0 if needed == 0.0 else _root(quadratic, linear, needed)
    thrust = T0 + T1 * delta
    omega = math.sqrt(max(thrust, 0.0) / a.k_f)
    motor_margin = min(omega - a.omega_min, a.omega_max - omega)
    return Trim(speed, climb, theta, thrust, delta, omega, a.delta_max - abs(delta), motor_margin)


def _root(quadratic: float, linear: float, constant: float) -> float:
    """The root of quadratic x^2 + linear x = constant that continues constant / linear."""
    discriminant = linear * linear + 4.0 * quadratic * constant
    if discriminant < 0.0:
        return math.inf
    slope = linear + math.copysign(math.sqrt(discriminant), linear)
    return 2.0 * constant / slope if slope != 0.0 else math.inf
