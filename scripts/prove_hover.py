#!/usr/bin/env python3
"""Find a V for the linear hover law that flies, prove its level, and store it in ``sitl/design``.

Over all tilts, airspeeds and delayed commands of a set, V = x' P x and the weights of the delay satisfy linear matrix
inequalities; of all such V the one whose unit set holds the most in its worst direction is sought (CLARABEL, a
development dependency). The set is a box about the ellipsoid, so this is a guess at what can be proved; the proof is
:func:`sitl.lab.proofs.region.certify`. V is scaled so that the proved level is 1.

    python scripts/prove_hover.py nominal collage
"""

import argparse
import itertools
import math
import sys
from pathlib import Path
from typing import NamedTuple

import cvxpy as cp
import numpy as np

from sitl.control.hover_linear import LinearGains
from sitl.design import linearise, proved
from sitl.design.lmi import HALVES
from sitl.lab.proofs import closed_loop as loop
from sitl.lab.proofs.closed_loop import channels
from sitl.lab.proofs.region import certify, radii
from sitl.lab.proofs.surfaces import main_parts
from sitl.model.airframe import STALL, Airframe
from sitl.model.airframe_files import load


class Stalling(NamedTuple):
    """Bounds of what a wing that stalls does in the set that V is sought for: of pairs, mean and half difference."""

    speed: float = 1.3  # [m/s]
    thrusts: tuple[float, float] = (0.5, 0.35)  # asked for beyond the hover's [N]
    pushes: tuple[float, float, float] = (-0.07, 0.11, 0.075)  # beyond the hover's: least and most mean, difference
    deflections: tuple[float, float] = (0.11, 0.09)


class Box(NamedTuple):
    """Bounds of the set that V is sought for, and what the loop does in it."""

    alike: tuple[float, ...] = (1.0, 0.6, math.radians(8.0) / 2.0, 0.6)  # position [m], speed, eps and rates on V = 1
    turn: float = math.radians(11.0)
    spin: float = 6.0 * math.radians(11.0)  # [rad/s]
    elevon_rate: float = 3.4  # of the linear loop [N rad/s]
    decay: float = 0.05  # [1/s]
    thrust_ratio: float = 1.08  # of the channels
    deflection: float = 0.3  # likewise
    air: Stalling | None = None


LINEAR_WING = Box()
STALLING_WING = Box((0.6, 0.3, math.radians(5.0) / 2.0, 0.4), math.radians(10.0), 1.0, 3.0, 0.08, 1.1, 0.1, Stalling())
STREAM, EFFECTIVENESS = 0.05, 0.06  # h [kg/s] and kappa of the box
THRUST_RATE = 6.5  # of the linear loop [N/s]
INTEGRATED = 0.85  # of the bound of what is integrated
BOXES = 8_000
ROOM = 0.97  # of the proved level, for a proof that takes fewer boxes
INTEGRAL_SCALE = 5.0  # [m s]


def box_of(a: Airframe) -> Box:
    """The box for a level of aerodynamics."""
    return STALLING_WING if a.aerodynamics == STALL else LINEAR_WING


def search(a: Airframe, gains: LinearGains) -> tuple[np.ndarray, float]:
    """P of V, (15, 15), and the share of what shall be alike that V = 1 holds."""
    n, box = loop.size(gains), box_of(a)
    scale = np.concatenate((np.repeat(box.alike, 3), np.full(3, INTEGRAL_SCALE)))
    D, back = np.diag(scale), np.diag(1.0 / scale)
    at = channels(a, gains, box.thrust_ratio, box.deflection, 1.0)
    count = 6  # those of the commands: the integral's are a hundred times smaller
    P, worst = cp.Variable((n, n), symmetric=True), cp.Variable()
    weights = cp.Variable(3, nonneg=True)
    halves = [(*HALVES[0], 12, 14), (*HALVES[1], 13)]
    constraints = [P[i, j] == 0 for i in halves[0] for j in halves[1]]
    C, F = back @ at.columns[:, :count], loop.linear_loop(a, gains)
    for M in [np.zeros_like(F), *corners(a, gains)]:
        A = back @ (F + M) @ D
        whole = cp.bmat([[A.T @ P + P @ A + 2.0 * box.decay * P, P @ C], [C.T @ P, np.zeros((count, count))]])
        rates = np.hstack([at.rows @ D @ A, at.rows @ D @ C])[at.row[:count]]
        for k in range(3):
            pair = [2 * k, 2 * k + 1]
            errors = np.zeros((n + count, n + count))
            errors[[n + j for j in pair], [n + j for j in pair]] = 1.0 / (at.delays[pair] * at.factors[pair] ** 2)
            whole = whole + weights[k] * (at.delays[2 * k] * rates[pair].T @ rates[pair] - errors)
        constraints.append(whole << -1e-7 * np.eye(n + count))
    for k in range(4):
        part = slice(3 * k, 3 * k + 3)
        constraints.append(P[part, part] << worst * np.eye(3))
    for rows, bound in planes(a, gains, at.rows @ F):
        within = np.atleast_2d(rows) @ D / bound
        constraints.append(cp.bmat([[P, within.T], [within, np.eye(len(within))]]) >> 0)
    problem = cp.Problem(cp.Minimize(worst), constraints)
    problem.solve(solver=cp.CLARABEL)
    if P.value is None:
        sys.exit(f"no V found: {problem.status}")
    return back @ P.value @ back, 1.0 / math.sqrt(float(worst.value))


def corners(a: Airframe, gains: LinearGains) -> list[np.ndarray]:
    """Closed loops at the corners of the box, each (15, 15); the vehicle is its own mirror image."""
    box, made = box_of(a), []
    airs = linear_corners(a, gains) if box.air is None else stalling_corners(a, gains, box.air)
    for signs in itertools.product((1.0,), (-1.0, 1.0), (-1.0, 1.0)):
        tilt = np.einsum("k,kij->ij", 0.5 * box.turn * np.array(signs), np.stack(loop.tilt_matrices(a, gains)))
        made += [tilt, *(tilt + air for air in airs)]
    return made


def linear_corners(a: Airframe, gains: LinearGains) -> list[np.ndarray]:
    """Of the airspeed, and the elevons that it makes more effective."""
    n, moving, turned = loop.size(gains), [3, 4, 5, 9, 10, 11], np.eye(6)
    turned[:3, :3] = [[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]
    air = np.zeros((n, n))
    air[np.ix_(moving, moving)] = STREAM * turned @ linearise.aerodynamics(a).still @ turned.T
    elevons = []
    for elevon in (0, 1):
        M, force = loop.elevon_effect(a, gains, elevon)
        M[3] -= force
        elevons.append(EFFECTIVENESS * M)
    return [air + s * elevons[0] + r * elevons[1] for s, r in itertools.product((-1.0, 1.0), repeat=2)]


def stalling_corners(a: Airframe, gains: LinearGains, air: Stalling) -> list[np.ndarray]:
    """Of the pushes of both half wings and what both deflected elevons do along x_b: every second corner."""
    mean, half, _, together, opposed = (part.upright() for part in main_parts(a, gains))
    low, high, uneven = air.pushes
    made = []
    for push, u, d, o in itertools.product((low, high), (-1.0, 1.0), (-1.0, 1.0), (-1.0, 1.0)):
        if u * d * o * push > 0.0:
            deflected = d * air.deflections[0] * together + o * air.deflections[1] * opposed
            made.append(push * mean + u * uneven * half + deflected)
    return made


def planes(a: Airframe, gains: LinearGains, rates: np.ndarray) -> list[tuple[np.ndarray, float]]:
    """Linear functions of the state and their bounds on V = 1, in the norm of each group."""
    n, box, K, T = loop.size(gains), box_of(a), loop.feedback(gains), gains.u_bar.T1
    states = np.eye(n)
    growth = states[loop.POSITION_ROWS] + gains.lead * states[loop.VELOCITY_ROWS]
    if box.air is None:
        motor = min(T - a.k_f * a.omega_min**2, a.k_f * a.omega_max**2 - T)
        within = [(states[loop.VELOCITY_ROWS], 2.0 * STREAM / (a.rho * a.S)), (K[0], motor)]
        within += [(a.delta_max * K[0] + sign * K[2], a.delta_max * T) for sign in (-1.0, 1.0)]
    else:
        within = [(states[loop.VELOCITY_ROWS], box.air.speed)]
        for sign, thrust, deflection in zip((1.0, -1.0), box.air.thrusts, box.air.deflections, strict=True):
            within += [(0.5 * (K[0] + sign * K[1]), thrust), (0.5 * (K[2] + sign * K[3]), deflection * T)]
    return [
        *((row, 0.5 * box.turn) for row in loop.coordinates(n)),
        *((row, box.spin) for row in states[loop.RATE_ROWS]),
        *within,
        (rates[0], THRUST_RATE),
        (rates[2], box.elevon_rate),
        (growth, INTEGRATED * gains.integral_limit),
    ]


def main() -> None:
    """Search, prove, scale and store."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("airframes", nargs="+", metavar="SET", help="parameter set or TOML file")
    options.add_argument("--output", type=Path, default=Path(proved.__file__).with_name(proved.CERTIFICATES))
    args = options.parse_args()
    entries = []
    for name in args.airframes:
        a = load(name).parameters
        base = proved.base_gains(a)
        P, share = search(a, base)
        print(f"{name}: V = 1 holds {share:.2f} of the wanted, if it can be proved")
        certificate = certify(a, proved.with_lyapunov(base, P), precision=0.02, boxes=BOXES)
        gains = proved.with_lyapunov(base, P / (ROOM * certificate.level))
        p, v, turn, w = radii(gains, 1.0)
        print(f"{certificate}\n{p:.3f} m, {v:.3f} m/s, {math.degrees(turn):.2f} deg, {w:.3f} rad/s")
        entries.append(f"# {name}: {p:.2f} m, {v:.2f} m/s, {math.degrees(turn):.1f} deg, {w:.2f} rad/s\n")
        entries[-1] += proved.entry(a, gains)
    args.output.write_text("# Made by scripts/prove_hover.py.\n\n" + "\n".join(entries), encoding="utf-8")


if __name__ == "__main__":
    main()
