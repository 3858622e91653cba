#!/usr/bin/env python3
"""Find how fast one V could fall about the hovers of the linear law in all winds up to some speed, from any side.

The largest rate lambda for which one P satisfies P J + J' P < -2 lambda P for the loop J near each of these equilibria
(CLARABEL, a development dependency), commands in force at once. It bounds what could be proved: a proof takes the
states of a set, too.

    python scripts/search_windy_hover.py nominal collage
"""

import argparse
import math

import cvxpy as cp
import numpy as np

from sitl import Airframe, Array, SitlError
from sitl.control.hover_linear import LinearGains
from sitl.design.proved import base_gains
from sitl.lab.studies.hover_winds import WIND_STATES, equilibrium, jacobian
from sitl.model.airframe_files import load

WINDS = (1.0, 2.0, 3.0, 4.0, 5.0)  # [m/s]
SIDES = np.radians((0.0, 45.0, 90.0, 135.0, 180.0))  # the others are mirror images
SCALE = np.concatenate((np.repeat((1.0, 0.6, math.radians(4.0), 0.6), 3), np.full(3, 5.0)))  # of the state
HALVES = ([0, 2, 3, 5, 7, 10, 12, 14], [1, 4, 6, 8, 9, 11, 13])  # of the state, which a mirror image leaves, and turns
MOST, HALVINGS = 0.8, 6  # of the interval that the rate is sought in [1/s]


def loops(a: Airframe, gains: LinearGains, winds: tuple[float, ...]) -> Array:
    """The loop near the equilibria in the calm and in these winds, in units of the scale, (n, 15, 15).

    Raises:
        SitlError: The law stands still nowhere in one of them.
    """
    found = [jacobian(np.zeros(WIND_STATES), np.zeros(3), a, gains)]
    for side in SIDES:
        x = np.zeros(WIND_STATES)
        for wind in winds:
            air = wind * np.array((math.cos(side), math.sin(side), 0.0))
            x = equilibrium(air, a, gains, x)
            found.append(jacobian(x, air, a, gains))
    return np.asarray(np.array(found) / SCALE[:, None] * SCALE)


def has_common(made: Array, rate: float) -> bool:
    """Whether one V falls at a rate in all of these loops."""
    P, most = cp.Variable((WIND_STATES, WIND_STATES), symmetric=True), cp.Variable()
    constraints = [P >> np.eye(WIND_STATES), P << most * np.eye(WIND_STATES)]
    constraints += [P[i, j] == 0 for i in HALVES[0] for j in HALVES[1]]
    constraints += [J.T @ P + P @ J + 2.0 * rate * P << 0 for J in made]
    try:
        cp.Problem(cp.Minimize(most), constraints).solve(solver=cp.CLARABEL)
    except cp.error.SolverError:
        return False
    if P.value is None:
        return False
    found = 0.5 * (P.value + P.value.T)
    falls = [np.linalg.eigvalsh(J.T @ found + found @ J)[-1] < 0.0 for J in made]
    return bool(np.linalg.eigvalsh(found)[0] > 0.0 and all(falls))


def largest_rate(made: Array) -> float:
    """The largest rate found, 0 if there is none [1/s]."""
    low, high = 0.0, MOST
    for _ in range(HALVINGS):
        rate = 0.5 * (low + high)
        low, high = (rate, high) if has_common(made, rate) else (low, rate)
    return low


def main() -> None:
    """Search for each airframe and each greatest wind."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("airframes", nargs="+", metavar="SET", help="parameter set or TOML file")
    for name in options.parse_args().airframes:
        a = load(name).parameters
        gains = base_gains(a)
        for k, wind in enumerate(WINDS):
            try:
                print(
                    f"{name}, winds to {wind:g} m/s: {largest_rate(loops(a, gains, WINDS[: k + 1])):.2f} 1/s",
                    flush=True,
                )
            except SitlError as error:
                print(f"{name}: {error}")
                break


if __name__ == "__main__":
    main()
