"""Forces and moments of the phi-theory model on the body (report, section "Représentation dynamique").

Each half wing sits in its propeller's slipstream and in the free stream; each elevon turns part of both flows.
With h = rho S eta / 2 and E_i = delta_i (f T_i + h xi_f C_l v_bx / 2), where f = S_ratio C_l xi_f, the report's
matrix sums reduce to the scalar expressions below. Signs are those of the body frame FLU: the report types
Phi(mv) and the arms' skew matrices with the opposite sign, which its printed matrices contradict.
"""

import math

from numba import njit

from sitl.kernels.parameters import Airframe

Wrench = tuple[float, float, float, float, float, float]


@njit(cache=True)
def wrench(
    vx: float, vy: float, vz: float, p: float, q: float, r: float,
    w1: float, w2: float, d1: float, d2: float, a: Airframe,
) -> Wrench:  # fmt: skip
    r"""Sum of forces (Fx, Fy, Fz) [N] and moments (Mx, My, Mz) [N m] in the body frame.

    .. math::
        F &= \sum_i [I + X \Phi^{(fv)} (\Delta_{f,i} - I)] T_i
             + \tfrac14 \rho S \eta [\Phi^{(fv)} (\Delta_{f,1} + \Delta_{f,2} - 2I) v_b
             + \Phi^{(mv)} (\Delta_{f,1} + \Delta_{f,2} - 2I) B \omega]

    Args:
        vx, vy, vz: Velocity relative to the air, body FLU [m/s].
        p, q, r: Body rates [rad/s].
        w1, w2: Propeller speeds, left and right [rad/s].
        d1, d2: Elevon deflections, left and right, positive nose-up [rad].
        a: The airframe.

    Valid for any incidence as far as the linear Phi is: there is no stall.
    """
    T1, T2 = a.k_f * w1 * w1, a.k_f * w2 * w2
    eta = math.sqrt(vx * vx + vy * vy + vz * vz + a.mu * a.c * a.c * (p * p + q * q + r * r))
    h = 0.5 * a.rho * a.S * eta
    X = a.S_ratio
    both, differ = d1 + d2, d1 - d2
    E1 = d1 * a.C_l * a.xi_f * (X * T1 + 0.5 * h * vx)
    E2 = d2 * a.C_l * a.xi_f * (X * T2 + 0.5 * h * vx)
    coupling = a.Delta_r / a.c  # Phi(mv) without its coefficients C_l and C_y0

    Fx = (1.0 - X * a.C_d0) * (T1 + T2) - h * a.C_d0 * (vx - 0.5 * a.xi_f * both * vz)
    Fy = -h * a.C_y0 * vy - h * coupling * a.C_l * a.b * (r + 0.5 * a.xi_f * both * p)
    Fz = -(E1 + E2) - h * a.C_l * vz + h * coupling * a.C_y0 * a.c * q

    arm = a.Delta_r * a.xi_m / a.xi_f  # of an elevon's normal force about y_b
    Mx = a.k_m * (w1 * w1 - w2 * w2) - a.a_y * (E1 - E2)
    My = -arm * (E1 + E2) - h * a.Delta_r * a.C_l * vz
    Mz = -(a.p_y - X * a.a_y * a.C_d0) * (T1 - T2) - 0.5 * h * a.a_y * a.C_d0 * a.xi_f * vz * differ
    Mz += h * a.b * coupling * a.C_y0 * vy
    Lx, Ly, Lz = damping(p, q, r, both, h, a)
    return Fx, Fy, Fz, Mx + Lx, My + Ly, Mz + Lz


@njit(cache=True)
def damping(p: float, q: float, r: float, both: float, h: float, a: Airframe) -> tuple[float, float, float]:
    r"""Damping moments :math:`\frac12 h B \Phi^{(m\omega)} (\Delta_{m,1} + \Delta_{m,2} - 2I) B \omega` [N m].

    Args:
        p, q, r: Body rates [rad/s].
        both: d1 + d2 [rad].
        h: rho S eta / 2 [kg/s].
        a: The airframe.
    """
    # (Delta_m,1 + Delta_m,2 - 2 I) B w / 2, then Phi(m w), which is half its tabled coefficients, then B
    tilt = 0.5 * a.xi_m * both * a.b
    x, y, z = tilt * r - a.b * p, -a.c * q, -tilt * p - a.b * r
    return (
        0.5 * h * a.b * (a.C_lp * x + a.C_lq * y + a.C_lr * z),
        0.5 * h * a.c * (a.C_mp * x + a.C_mq * y + a.C_mr * z),
        0.5 * h * a.b * (a.C_np * x + a.C_nq * y + a.C_nr * z),
    )
