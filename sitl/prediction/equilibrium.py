r"""Quasi-steady flight: the attitude, thrust and elevons that give a force in a stream of air.

.. math::
    x_d \parallel F + L |v_a| (v_a - (v_a \cdot y) y), \qquad L = \tfrac12 \rho S C_l (1 - \xi_f / \xi_m)

The frame is a leg's: x along it, y to its left, z up, origin at its beginning.
"""

import math
from typing import NamedTuple

from sitl.compiled import kernel, subroutine
from sitl.model.airframe import Airframe
from sitl.model.arithmetic import clipped, sine_cosine
from sitl.model.vectors import Vector, add_scaled, cross, dot, norm, scaled, subtract


class Equilibrium(NamedTuple):
    """How a force is given."""

    nose: Vector  # unit
    thrust: float  # of each motor, within its limits or not [N]
    elevons: float  # of both [rad]


@subroutine
def equilibrium(force: Vector, v_a: Vector, ahead: Vector, a: Airframe) -> Equilibrium:
    """Nose direction, thrust and elevons that give a force.

    Args:
        force: Aerodynamic force wanted, what carries the weight included [N].
        v_a: Velocity through the air [m/s].
        ahead: Where the belly points, level: decides the span where the air does not.
        a: The airframe.
    """
    y = _unit(cross(force, ahead))
    slip, speed = dot(v_a, y), norm(v_a)
    h = 0.5 * a.rho * a.S * speed
    x = add_scaled(force, add_scaled(v_a, y, -slip), h * a.C_l * (1.0 - a.xi_f / a.xi_m))
    x = _unit(add_scaled(x, y, -dot(x, y)))
    vx, vz = dot(v_a, x), dot(v_a, cross(x, y))
    thrust = 0.5 * (dot(force, x) + h * a.C_d0 * vx) / (1.0 - a.S_ratio * a.C_d0)
    grip = max(a.S_ratio * limited_thrust(thrust, a) + 0.5 * h * vx, 1e-3)
    return Equilibrium(x, thrust, -0.5 * h * vz / (a.xi_m * grip))


@kernel
def limited_thrust(thrust: float, a: Airframe) -> float:
    """What a motor gives of a thrust asked for [N]."""
    return clipped(thrust, a.k_f * a.omega_min * a.omega_min, a.k_f * a.omega_max * a.omega_max)


@kernel
def shaft_power(thrust: float, a: Airframe) -> float:
    """Power of both propellers, each at a thrust asked for [W]."""
    square = limited_thrust(thrust, a) / a.k_f
    return 2.0 * a.k_m * square * math.sqrt(square)


@kernel
def steady_power(v_a: Vector, ahead: Vector, a: Airframe) -> float:
    """Power of flight without acceleration [W]; arguments as for :func:`equilibrium`."""
    return shaft_power(equilibrium(weight(a), v_a, ahead, a).thrust, a)


@kernel
def weight(a: Airframe) -> Vector:
    """The force that carries the vehicle [N]."""
    return Vector(0.0, 0.0, a.m * a.g)


@kernel
def level(heading: float) -> Vector:
    """The level direction of a heading."""
    sine, cosine = sine_cosine(heading)
    return Vector(cosine, sine, 0.0)


@kernel
def back(nose: Vector, ahead: Vector) -> Vector:
    """z_b of a nose direction with the belly to a level direction."""
    return cross(nose, _unit(cross(nose, ahead)))


@kernel
def wind_force(wind: Vector, heading: float, a: Airframe) -> Vector:
    """Force of a wind on the vehicle that hovers in it at a heading [N]."""
    held = equilibrium(weight(a), scaled(wind, -1.0), level(heading), a)
    return subtract(weight(a), scaled(held.nose, 2.0 * (1.0 - a.S_ratio * a.C_d0) * held.thrust))


@kernel
def _unit(a: Vector) -> Vector:
    return scaled(a, 1.0 / max(norm(a), 1e-6))
