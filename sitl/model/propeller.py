r"""Thrust and torque of a propeller by its speed and the air along its axis.

With n the revolutions per second, D the diameter and J = V / (n D) the advance ratio, a propeller's coefficients are

.. math::
    T = \rho n^2 D^4 C_T(J), \quad Q = \frac{1}{2\pi} \rho n^2 D^5 C_P(J),

quadratic in J, the torque with a bend at the advance ratio where its blades unload. Written in w and V they need no
division: a stopped propeller, a windmilling and a braking one are in the same text. J |J| in place of J^2 lets the air
from behind brake too. Without the terms in V this is the report's k_f w^2 and k_m w^2. A bench that finds thrust to
grow faster than w^2 adds a term in w, and air across the disc pushes the hub along with it, by k_h w of its speed.
"""

from __future__ import annotations

import math

from sitl.compiled import kernel
from sitl.model.airframe import Airframe


@kernel
def thrust(speed: float, inflow: float, a: Airframe) -> float:
    """Thrust [N] at a speed [rad/s] in air that comes along the axis [m/s]."""
    return a.k_f * speed * speed + a.k_fv * speed * inflow + a.k_fvv * inflow * abs(inflow) + a.k_fw * speed


@kernel
def speed_for(wanted: float, inflow: float, a: Airframe) -> float:
    """The speed [rad/s] that gives a thrust [N]; 0 where it takes none."""
    per_thrust = 1.0 / a.k_f
    half = 0.5 * per_thrust * a.k_fv * inflow + 0.5 * per_thrust * a.k_fw
    square = per_thrust * (wanted - a.k_fvv * inflow * abs(inflow)) + half * half
    return max(math.sqrt(max(square, 0.0)) - half, 0.0)


@kernel
def hover_speed(a: Airframe) -> float:
    """The speed of both propellers [rad/s] in a hover in calm; 0 where they cannot carry it by any."""
    return speed_for(a.m * a.g / (2.0 * (1.0 - a.S_ratio * a.C_d0)), 0.0, a)


@kernel
def torque(speed: float, inflow: float, a: Airframe) -> float:
    """Torque that turns it [N m]; negative where the air turns it."""
    return a.k_m * speed * speed + torque_by_air(speed, inflow, a)


@kernel
def torque_difference(left: float, right: float, inflow: float, a: Airframe) -> float:
    """Torque of the left propeller less that of the right one [N m]."""
    return a.k_m * (left * left - right * right) + (torque_by_air(left, inflow, a) - torque_by_air(right, inflow, a))


@kernel
def torque_by_air(speed: float, inflow: float, a: Airframe) -> float:
    """The torque's share of the air along the axis [N m]."""
    unloaded = max(inflow - a.advance_knot * speed, 0.0)
    return a.k_mv * speed * inflow + a.k_mvv * inflow * abs(inflow) + a.k_mk * unloaded * unloaded
