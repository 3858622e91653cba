r"""Quasi-steady flight: the attitude, thrust and elevons that give a force in a stream of air.

.. math::
    x_d \parallel F + L (v_a - (v_a \cdot y) y), \qquad
    L = \tfrac12 \rho S |v_a| C_l (1 - \xi_f / \xi_m)

in the report's aerodynamics; where the wing stalls, L depends on the incidence and is found with it.

The frame is a leg's: x along it, y to its left, z up, origin at its beginning.
"""

from typing import NamedTuple

from sitl.compiled import kernel, subroutine
from sitl.model import propeller
from sitl.model.aerodynamics import slopes, trimmed_slope
from sitl.model.airframe import STALL, Airframe, elevon_arm
from sitl.model.arithmetic import clipped, sine_cosine
from sitl.model.battery import drawn_power
from sitl.model.state import Actuators
from sitl.model.vectors import Vector, add_scaled, cross, dot, norm, scaled, subtract

PASSES = 10  # of incidence and slope, where the wing stalls
SLOW_AIR = 1.0  # slower air decides nothing [m/s]
MIN_GRIP = 1e-3  # of both elevons [N/rad]


class Equilibrium(NamedTuple):
    """Attitude, thrust and elevons that give a force."""

    nose: Vector  # unit
    thrust: float  # of each motor, within its limits or not [N]
    elevons: float  # of both [rad]


class Push(NamedTuple):
    """The acceleration that motors and air give where one is wanted, and what it takes."""

    acceleration: Vector  # [m/s2]
    elevons: float  # of both [rad]
    power: float  # of both propellers [W]


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
    level_air = add_scaled(v_a, y, -dot(v_a, y))
    # An attached wing is tried first: it needs the least thrust.
    x, thrust = (_unit(level_air) if norm(level_air) > SLOW_AIR else _unit(force)), 0.0
    stream = slopes(in_axes(v_a, x, y, cross(x, y)), thrust, thrust, a)
    for _ in range(PASSES if a.aerodynamics == STALL else 1):
        x = add_scaled(force, level_air, trimmed_slope(stream, a))
        x = _unit(add_scaled(x, y, -dot(x, y)))
        v_b = in_axes(v_a, x, y, cross(x, y))
        thrust = 0.5 * (dot(force, x) + stream.drag * v_b.x) / (1.0 - a.S_ratio * a.C_d0)
        given = limited_thrust(thrust, v_b.x, a)
        stream = slopes(v_b, given, given, a)
    grip = max(stream.left_elevon + stream.right_elevon, MIN_GRIP)
    delta = -stream.moment * dot(v_a, cross(x, y)) / (elevon_arm(a) * grip)
    return Equilibrium(x, thrust, delta)


@kernel
def pushed(wanted: Vector, v_a: Vector, ahead: Vector, a: Airframe) -> Push:
    """Push towards a wanted acceleration [m/s2], within the motors' limits; the others as for :func:`equilibrium`."""
    nose, thrust, elevons = equilibrium(add_scaled(weight(a), wanted, a.m), v_a, ahead, a)
    # What the motors cannot give, or not take back, is missing from the acceleration.
    inflow = dot(nose, v_a)
    excess = limited_thrust(thrust, inflow, a) - thrust
    real = add_scaled(wanted, nose, 2.0 * (1.0 - a.S_ratio * a.C_d0) * excess / a.m)
    return Push(real, elevons, power(thrust, inflow, a))


@kernel
def looking_ahead(heading: float, v_a: Vector, blend_from: float, blend_to: float) -> Vector:
    """Direction that decides the span: the heading [rad], which between two airspeeds gives way to air from ahead."""
    belly = level(heading)
    meeting = v_a.x * belly.x + v_a.y * belly.y
    share = clipped((meeting - blend_from) / (blend_to - blend_from), 0.0, 1.0)
    share = share * share * (3.0 - 2.0 * share)
    return add_scaled(scaled(belly, 1.0 - share), v_a, share / max(norm(v_a), 1e-6))


@kernel
def in_axes(a: Vector, x: Vector, y: Vector, z: Vector) -> Vector:
    """A vector by its components along three axes."""
    return Vector(dot(a, x), dot(a, y), dot(a, z))


@kernel
def limited_thrust(thrust: float, inflow: float, a: Airframe) -> float:
    """Thrust of a motor, limited, for a thrust asked for [N], with the air along the nose [m/s]."""
    return clipped(thrust, propeller.thrust(a.omega_min, inflow, a), propeller.thrust(a.omega_max, inflow, a))


@kernel
def power(thrust: float, inflow: float, a: Airframe) -> float:
    """Power drawn for both propellers, each at a thrust asked for, with the air along the nose [W]."""
    speed = propeller.speed_for(limited_thrust(thrust, inflow, a), inflow, a)
    return drawn_power(Actuators(speed, speed, 0.0, 0.0), inflow, a)


@kernel
def steady_power(v_a: Vector, ahead: Vector, a: Airframe) -> float:
    """Power of flight without acceleration [W]; arguments as for :func:`equilibrium`."""
    held = equilibrium(weight(a), v_a, ahead, a)
    return power(held.thrust, dot(v_a, held.nose), a)


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
