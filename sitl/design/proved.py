"""The linear hover law that flies, with the V that proves the most of it.

Its gain is an LQI's; the V is found off line, by ``scripts/prove_hover.py``, and stored with what it was found for: the
gain, the matrices of the hover and of the airspeed, and the actuators' limits. Where one of these is another, the V
proves nothing, and another design has to fly.
"""

from __future__ import annotations

import tomllib
from functools import lru_cache
from importlib.resources import files
from typing import Any

import numpy as np

from sitl.control.hover_linear import LinearGains
from sitl.design import linearise
from sitl.design.lqr import hover_gains
from sitl.design.rounding import rounded_matrix
from sitl.design.scaling import scale_of
from sitl.errors import SitlError
from sitl.model.airframe import FIRST_ORDER, STALL, Airframe, Array

PROVED_LEVEL = 1.0  # of V: it is scaled to that
HOVER_WEIGHTS = (10.0, 0.4, 20.0)  # of the LQI: R = 10 I, of the integral, of eps - eps_bar
STALL_WEIGHTS = (20.0, 6.0, 80.0)  # the same where the wing stalls: a stiffer integral holds it in a wind
MAX_GROWTH = 2.5  # bound of what is integrated [m]: it must not be met in the proved set
CERTIFICATES = "certificates.toml"
NOISE = 6  # decimals of the hover's matrix, below which lies what differences make of a zero
SAME = 1e-6  # relative difference of what is the same


def base_gains(a: Airframe) -> LinearGains:
    """The law with the V of its LQR."""
    effort, weight, attitude_weight = STALL_WEIGHTS if a.aerodynamics == STALL else HOVER_WEIGHTS
    gains = hover_gains(a, effort=effort, integral_weight=weight, attitude_weight=attitude_weight)
    return gains._replace(integral_limit=MAX_GROWTH * scale_of(a).length)


def premises(a: Airframe, gains: LinearGains) -> Array:
    """The numbers that a proof is of, (k,)."""
    limits = (a.omega_min, a.omega_max, a.omega_rate, a.delta_max, a.delta_rate, float(a.actuator_model == FIRST_ORDER))
    air = (a.rho, a.S, a.S_ratio, a.mu, a.c, a.m, a.g, a.k_f, a.J1, a.J2, a.J3, *limits)
    law = (gains.K, gains.K_i, np.array((gains.lead, gains.integral_limit, gains.reach, gains.bound)))
    A, B = linearise.hover(a)
    # Where the wing stalls, some of A are differences.
    plant = (np.round(A, NOISE), B, *_stall(a)) if a.aerodynamics == STALL else (A, B, *linearise.aerodynamics(a))
    parts = (np.array(air), *plant, *law)
    return np.concatenate([np.ravel(part) for part in parts])


def _stall(a: Airframe) -> tuple[Array, ...]:
    """Further constants of the airframe, those that the proof of a wing that stalls uses."""
    wing = (a.C_l, a.C_d0, a.C_y0, a.xi_f, a.xi_m, a.Delta_r, a.a_y, a.b, a.C_mq, a.C_nr, a.S_p, a.C_90, a.per_stall)
    propeller = (a.k_m, a.k_fv, a.k_fvv, a.k_mv, a.k_mvv, a.k_mk, a.advance_knot, a.J_p, a.p_y)
    return np.array((*wing, a.cp_shift, *propeller)), np.array((float(a.aerodynamics),))


@lru_cache(maxsize=8)
def is_proved(a: Airframe) -> bool:
    """Whether there is a V for this airframe."""
    return _stored(a) is not None


@lru_cache(maxsize=8)
def proved_gains(a: Airframe) -> LinearGains:
    """The law with the V that proves {V <= PROVED_LEVEL} of it.

    Raises:
        SitlError: If no V is stored for this airframe.
    """
    P = _stored(a)
    if P is None:
        raise SitlError("no V is stored that proves anything of this airframe's hover (scripts/prove_hover.py)")
    return with_lyapunov(base_gains(a), P)


def with_lyapunov(gains: LinearGains, P: Array) -> LinearGains:
    """The law with V = (x, x_i)' P (x, x_i), P (15, 15)."""
    S, S_xi, S_ii = (np.ascontiguousarray(part) for part in (P[:12, :12], P[:12, 12:], P[12:, 12:]))
    return gains._replace(S=S, S_xi=S_xi, S_ii=S_ii)


def entry(a: Airframe, gains: LinearGains) -> str:
    """A certificate as it is stored."""
    P = np.block([[gains.S, gains.S_xi], [gains.S_xi.T, gains.S_ii]])
    lines = ["[[certificate]]", f"premises = {_numbers(premises(a, gains))}", "P = ["]
    return "\n".join([*lines, *(f"    {_numbers(row[: k + 1])}," for k, row in enumerate(rounded_matrix(P))), "]\n"])


def _numbers(row: Array) -> str:
    return "[" + ", ".join(f"{value:.10g}" for value in row) + "]"


def _stored(a: Airframe) -> Array | None:
    """P for this airframe, (15, 15), or None."""
    if a.swirl > 0.0 or a.k_fc > 0.0 or a.k_h > 0.0 or a.k_fw != 0.0 or a.slip_shift != a.cp_shift:
        return None  # no proof is of these
    now = premises(a, base_gains(a))
    for certificate in _certificates():
        then = np.array(certificate["premises"])
        if then.shape == now.shape and (np.abs(then - now) <= SAME * np.maximum(np.abs(now), SAME)).all():
            P = np.zeros((15, 15))
            for k, row in enumerate(certificate["P"]):
                P[k, : k + 1] = P[: k + 1, k] = row
            return P
    return None


@lru_cache(maxsize=1)
def _certificates() -> list[dict[str, Any]]:
    text = (files("sitl.design") / CERTIFICATES).read_text(encoding="utf-8")
    return list(tomllib.loads(text).get("certificate", []))
