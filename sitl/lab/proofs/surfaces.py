"""Matrices of rank one, the air of a wing that stalls (:mod:`sitl.lab.proofs.stalled`), and how they turn."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from sitl import Airframe, Array
from sitl.control.hover_linear import LinearGains
from sitl.lab.proofs.closed_loop import (
    RATE_ROWS,
    AttitudeBoxes,
    Interval,
    Terms,
    entry_matrix,
    feedback,
    row_matrix,
    size,
)
from sitl.model.aerodynamics import inertia

MOVING = [3, 4, 5, 9, 10, 11]  # (v, w) in the state
AXES = np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])  # R(q_bar)


def surfaces(a: Airframe, y: float) -> tuple[Array, Array]:
    """Rows c of the fixed surface and of the elevon of a half wing, attached, (6,) each."""
    elevon = a.Delta_r * a.xi_m / a.xi_f
    wing = (a.Delta_r - a.xi_f * elevon) / (1.0 - a.xi_f)
    return np.array((0.0, 0.0, 1.0, y, wing, 0.0)), np.array((0.0, 0.0, 1.0, y, elevon, 0.0))


def in_world(G: Array, n: int) -> Array:
    """M of G (v_b, w) at the hover attitude, (n, n)."""
    turned = np.eye(6)
    turned[:3, :3] = AXES
    M = np.zeros((n, n))
    M[np.ix_(MOVING, MOVING)] = turned @ G @ turned.T
    return M


def hover_push(a: Airframe, T: float) -> float:
    """p_0 of a half wing at a thrust [kg/s]."""
    return 0.5 * a.rho * a.S_ratio * a.S_p * a.C_l * math.sqrt(2.0 * T / (a.rho * a.S_p))


def per_mass(a: Airframe, G: Array) -> Array:
    """Of forces and moments (6, 6) the accelerations."""
    return np.asarray(G / np.concatenate((np.full(3, a.m), inertia(a)))[:, None])


def normal_motion(a: Airframe) -> Array:
    """Row of (v, w) that gives the speed along the wing's normal of its centre of pressure, at the hover, (6,)."""
    return np.concatenate((AXES[:, 2], (0.0, a.Delta_r, 0.0)))


def elevon_drag(a: Airframe) -> Array:
    """Change of the state's rate by one of delta^2 T of either elevon, (12, 2)."""
    lift, made = a.S_ratio * a.C_l * a.xi_f, np.zeros((12, 2))
    made[5] = -lift / a.m
    made[11] = lift * a.a_y / a.J3 * np.array((1.0, -1.0))
    return made


def surfaces_push(a: Airframe, y: float, sign: float = 1.0) -> Array:
    """Forces and moments by (v_b, w) of one of push on a half wing, (6, 6)."""
    wing, flap = surfaces(a, y)
    return sign * ((1.0 - a.xi_f) * np.outer(wing, wing) + a.xi_f * np.outer(flap, flap))


def surface_drag(a: Airframe, y: float) -> Array:
    """Forces and moments by (v_b, w), along x_b, of one of an elevon's normal force on a half wing, (6, 6)."""
    return np.outer((1.0, 0.0, 0.0, 0.0, 0.0, -y), surfaces(a, y)[1])


class Part(NamedTuple):
    """A part of the air's M: of the motion (v_b, w), of the state whatever the attitude, and along the nose."""

    by_motion: Array  # (6, 6)
    fixed: Array  # (n, n)
    nose: Array  # (n,)

    def upright(self) -> Array:
        """M at the hover attitude."""
        return np.asarray(in_world(self.by_motion, len(self.nose)) + self.fixed + row_matrix(5, self.nose))

    def turned(self, at: AttitudeBoxes) -> Terms:
        """Change of the part at other attitudes."""
        terms = turned(at, self.by_motion, len(self.nose))
        if self.nose.any():
            terms += [(at.axes[0][i] + -float(i == 2), row_matrix(3 + i, self.nose)) for i in range(3)]
        return terms


def main_parts(a: Airframe, gains: LinearGains) -> list[Part]:
    """Per one of each of what the air mainly does beyond the linear loop.

    They are the mean of both half wings' pushes and half of their difference; the roll by thrusts that are uneven, of
    one unit more push per thrust and of speed along the wing's normal; and both deflections' mean and half difference
    for what they make along x_b, part of the push at the hover and drag.
    """
    n, K, base = size(gains), feedback(gains), hover_push(a, gains.u_bar.T1)
    none, nothing = np.zeros((n, n)), np.zeros(n)
    left, right = (per_mass(a, surfaces_push(a, y, -1.0)) for y in (a.a_y, -a.a_y))
    up, down = (a.xi_f * base * per_mass(a, surface_drag(a, y)) for y in (a.a_y, -a.a_y))
    (spun, pulled), (other_spun, other_pulled) = drags(a, gains, 0), drags(a, gains, 1)
    return [
        Part(left + right, none, nothing),
        Part(left - right, none, nothing),
        Part(np.zeros((6, 6)), row_matrix(9, a.a_y / a.J1 * (K[0] - K[1])), nothing),
        Part(up + down, spun + other_spun, pulled + other_pulled),
        Part(up - down, spun - other_spun, pulled - other_pulled),
    ]


def drags(a: Airframe, gains: LinearGains, elevon: int) -> tuple[Array, Array]:
    """Drag of an elevon by its commanded deflection, per radian: M of the moment, (n, n), and along the nose, (n,)."""
    n, drag = size(gains), elevon_drag(a)[:, elevon]
    asked, M = -feedback(gains)[2 + elevon], np.zeros((n, n))
    M[RATE_ROWS] = np.outer(drag[RATE_ROWS], asked)
    return M, np.asarray(drag[5] * asked)


def turned(at: AttitudeBoxes, G: Array, n: int) -> Terms:
    """Change of a matrix of (v_b, w) when the body is turned."""
    whole, terms = in_world(G, n), []
    changes = [((3 + i, 3 + j), _both(at, G, i, j)) for i in range(3) for j in range(3)]
    changes += [((3 + i, 9 + j), _one(at, G[:3, 3 + j], i)) for i in range(3) for j in range(3)]
    changes += [((9 + i, 3 + j), _one(at, G[3 + i, :3], j)) for i in range(3) for j in range(3)]
    for place, value in changes:
        if value is not None:
            terms.append((value + -whole[place], entry_matrix(*place, n)))
    return terms


def _both(at: AttitudeBoxes, G: Array, i: int, j: int) -> Interval | None:
    parts = [G[k, m] * (at.axes[k][i] * at.axes[m][j]) for k in range(3) for m in range(3) if G[k, m]]
    return _total(parts)


def _one(at: AttitudeBoxes, g: Array, i: int) -> Interval | None:
    return _total([g[k] * at.axes[k][i] for k in range(3) if g[k]])


def _total(parts: list[Interval]) -> Interval | None:
    if not parts:
        return None
    whole = parts[0]
    for part in parts[1:]:
        whole = whole + part
    return whole
