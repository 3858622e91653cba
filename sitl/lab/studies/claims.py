r"""Claims of the robust PI law's author, in numbers: winds in which it is stable, and gusts that it rejects.

His synthesis knows winds ahead of 0 to 8 and upwards of -4 to 4 m/s; tuned without wind, he says, the loop is unstable
beyond 5 m/s. Here the closed loop is linearised about the trim in each wind, with first-order actuators, the law's
biquads and integrals, and commands that act one control period late; its growth is the largest real part of
ln(z) / period over the eigenvalues z. Each pair of actuators has two integrals that hold the same; what they differ by
is neither driven nor seen, so that those two eigenvalues stay at 1 and are left out.

Gusts come from ahead on a mean, w = w_m + A g(t), with the Mexican hat and the Morlet wavelet

.. math::
    g = (1 - 2 \pi^2 f^2 t^2) e^{-\pi^2 f^2 t^2}, \quad g = e^{-t^2/2} \cos 5 t
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Sequence
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
    DivergedError,
    Law,
    Quaternion,
    SitlError,
    Start,
    Vector,
    hover_at,
    load_airframe,
)
from sitl.control.robust_pi import RobustPiGains
from sitl.design.robust_pi_gains import CALM_TUNING, PRINTED_TUNING, WINDY_TUNING, robust_pi_gains
from sitl.design.trim import Trim, level_trim
from sitl.lab.studies.seeded_flights import (
    DEFAULT_CRAFT,
    SAMPLE_PERIODS,
    Craft,
    check_seeded,
    craft_of,
    fly_draws,
    print_progress,
    write_json,
)
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


# Gusts.

GUST_AMPLITUDE = 5.0  # A of the gusts, from ahead [m/s]
WAVELETS: dict[str, Callable[[float], float]] = {
    "Mexican hat, 0.2 Hz": lambda t: _hat(0.2 * t),
    "Mexican hat, 1.2 Hz": lambda t: _hat(1.2 * t),
    "Morlet": lambda t: math.exp(-0.5 * t * t) * math.cos(5.0 * t),
}
MEAN_WINDS = (0.0, 3.0, 6.0)  # [m/s]
GUST_LEAD, GUST_MIDDLE, GUST_AFTER = 12.0, 8.0, 20.0  # in the mean; to the gust's middle; from there to the end [s]
GUST_HEIGHT = 50.0  # [m]
NEAR_AGAIN = 0.3  # so near again at the end is rejected [m]


def _hat(turns: float) -> float:
    square = (math.pi * turns) ** 2
    return (1.0 - 2.0 * square) * math.exp(-square)


class GustDraw(NamedTuple):
    """One flight through a gust."""

    controller: str
    gust: str
    mean: float  # [m/s]
    seed: int


class FlownGust(NamedTuple):
    """Result of one flight."""

    controller: str
    gust: str
    mean: float  # [m/s]
    seed: int
    farthest: float  # from the set-point [m]
    higher: float  # rise [m]
    left: float  # distance at the end [m]
    fault: str = ""


def fly_gust(draw: GustDraw, craft: Craft = DEFAULT_CRAFT) -> FlownGust:
    """Fly one gust, the belly to the wind, in the open air."""
    vehicle = craft._replace(controller=draw.controller).fly(draw.seed, Start(up=GUST_HEIGHT, airborne=True))
    vehicle.reference = hover_at((0.0, 0.0, GUST_HEIGHT), 0.0)
    vehicle.begin_flight(Law.HOVER_LINEAR)
    shape, step, off = WAVELETS[draw.gust], SAMPLE_PERIODS * PERIOD, []
    try:
        for k in range(round((GUST_LEAD + GUST_MIDDLE + GUST_AFTER) / step)):
            rise = min(k * step / 4.0, 1.0)
            vehicle.set_wind(
                (-(rise * draw.mean + GUST_AMPLITUDE * shape(k * step - GUST_LEAD - GUST_MIDDLE)), 0.0, 0.0)
            )
            vehicle.advance(SAMPLE_PERIODS)
            if k * step >= GUST_LEAD:
                p = vehicle.truth.body.position
                off.append((p.x, p.y, p.z - GUST_HEIGHT))
    except DivergedError as error:
        return FlownGust(*draw, math.inf, math.inf, math.inf, str(error).split(":")[0])
    distance = np.linalg.norm(off, axis=1)
    lost = "" if distance[-1] < NEAR_AGAIN else "did not come back"
    return FlownGust(*draw, float(distance.max()), float(np.array(off)[:, 2].max()), float(distance[-1]), lost)


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


def gust_table(flown: Sequence[FlownGust]) -> list[str]:
    """Distances in the gusts, as lines of text."""
    names = list(dict.fromkeys(flight.controller for flight in flown))
    lines = ["farthest from the set-point, and higher than it, in gusts of 5 m/s [m]"]
    lines.append(f"{'gust':<22}{'mean':>5}" + "".join(f"{name:>20}" for name in names))
    for gust, mean in dict.fromkeys((flight.gust, flight.mean) for flight in flown):
        cells = []
        for name in names:
            group = [f for f in flown if (f.controller, f.gust, f.mean) == (name, gust, mean)]
            lost = sum(bool(f.fault) for f in group)
            text = f"{max(f.farthest for f in group):.2f} {max(f.higher for f in group):+.2f}"
            cells.append(f"{text} {lost} lost" if lost else text)
        lines.append(f"{gust:<22}{mean:>5g}" + "".join(f"{cell:>20}" for cell in cells))
    return lines


def study_claims(args: argparse.Namespace) -> int:
    """Print growth and gusts with the verdicts on the claims; exit code 1 if one is refuted."""
    check_seeded(args, {})
    craft, names = craft_of(args), list(CONTROLLERS) if args.controller is None else [args.controller]
    a = load_airframe(args.airframe).parameters
    if min(a.motor_tau, a.elevon_tau) <= 0.0:
        raise SitlError(f"--airframe {args.airframe}: its actuators have no time constants")
    seeds = range(args.first, args.first + args.flights)
    draws = [GustDraw(name, gust, mean, s) for gust in WAVELETS for mean in MEAN_WINDS for name in names for s in seeds]
    fly = partial(fly_gust, craft=craft)
    flown = fly_draws(fly, draws, args.jobs, on_progress=partial(print_progress, of=len(draws)))
    claims = stability_claims(a)
    claims += [
        Claim(f"{name} rejects the gusts", not any(f.fault for f in flown if f.controller == name)) for name in names
    ]
    verdicts = [f"{'holds' if claim.holds else 'refuted'}: {claim.text}" for claim in claims]
    print("\n".join([*stability_table(a), *gust_table(flown), *verdicts]), flush=True)
    if args.json is not None:
        write_json(args.json, [flight._asdict() for flight in flown])
    return 0 if all(claim.holds for claim in claims) else 1
