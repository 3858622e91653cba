"""Appendix D of the report, term by term, with its sign errors corrected; the linear gamma only.

An independent writing of the zero-moment law: the product differentiates its force law numerically and never uses
these expansions. World frame, SI.
"""

from typing import NamedTuple

import numpy as np


class State(NamedTuple):
    """Errors, attitudes as rotation matrices, and rates at one instant."""

    e: np.ndarray  # position error
    v: np.ndarray  # velocity error
    R: np.ndarray  # R(q)
    R_d: np.ndarray  # R(q_d)
    w: np.ndarray  # body rates
    f: float


def cross(a):
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


def f_delta(x, g):
    """f_D = R(q_d) d f - f_r."""
    p = g.governor
    return x.R_d @ g.d * x.f - (np.array((0.0, 0.0, g.m * g.g)) - p.k_pp * x.e - p.k_pd * x.v)


def nu(x, g):
    """nu, or nu' with its further term."""
    p = g.governor
    value = p.k_pp * p.k_pd / g.m * x.e + (p.k_pd**2 / g.m - p.k_pp) * x.v - (p.k_pd / g.m + g.k_delta) * f_delta(x, g)
    return value - p.k_pd / g.m * (x.R - x.R_d) @ g.d * x.f if g.nu_prime else value


def w_d(x, g):
    """omega_d without the heading term."""
    return np.cross(g.d, x.R_d.T @ nu(x, g)) / x.f


def f_dot(x, g):
    return g.d @ x.R_d.T @ nu(x, g)


def nu_dot(x, g):
    """Derivative of nu along the flow: last equations of the appendix, minus where it prints plus."""
    p = g.governor
    tilt = (x.R - x.R_d) @ g.d * x.f
    f_D = f_delta(x, g)
    v_dot = (tilt - p.k_pp * x.e - p.k_pd * x.v + f_D) / g.m
    f_D_dot = nu(x, g) + p.k_pp * x.v + p.k_pd * v_dot
    value = p.k_pp * p.k_pd / g.m * x.v + (p.k_pd**2 / g.m - p.k_pp) * v_dot - (p.k_pd / g.m + g.k_delta) * f_D_dot
    if g.nu_prime:
        R_dot, R_d_dot = x.R @ cross(x.w), x.R_d @ cross(w_d(x, g))
        value -= p.k_pd / g.m * ((R_dot - R_d_dot) @ g.d * x.f + (x.R - x.R_d) @ g.d * f_dot(x, g))
    return value


def w_d_dot(x, g):
    """Feed-forward without the heading term: -f'/f^2, R(q_d)', and nu' parts."""
    pull = x.R_d.T @ nu(x, g)
    pull_dot = x.R_d.T @ nu_dot(x, g) - cross(w_d(x, g)) @ pull
    return np.cross(g.d, pull_dot) / x.f - f_dot(x, g) / x.f**2 * np.cross(g.d, pull)
