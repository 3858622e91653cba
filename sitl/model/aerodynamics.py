"""Forces and moments of air and propellers on the body, at the level that the airframe names.

* ``report``: the phi-theory model as the report prints it (:mod:`sitl.model.phi_theory`).
* ``passive``: the same, with the force from body rates transposed and the elevons' drag: a still wing gains no energy.
* ``stall``: surfaces that the air leaves, and a slipstream that keeps its part attached (:mod:`sitl.model.stall`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sitl.compiled import kernel
from sitl.model import phi_theory, stall
from sitl.model.airframe import PASSIVE, REPORT, STALL, Airframe, Array, elevon_arm, slipstream_slope
from sitl.model.propeller import thrust
from sitl.model.state import Actuators
from sitl.model.vectors import Vector, norm


class Slopes(NamedTuple):
    """Forces about zero elevons and no rates, each divided by what it is proportional to."""

    normal: float  # of the wing: -F_z / v_z [N s/m]
    moment: float  # of the wing: -M_y / v_z [N s]
    drag: float  # of the free stream: -F_x / v_x [N s/m]
    left_elevon: float  # -F_z by its deflection [N/rad]
    right_elevon: float


@kernel
def wrench(v: Vector, w: Vector, actuators: Actuators, a: Airframe) -> tuple[Vector, Vector]:
    """Sum of forces [N] and of moments [N m] in the body frame FLU.

    Args:
        v: Velocity relative to the air, body FLU [m/s].
        w: Body rates [rad/s].
        actuators: Propeller speeds [rad/s] and elevon deflections, positive nose-up [rad].
        a: The airframe.
    """
    if a.aerodynamics == REPORT:
        return phi_theory.wrench(v, w, actuators, a)
    if a.aerodynamics == PASSIVE:
        return phi_theory.passive_wrench(v, w, actuators, a)
    return stall.wrench(v, w, actuators, a)


@kernel
def normal_force(v: Vector, w: Vector, actuators: Actuators, a: Airframe) -> float:
    """The force along z_b alone, to the bit that of :func:`wrench`, whose arguments it has [N]."""
    if a.aerodynamics == REPORT:
        return phi_theory.wrench(v, w, actuators, a)[0].z
    if a.aerodynamics == PASSIVE:
        return phi_theory.passive_wrench(v, w, actuators, a)[0].z
    return stall.normal_force(v, w, actuators, a)


@kernel
def slopes(v: Vector, T1: float, T2: float, a: Airframe) -> Slopes:
    """Aerodynamic slopes in a stream at given thrusts [N], which the laws and the trims invert.

    Args:
        v: Velocity relative to the air, body FLU [m/s].
        T1: Thrust of the left propeller [N].
        T2: Thrust of the right one [N].
        a: The airframe.
    """
    if a.aerodynamics == STALL:
        left, right = stall.side_slopes(v, T1, a), stall.side_slopes(v, T2, a)
        return Slopes(
            normal=left.normal + right.normal,
            moment=left.moment + right.moment,
            drag=left.drag + right.drag,
            left_elevon=left.elevon,
            right_elevon=right.elevon,
        )
    h = 0.5 * a.rho * a.S * norm(v)
    stream = 0.5 * a.C_l * a.xi_f * h * v.x
    per_thrust = a.S_ratio * a.C_l * a.xi_f
    return Slopes(
        normal=h * a.C_l,
        moment=h * (a.C_l * a.Delta_r),
        drag=h * a.C_d0,
        left_elevon=per_thrust * T1 + stream,
        right_elevon=per_thrust * T2 + stream,
    )


@kernel
def side_force(v: Vector, actuators: Actuators, a: Airframe) -> float:
    """Force along y_b of the air that crosses both discs in a sideslip [N]; arguments as for :func:`wrench`."""
    return -a.k_h * (actuators.left_motor + actuators.right_motor) * v.y


@kernel
def trimmed_slope(s: Slopes, a: Airframe) -> float:
    """Normal force per v_z of the wing and of the elevons that take its moment away [N s/m]."""
    return s.normal - s.moment / elevon_arm(a)


@kernel
def thrusts(actuators: Actuators, inflow: float, a: Airframe) -> tuple[float, float]:
    """Thrusts of both propellers [N]."""
    return thrust(actuators.left_motor, inflow, a), thrust(actuators.right_motor, inflow, a)


# The simplified hover model m v' = R F_b u - m g, J w' = M_b u - w × J w (report, section 2.2.1). Its input is
# u = (T1, T2, delta1 T1, delta2 T2); what depends on the airspeed is left out.


def force_matrix(a: Airframe) -> Array:
    """Input matrix F_b of the forces, (3, 4)."""
    thrust = 1.0 - a.S_ratio * a.C_d0
    lift = a.S_ratio * slipstream_slope(a) * a.xi_f
    return np.array([[thrust, thrust, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0], [0.0, 0.0, -lift, -lift]])


def moment_matrix(a: Airframe) -> Array:
    """Input matrix M_b of the moments, (3, 4), in the signs of the frame FLU."""
    torque = a.k_m / a.k_f
    slope = slipstream_slope(a)
    roll = a.S_ratio * a.a_y * slope * a.xi_f
    pitch = a.S_ratio * a.Delta_r * slope * a.xi_m
    yaw = a.p_y - a.S_ratio * a.a_y * a.C_d0
    return np.array([[torque, -torque, -roll, roll], [0.0, 0.0, -pitch, -pitch], [-yaw, yaw, 0.0, 0.0]])


def inertia(a: Airframe) -> Array:
    """Principal inertias, (3,) [kg m2]."""
    return np.array([a.J1, a.J2, a.J3])
