r"""Claims of the robust PI law's author, in numbers: winds in which it is stable, and gusts that it rejects.

His synthesis knows winds ahead of 0 to 8 and upwards of -4 to 4 m/s; tuned without wind, he says, the loop is unstable
beyond 5 m/s. Here the closed loop is linearised about the trim in each wind, with first-order actuators, the law's
biquads and integrals, and commands that act one control period late; its growth is the largest real part of
ln(z) / period over the eigenvalues z. Each pair of actuators has two integrals that hold the same; what they differ by
is neither driven nor seen, so that those two eigenvalues stay at 1 and are left out.

Gusts are those of the campaign ``gusts``.
"""

from __future__ import annotations

import argparse
import math
from functools import partial
from typing import NamedTuple

import numpy as np
from scipy.linalg import expm

from sitl import (
    PERIOD,
    Actuators,
    Airframe,
    Array,
    Body,
    Quaternion,
    SitlError,
    Vector,
    load_airframe,
)
from sitl.control.robust_pi import RobustPiGains
from sitl.design.robust_pi_gains import CALM_TUNING, PRINTED_TUNING, WINDY_TUNING, robust_pi_gains
from sitl.design.trim import Trim, level_trim
from sitl.lab.campaigns.campaign_summary import summary_lines
from sitl.lab.studies.seeded_flights import (
    check_seeded,
    craft_of,
    write_json,
)
from sitl.lab.studies.spec_studies import FlownStudy, case_rows, craft_changes, flown_study
from sitl.model.plant import derivative
from sitl.simulation.tuning import CONTROLLERS

CLAIM_DIFFERENCE = 1e-5  # of the differences
MAX_RESIDUAL = 0.02  # of a trim that is one [m/s2], [rad/s2]
STAYING = 1e-3  # an exponent so near 0 is one of the two that stay [1/s]
AHEAD_WINDS, UPWARD_WINDS = (0.0, 2.0, 4.0, 5.0, 6.0, 7.0, 8.0), (-4.0, 0.0, 4.0)  # winds of the table [m/s]
UNSTABLE_WIND = (6.0, 4.0)  # a wind from ahead and upwards beyond the 5 m/s of the claim [m/s]


class LinearPlant(NamedTuple):
    """The vehicle about a trim: x' = A x + B u of x = (p, v, eps, w), u = (motors [rad/s], elevons [rad])."""

    A: Array  # (12, 12)
    B: Array  # (12, 4)
    omega: float  # of the motors [rad/s]


def linear_plant(a: Airframe, ahead: float, upward: float) -> LinearPlant | None:
    """The vehicle hovering in a wind, its belly to it; None where it has no trim within its actuators' limits.

    Args:
        a: The airframe.
        ahead: The wind from ahead [m/s].
        upward: The wind upwards [m/s].
    """
    speed = max(math.hypot(ahead, upward), 0.01)
    trim = level_trim(a, speed, -math.atan2(upward, max(ahead, 0.01)))
    at, wind = np.zeros(12), Vector(-max(ahead, 0.01), 0.0, upward)
    at[7] = -math.sin(0.5 * trim.theta)
    u = np.array((trim.omega, trim.omega, trim.delta, trim.delta))
    if not _is_trim(trim, _rates(at, u, wind, a)):
        return None
    size = np.array((100.0, 100.0, 1.0, 1.0))
    A = [
        (_rates(at + CLAIM_DIFFERENCE * e, u, wind, a) - _rates(at - CLAIM_DIFFERENCE * e, u, wind, a))
        / (2.0 * CLAIM_DIFFERENCE)
        for e in np.eye(12)
    ]
    B = [
        (_rates(at, u + CLAIM_DIFFERENCE * s * e, wind, a) - _rates(at, u - CLAIM_DIFFERENCE * s * e, wind, a))
        / (2.0 * CLAIM_DIFFERENCE * s)
        for s, e in zip(size, np.eye(4), strict=True)
    ]
    return LinearPlant(np.array(A).T, np.array(B).T, trim.omega)


def _is_trim(trim: Trim, rates: Array) -> bool:
    return trim.exists and float(np.abs(rates).max()) < MAX_RESIDUAL


def _rates(x: Array, u: Array, wind: Vector, a: Airframe) -> Array:
    """Derivative of x, the quaternion's scalar part as eps leaves it, (12,)."""
    p, v, e, w = (Vector(*part.tolist()) for part in np.split(x, 4))
    q = Quaternion(math.sqrt(1.0 - e.x * e.x - e.y * e.y - e.z * e.z), *e)
    none = Vector(0.0, 0.0, 0.0)
    rate = derivative(Body(p, v, q, w), Actuators(*u.tolist()), wind, none, none, a)
    return np.array((*rate.position, *rate.velocity, *rate.attitude[1:], *rate.rates))


def growth(plant: LinearPlant, gains: RobustPiGains, a: Airframe) -> float:
    """Growth of the closed loop [1/s]; negative: stable."""
    lag = np.array((a.motor_tau, a.motor_tau, a.elevon_tau, a.elevon_tau))
    whole = np.zeros((20, 20))  # x, actuators, commands
    whole[:12, :12], whole[:12, 12:16] = plant.A, plant.B
    whole[12:16, 12:16], whole[12:16, 16:] = -np.diag(1.0 / lag), np.diag(1.0 / lag)
    period = expm(PERIOD * whole)[:16]
    seen = [0, 1, 2, 3, 4, 5, 6, 8, 9, 10, 11]  # of x: all but eps_2
    shared = np.repeat(np.eye(2), 2, axis=0)
    per_thrust = 1.0 / (2.0 * gains.k_f * plant.omega)  # of a motor's speed
    command = np.diag((per_thrust, per_thrust, 1.0, 1.0))
    F = np.zeros((30, 30))  # x and actuators 16, commands in force 4, integrals 2, recent 4, older 4
    F[:16, :20] = period
    F[20:22, 20:22], F[20:22, seen] = np.eye(2), PERIOD * gains.H
    F[22:26, seen] = gains.K
    F[22:26, 22:26], F[22:26, 26:] = -gains.back[0] * np.eye(4), -gains.back[1] * np.eye(4)
    F[26:, 22:26] = np.eye(4)
    F[16:20, seen] = command @ shared @ (PERIOD * gains.H)
    F[16:20, 20:22] = command @ shared
    F[16:20, 22:26], F[16:20, 26:] = gains.ahead[0] * command, gains.ahead[1] * command
    exponents = np.log(np.linalg.eigvals(F).astype(complex) + 1e-300) / PERIOD
    return float(exponents[np.abs(exponents) > STAYING].real.max())


def growth_in(a: Airframe, tuning: str, ahead: float, upward: float) -> float:
    """Growth of the loop of a tuning in a wind [1/s]; not a number where the vehicle has no trim."""
    plant = linear_plant(a, ahead, upward)
    return math.nan if plant is None else growth(plant, robust_pi_gains(tuning), a)


# The claims and their verdicts.


class Claim(NamedTuple):
    """A statement, and whether it holds here."""

    text: str
    holds: bool


def stability_claims(a: Airframe) -> list[Claim]:
    """Claims about the winds in which the two tunings are stable."""
    calm, windy = partial(growth_in, a, CALM_TUNING), partial(growth_in, a, WINDY_TUNING)
    grid = [windy(ahead, upward) for ahead in AHEAD_WINDS for upward in UPWARD_WINDS]
    return [
        Claim("tuned without wind it is stable in calm", calm(0.0, 0.0) < 0.0),
        Claim(
            f"and unstable in {UNSTABLE_WIND[0]:g} m/s from ahead and {UNSTABLE_WIND[1]:g} upwards",
            calm(*UNSTABLE_WIND) > 0.0,
        ),
        Claim("tuned over winds it is stable in all of them", all(g < 0.0 for g in grid if not math.isnan(g))),
    ]


def stability_table(a: Airframe) -> list[str]:
    """Growth of each tuning over the winds, as lines of text."""
    lines = ["growth of the closed loop [1/s] over wind from ahead and upwards [m/s]; -: no trim"]
    lines.append(f"{'tuning':<8}{'up':>4}" + "".join(f"{ahead:>8g}" for ahead in AHEAD_WINDS))
    for tuning in (CALM_TUNING, WINDY_TUNING, PRINTED_TUNING):
        for upward in UPWARD_WINDS:
            row = [growth_in(a, tuning, ahead, upward) for ahead in AHEAD_WINDS]
            cells = "".join(f"{'-' if math.isnan(g) else format(g, '.2f'):>8}" for g in row)
            lines.append(f"{tuning:<8}{upward:>4g}{cells}")
    return lines


def gust_claims(flown: FlownStudy) -> list[Claim]:
    """Claims about the gusts that each controller rejects."""
    by, rejected = flown.drawn["by"], flown.result.values("rejected")
    lost = {name for name, value in zip(by, rejected, strict=True) if not value > 0.0}
    return [Claim(f"{name} rejects the gusts", name not in lost) for name in dict.fromkeys(by)]


def study_claims(args: argparse.Namespace) -> int:
    """Print growth and gusts with the verdicts on the claims; exit code 1 if one is refuted."""
    check_seeded(args, {})
    craft, names = craft_of(args), list(CONTROLLERS) if args.controller is None else [args.controller]
    a = load_airframe(args.airframe).parameters
    if min(a.motor_tau, a.elevon_tau) <= 0.0:
        raise SitlError(f"--airframe {args.airframe}: its actuators have no time constants")
    flown = flown_study(args, "gusts", {**craft_changes(craft), "vehicle.controller": "by", "vary.by.grid": names})
    claims = stability_claims(a) + gust_claims(flown)
    verdicts = [f"{'holds' if claim.holds else 'refuted'}: {claim.text}" for claim in claims]
    print("\n".join([*stability_table(a), *summary_lines(*flown), *verdicts]), flush=True)
    if args.json is not None:
        write_json(args.json, case_rows(flown.result, flown.drawn))
    return 0 if all(claim.holds for claim in claims) else 1
