#!/usr/bin/env python3
"""Find a V for the hover of an airframe whose actuators lag, prove its level, and store it in ``sitl/lab/proofs``.

V = z' P z satisfies P J + J' P < 0 for the Jacobian at the hover and, to first order, at the states of {V <= 1} where
that fails most, which are found anew for each P (CLARABEL, a development dependency). Of all such V the one whose unit
set holds the most in its worst direction is taken, the actuators where the law wants them. That is a guess at what can
be proved; the proof is :meth:`sitl.lab.proofs.lagged_proof.LaggedProof.falls_within`. V is scaled so that the proved
level is 1. Some minutes on an idle core; with ``OPENBLAS_NUM_THREADS=1`` it is quickest.

    python scripts/prove_lagged_hover.py darko
"""

import argparse
import math
import sys
from pathlib import Path

import cvxpy as cp
import numpy as np

from sitl import Array
from sitl.design.proved import base_gains
from sitl.lab.proofs import lagged_proof
from sitl.lab.proofs.closed_loop import POSITION_ROWS
from sitl.lab.proofs.lagged import LAGGED_STATES, VARIABLES, LaggedLoop, bounds, linear_rest, whole
from sitl.lab.proofs.lagged_proof import LaggedProof, lagged_entry, lagged_radii, mirror
from sitl.model.airframe_files import load

ALIKE = (0.5, 0.3, math.radians(5.0) / 2.0, 0.4)  # position [m], speed, eps and rates on V = 1
INTEGRAL, MOTORS, ELEVONS = 5.0, 0.5, 0.2  # scales of the rest of the state [m s], [N], [N rad]
SPEED, EPS, RATE = 0.4, math.radians(9.0) / 2.0, 0.7  # bounds on V = 1
THRUST, DEFLECTION = 0.7, 0.3  # of what is asked for beyond the hover's, likewise [N], [rad]
DECAY = 0.15  # [1/s]
PASSES = 5
REACHES = (0.4, 0.55, 0.7, 0.85, 1.0)  # shares of {V <= 1} that the passes look at
STARTS, CLIMBS, KEPT = 40, 40, 6  # of the search of the worst states
BOXES, HALVINGS = 600, 4
ROOM = 0.97  # of the proved level


def first_order(loop: LaggedLoop, Z: Array) -> Array:
    """Change of the Jacobian at states (n, 19), to first order, (n, 19, 19)."""
    hover = np.zeros((1, VARIABLES))
    bend = bounds(loop, hover, hover).bend[0][0]
    return whole(loop, np.einsum("ijk,nk->nij", bend, Z @ loop.selection.T))


def search(loop: LaggedLoop) -> Array:
    """P of V, (19, 19)."""
    hover = np.zeros((1, VARIABLES))
    slope = bounds(loop, hover, hover).slope[0]
    J = (whole(loop, slope) + linear_rest(loop))[0]
    commands = slope[0, 9:] @ loop.selection
    vertices, random, M = [J], np.random.default_rng(1), mirror()
    P = solved(loop, vertices, commands)
    for reach in REACHES[:PASSES]:
        away = reach * worst_states(loop, P, J, random)
        vertices += list(J + first_order(loop, np.vstack([away, away @ M])))
        P = solved(loop, vertices, commands)
        print(f"{len(vertices)} Jacobians, reach {reach:g}", flush=True)
    return P


def solved(loop: LaggedLoop, vertices: list[Array], commands: Array) -> Array:
    """The P that holds most for these Jacobians."""
    scale = np.concatenate((np.repeat(ALIKE, 3), np.full(3, INTEGRAL), [MOTORS] * 2, [ELEVONS] * 2))
    D, back, M = np.diag(scale), np.diag(1.0 / scale), mirror()
    settled = back @ np.vstack([np.eye(15), commands[:, :15]]) @ np.diag(scale[:15])
    P, worst = cp.Variable((LAGGED_STATES, LAGGED_STATES), symmetric=True), cp.Variable()
    constraints = [M @ P @ M == P]
    for J in vertices:
        A = back @ J @ D
        constraints.append(A.T @ P + P @ A + 2.0 * DECAY * P << -1e-7 * np.eye(LAGGED_STATES))
    V = settled.T @ P @ settled
    for k in range(4):
        part = slice(POSITION_ROWS.start + 3 * k, POSITION_ROWS.stop + 3 * k)
        constraints.append(V[part, part] << worst * np.eye(3))
    unit, K, most = np.eye(LAGGED_STATES), loop.feedback, DEFLECTION * loop.lift
    planes = [*((row, THRUST) for row in (*unit[15:17], *K[:2])), *((row, most) for row in (*unit[17:], *K[2:]))]
    for first, bound in ((3, SPEED), (6, EPS), (9, RATE)):
        planes += [(row, bound) for row in unit[first : first + 3]]
    for row, bound in planes:
        within = (row @ D / bound)[None]
        constraints.append(cp.bmat([[P, within.T], [within, np.eye(1)]]) >> 0)
    problem = cp.Problem(cp.Minimize(worst), constraints)
    problem.solve(solver=cp.CLARABEL)
    if P.value is None:
        sys.exit(f"no V found: {problem.status}")
    found = back @ P.value @ back
    return np.asarray(0.5 * (found + M @ found @ M))


def worst_states(loop: LaggedLoop, P: Array, J: Array, random: np.random.Generator) -> Array:
    """States of {V = 1} where V rises most by the first-order Jacobian, found by climbing, (k, 19)."""
    L = np.linalg.cholesky(P)
    to_z = np.linalg.inv(L).T

    def symmetric(matrix: Array) -> Array:
        turned = L.T @ matrix @ to_z
        return np.asarray(turned + turned.swapaxes(-1, -2))

    still, ways, found = symmetric(J), symmetric(first_order(loop, to_z.T)), []
    for _ in range(STARTS):
        y = random.standard_normal(LAGGED_STATES)
        for _ in range(CLIMBS):
            y /= np.linalg.norm(y)
            values, vectors = np.linalg.eigh(still + np.einsum("k,kij->ij", y, ways))
            x = vectors[:, -1]
            y = np.einsum("kij,i,j->k", ways, x, x)
        found.append((float(values[-1]), y / np.linalg.norm(y)))
    kept: list[Array] = []
    for _, y in sorted(found, key=lambda pair: -pair[0]):
        if all(y @ other < 0.95 for other in kept):
            kept.append(y)
    return np.array(kept[:KEPT]) @ to_z.T


def proved_level(proof: LaggedProof) -> float:
    """The largest level found by bisection that is proved, at most what the limits allow."""
    low, high = 0.0, min(0.1, proof.limits_level())
    for _ in range(HALVINGS):
        level = 0.5 * (low + high)
        low, high = (level, high) if proof.falls_within(level, BOXES) else (low, level)
    if low == 0.0:
        sys.exit("no level is proved")
    return low


def main() -> None:
    """Search, prove, scale and store."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("airframes", nargs="+", metavar="SET", help="parameter set or TOML file")
    stored = Path(lagged_proof.__file__).with_name(lagged_proof.LAGGED_CERTIFICATES)
    options.add_argument("--output", type=Path, default=stored)
    args = options.parse_args()
    entries = []
    for name in args.airframes:
        a = load(name).parameters
        loop = LaggedLoop.of(a, base_gains(a))
        P = search(loop)
        scaled = LaggedProof.of(loop, P / (ROOM * proved_level(LaggedProof.of(loop, P))))
        p, v, turn, w = lagged_radii(scaled)
        told = f"# {name}: {p:.3f} m, {v:.3f} m/s, {math.degrees(turn):.2f} deg, {w:.3f} rad/s\n"
        print(told)
        entries.append(told + lagged_entry(loop, scaled.P))
    args.output.write_text("# Made by scripts/prove_lagged_hover.py.\n\n" + "\n".join(entries), encoding="utf-8")


if __name__ == "__main__":
    main()
