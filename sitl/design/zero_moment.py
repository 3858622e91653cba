"""Gains of the zero-moment law for an airframe (report, section 3.2)."""

from __future__ import annotations

import numpy as np

from sitl.kernels.hover_model import force_matrix, inertia, moment_matrix
from sitl.model.airframe import Airframe
from sitl.laws.governor import VELOCITY, GovernorParameters
from sitl.laws.hover_zero_moment import ZeroMomentGains


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
    F_b, pair = force_matrix(a), np.array([1.0, 1.0, 0.0, 0.0])
    strongest = 2.0 * a.k_f * a.omega_max**2
    return ZeroMomentGains(
        governor=GovernorParameters(governor, k_pp, k_pd, a.m, 0.5, 1.0, 2.0, 2.5),
        k_delta=k_delta,
        lam=lam,
        zeta=zeta,
        k_q=k_q,
        nu_prime=int(nu_prime),
        m=a.m,
        g=a.g,
        J=inertia(a),
        d=np.array([1.0, 0.0, 0.0]),
        M_pinv=np.ascontiguousarray(np.linalg.pinv(moment_matrix(a))),
        u_bar=pair / float(np.linalg.norm(F_b @ pair)),
        f_min=0.1 * a.m * a.g,
        f_max=0.95 * strongest,
    )
