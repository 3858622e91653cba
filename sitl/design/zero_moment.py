"""Gains of the zero-moment law for an airframe (report, section 3.2)."""

from __future__ import annotations

from sitl.control.allocation import Virtual
from sitl.control.governor import VELOCITY, GovernorParameters
from sitl.control.hover_zero_moment import ZeroMomentGains
from sitl.model.airframe import Airframe
from sitl.model.hover_model import force_matrix, moment_matrix
from sitl.model.vectors import Vector


def zero_moment_gains(
    a: Airframe,
    *,
    k_pp: float = 1.5,
    k_pd: float = 1.5,
    k_delta: float = 5.0,
    lam: float = 10.0,
    zeta: float = 0.8,
    k_q: float = 1.0,
    nu_prime: bool = False,
    governor: int = VELOCITY,
) -> ZeroMomentGains:
    """The law's gains; the defaults are the fastest that keep clear of the non-minimum phase.

    The elevons push the vehicle sideways before they turn it (a zero at sqrt(g / l), l = J2 f / (m c2): 6.6 rad/s), so
    k_pp above 2 or lam above 14 destabilise it, nu' sooner than nu.
    """
    share = 1.0 / float(force_matrix(a)[0, :2].sum())
    return ZeroMomentGains(
        governor=GovernorParameters(
            kind=governor, k_pp=k_pp, k_pd=k_pd, m=a.m, M=0.5, error_limit=1.0, v_down=2.0, v_up=2.5
        ),
        k_delta=k_delta,
        lam=lam,
        zeta=zeta,
        k_q=k_q,
        nu_prime=nu_prime,
        m=a.m,
        g=a.g,
        J=Vector(a.J1, a.J2, a.J3),
        d=Vector(1.0, 0.0, 0.0),
        M_pinv=moment_inverse(a),
        u_bar=Virtual(share, share, 0.0, 0.0),
        f_min=0.1 * a.m * a.g,
        f_max=0.95 * 2.0 * a.k_f * a.omega_max**2,
    )


def moment_inverse(a: Airframe) -> tuple[Vector, Vector, Vector, Vector]:
    """Rows of the pseudo-inverse of M_b (4, 3), in closed form.

    M_b's kernel is the sum of the thrusts, so its pseudo-inverse leaves that at zero and inverts the rest: the yaw
    gives the thrusts' difference, the pitch the elevons' sum, the roll less the propellers' torque their difference.
    """
    M = moment_matrix(a)
    torque, roll, pitch, yaw = float(M[0, 0]), float(M[0, 3]), float(-M[1, 2]), float(M[2, 1])
    by_yaw = 0.5 / yaw
    left, right = -0.5 / roll, 0.5 / roll
    both, turn = -0.5 / pitch, 0.5 * torque / (roll * yaw)
    return (
        Vector(0.0, 0.0, -by_yaw),
        Vector(0.0, 0.0, by_yaw),
        Vector(left, both, -turn),
        Vector(right, both, turn),
    )
