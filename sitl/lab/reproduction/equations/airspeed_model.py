"""The hover model augmented by the airspeed, as forces and moments of u' (report, section 2.2.2).

u' = (T1 + T2, T1 - T2, delta1 + delta2, delta1 - delta2). Terms of the body rates are left out, except in eta.
The report's M_y exchanges T1 - T2 with T1 + T2. Its Jacobian inherits that and is singular at the hover: this alone is
the bad conditioning that the report meets.
"""

from __future__ import annotations

import numpy as np

from sitl import Airframe, Array
from sitl.compiled import subroutine


@subroutine
def virtual_command(T1: float, T2: float, d1: float, d2: float) -> Array:
    """The command u' of two thrusts [N] and two deflections [rad], (4,)."""
    return np.array((T1 + T2, T1 - T2, d1 + d2, d1 - d2))


@subroutine
def force(v_b: Array, eta: float, u: Array, a: Airframe) -> Array:
    """F(u') in the body frame, (3,) [N] (report, eq. F).

    Args:
        v_b: Velocity relative to the air, body frame, (3,) [m/s].
        eta: sqrt(|v_b|^2 + mu c^2 |w|^2) [m/s].
        u: u', (4,).
        a: The airframe.
    """
    h = 0.5 * a.rho * a.S * eta
    both, _ = elevons(h * v_b[0], u, a)
    axial = (1.0 - a.S_ratio * a.C_d0) * u[0] - h * a.C_d0 * (v_b[0] - 0.5 * a.xi_f * v_b[2] * u[2])
    return np.array((axial, -h * a.C_y0 * v_b[1], -both - h * a.C_l * v_b[2]))


@subroutine
def moment(v_b: Array, eta: float, u: Array, a: Airframe) -> Array:
    """M(u') in the body frame, (3,) [N m] (report, eq. M, M_y corrected); arguments as for :func:`force`."""
    h = 0.5 * a.rho * a.S * eta
    both, differ = elevons(h * v_b[0], u, a)
    roll = a.k_m / a.k_f * u[1] - a.a_y * differ
    pitch = -a.Delta_r * (a.xi_m / a.xi_f * both + h * a.C_l * v_b[2])
    yaw = -(a.p_y - a.S_ratio * a.a_y * a.C_d0) * u[1] - 0.5 * h * a.a_y * a.C_d0 * a.xi_f * v_b[2] * u[3]
    return np.array((roll, pitch, yaw + h * a.b / a.c * a.Delta_r * a.C_y0 * v_b[1]))


@subroutine
def elevons(stream: float, u: Array, a: Airframe) -> tuple[float, float]:
    """Sum and difference of the elevons' normal forces [N], ``stream`` being rho S eta v_bx / 2 [N]."""
    half = 0.5 * a.C_l * a.xi_f
    normal, uneven = half * (a.S_ratio * u[0] + stream), half * a.S_ratio * u[1]
    return normal * u[2] + uneven * u[3], normal * u[3] + uneven * u[2]


@subroutine
def moment_jacobian(v_b: Array, eta: float, u: Array, a: Airframe) -> Array:
    """Derivative of M by (T1 - T2, delta1 + delta2, delta1 - delta2), (3, 3) (report, section 4.2.2, corrected).

    Its condition number is 6 at the hover and 35 in level flight at 20 m/s. Arguments as for :func:`force`.
    """
    h = 0.5 * a.rho * a.S * eta
    slip = 0.5 * a.S_ratio * a.C_l * a.xi_f
    normal = slip * u[0] + 0.5 * h * a.C_l * a.xi_f * v_b[0]
    arm = a.Delta_r * a.xi_m / a.xi_f
    return np.array(
        (
            (a.k_m / a.k_f - a.a_y * slip * u[2], -a.a_y * slip * u[1], -a.a_y * normal),
            (-arm * slip * u[3], -arm * normal, -arm * slip * u[1]),
            (-a.p_y + a.S_ratio * a.a_y * a.C_d0, 0.0, -0.5 * h * a.a_y * a.C_d0 * a.xi_f * v_b[2]),
        )
    )
