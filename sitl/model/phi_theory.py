"""Forces and moments of the phi-theory model on the body (report, section "Représentation dynamique").

Each half wing sits in its propeller's slipstream and in the free stream; each elevon turns part of both flows.
With h = rho S eta / 2 and E_i = delta_i (f T_i + h xi_f C_l v_bx / 2), where f = S_ratio C_l xi_f, the report's
matrix sums reduce to the scalar expressions below. Signs are those of the body frame FLU: the report types
Phi(mv) and the arms' skew matrices with the opposite sign, which its printed matrices contradict.

Two terms of it give the body energy out of still air, so ``passive_wrench`` has others: the body rates make a force by
the transpose of what makes a moment of the velocity, and a deflected elevon has drag. The damping rows are the
set's, and must take energy too (:mod:`sitl.model.airframe_files` looks).
"""

import math

from sitl.compiled import kernel, subroutine
from sitl.model.airframe import Airframe, elevon_arm
from sitl.model.propeller import thrust, torque_difference
from sitl.model.state import Actuators
from sitl.model.vectors import Vector


@kernel
def effective_speed(v: Vector, w: Vector, a: Airframe) -> float:
    """The report's eta = sqrt(|v|^2 + mu c^2 |w|^2) [m/s], of the velocity through the air and the body rates."""
    turning = a.mu * a.c * a.c * (w.x * w.x + w.y * w.y + w.z * w.z)
    return math.sqrt(v.x * v.x + v.y * v.y + v.z * v.z + turning)


@kernel
def wrench(v: Vector, w: Vector, actuators: Actuators, a: Airframe) -> tuple[Vector, Vector]:
    r"""Sum of forces [N] and of moments [N m] in the body frame.

    .. math::
        F &= \sum_i [I + X \Phi^{(fv)} (\Delta_{f,i} - I)] T_i
             + \tfrac14 \rho S \eta [\Phi^{(fv)} (\Delta_{f,1} + \Delta_{f,2} - 2I) v_b
             + \Phi^{(mv)} (\Delta_{f,1} + \Delta_{f,2} - 2I) B \omega]

    Args:
        v: Velocity relative to the air, body FLU [m/s].
        w: Body rates [rad/s].
        actuators: Propeller speeds [rad/s] and elevon deflections, positive nose-up [rad].
        a: The airframe.

    Valid for any incidence as far as the linear Phi is: there is no stall.
    """
    w1, w2, d1, d2 = actuators
    T1, T2 = thrust(w1, v.x, a), thrust(w2, v.x, a)
    h = 0.5 * a.rho * a.S * effective_speed(v, w, a)
    X = a.S_ratio
    both, differ = d1 + d2, d1 - d2
    E1 = d1 * (a.C_l * a.xi_f) * (X * T1 + 0.5 * h * v.x)
    E2 = d2 * (a.C_l * a.xi_f) * (X * T2 + 0.5 * h * v.x)
    coupling = a.Delta_r / a.c  # Phi(mv) without its coefficients C_l and C_y0

    Fx = (1.0 - X * a.C_d0) * (T1 + T2) - h * (a.C_d0 * (v.x - 0.5 * a.xi_f * both * v.z))
    Fy = -h * (a.C_y0 * v.y + (coupling * a.C_l * a.b) * (w.z + 0.5 * a.xi_f * both * w.x))
    Fz = -(E1 + E2) - h * (a.C_l * v.z - (coupling * a.C_y0 * a.c) * w.y)

    L = damping(w, both, h, a)
    Mx = torque_difference(w1, w2, v.x, a) - a.a_y * (E1 - E2)
    My = -elevon_arm(a) * (E1 + E2) - h * (a.Delta_r * a.C_l) * v.z
    Mz = -(a.p_y - X * a.a_y * a.C_d0) * (T1 - T2) - h * ((0.5 * a.a_y * a.C_d0 * a.xi_f) * v.z * differ)
    Mz += h * (a.b * coupling * a.C_y0) * v.y
    return Vector(Fx, Fy, Fz), Vector(Mx + L.x, My + L.y, Mz + L.z)


@subroutine
def passive_wrench(v: Vector, w: Vector, actuators: Actuators, a: Airframe) -> tuple[Vector, Vector]:
    """The same forces [N] and moments [N m], out of which a wing in still air gains no energy."""
    w1, w2, d1, d2 = actuators
    T1, T2 = thrust(w1, v.x, a), thrust(w2, v.x, a)
    h = 0.5 * a.rho * a.S * effective_speed(v, w, a)
    X = a.S_ratio
    grip = a.C_l * a.xi_f
    E1 = d1 * grip * (X * T1 + 0.5 * h * v.x)
    E2 = d2 * grip * (X * T2 + 0.5 * h * v.x)
    side = a.b * (a.Delta_r / a.c) * a.C_y0  # arm of the lateral force, with its coefficient

    Fx = (1.0 - X * a.C_d0) * (T1 + T2) - h * (a.C_d0 + 0.5 * grip * (d1 * d1 + d2 * d2)) * v.x
    Fy = -h * (a.C_y0 * v.y - side * w.z)
    Fz = -(E1 + E2) - h * (a.C_l * (v.z + a.Delta_r * w.y))

    L = damping(w, 0.0, h, a)
    Mx = torque_difference(w1, w2, v.x, a) - a.a_y * (E1 - E2)
    My = -elevon_arm(a) * (E1 + E2) - h * (a.Delta_r * a.C_l) * v.z
    Mz = -(a.p_y - X * a.a_y * a.C_d0) * (T1 - T2) + h * side * v.y
    return Vector(Fx, Fy, Fz), Vector(Mx + L.x, My + L.y, Mz + L.z)


@kernel
def damping(w: Vector, both: float, h: float, a: Airframe) -> Vector:
    r"""Damping moments :math:`\frac12 h B \Phi^{(m\omega)} (\Delta_{m,1} + \Delta_{m,2} - 2I) B \omega` [N m].

    Args:
        w: Body rates [rad/s].
        both: d1 + d2 [rad].
        h: rho S eta / 2 [kg/s].
        a: The airframe.
    """
    # (Delta_m,1 + Delta_m,2 - 2 I) B w / 2, then Phi(m w), which is half its tabled coefficients, then B
    tilt = (0.5 * a.xi_m * a.b) * both
    x, y, z = tilt * w.z - a.b * w.x, -a.c * w.y, -tilt * w.x - a.b * w.z
    return Vector(
        h * (0.5 * a.b) * (a.C_lp * x + a.C_lq * y + a.C_lr * z),
        h * (0.5 * a.c) * (a.C_mp * x + a.C_mq * y + a.C_mr * z),
        h * (0.5 * a.b) * (a.C_np * x + a.C_nq * y + a.C_nr * z),
    )
