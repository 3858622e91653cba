"""The proved V of the hover in a wind: about the calm hover, and about the hover in the wind that is estimated.

In a steady wind the linear law stands still in another attitude, with another integral. These equilibria are found,
how fast V falls near them, and recoveries are flown: how often V is below the proved level as the linear law takes
over, and how long it stays there. The proof is of the calm alone; the other figures are of flights.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator
from functools import partial
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sitl import Airframe, Array, Body, Estimate, Law, Quaternion, Simulation, SitlError, Start, Vector
from sitl.control import hover_linear
from sitl.control.allocation import allocate
from sitl.control.hover_linear import SQRT_HALF, HoverError, LinearGains
from sitl.design.proved import PROVED_LEVEL, is_proved, proved_gains
from sitl.lab.proofs.closed_loop import lyapunov_matrix, scaled
from sitl.lab.studies.seeded_flights import (
    Craft,
    check_seeded,
    craft_of,
    fly_draws,
    print_progress,
    write_json,
)
from sitl.model.plant import derivative, inflow
from sitl.model.quaternions import multiply, rotate_inverse

WIND_STATES = 15
STILL_RATES = [3, 4, 5, 9, 10, 11]  # rates that vanish where the vehicle stands still
SHIFTED = [6, 7, 8, 12, 13, 14]  # of the state, what makes them do so: eps and the integral
DIFFERENCE_STEP = 1e-6  # of differences
HOVER_NEWTON_STEPS, LARGEST_NEWTON_STEP, STANDS_STILL = 60, 0.2, 1e-9  # of the search of an equilibrium
STUDIED_WINDS = (0.0, 1.0, 2.0, 3.0, 4.0)  # [m/s]
WIDEST_WIND, WIND_GRID = 6.0, 1.0  # of the winds whose equilibria are tabled, and the distance of two [m/s]
RECOVERY_HEIGHT, RECOVERY_SECONDS, SETTLED_AFTER = (
    30.0,
    40.0,
    20.0,
)  # of a recovery [m], [s]; V is looked at from then on [s]
LOOK_EVERY = 50
THROWN_SPEED, THROWN_RATE = 5.0, 3.0  # that a recovery begins with [m/s], [rad/s]


def rates(x: Array, wind: Array, a: Airframe, gains: LinearGains) -> Array:
    """Rate of the state, (15,), in a wind in the heading frame, the actuators where the law wants them."""
    e = x[6:9] - (0.0, SQRT_HALF, 0.0)
    p, v, tilt, w, integral = (Vector(*part) for part in x.reshape(5, 3).tolist())
    air, still = Vector(*wind.tolist()), Vector(0.0, 0.0, 0.0)
    body = Body(p, v, Quaternion(math.sqrt(1.0 - e @ e), *e.tolist()), w)
    wanted = hover_linear.control(HoverError(p, v, tilt, w), integral, 0.0, gains)
    rate = derivative(body, allocate(wanted, a, inflow(body, air))[0], air, still, still, a)
    q = rate.attitude
    return np.array([*v, *rate.velocity, q.x, q.y, q.z, *rate.rates, *(x[:3] + gains.lead * x[3:6])])


def jacobian(x: Array, wind: Array, a: Airframe, gains: LinearGains) -> Array:
    """Of the rate by the state, by differences, (15, 15)."""
    ways = DIFFERENCE_STEP * np.eye(WIND_STATES)
    return np.array(
        [(rates(x + way, wind, a, gains) - rates(x - way, wind, a, gains)) / (2.0 * DIFFERENCE_STEP) for way in ways]
    ).T


def equilibrium(wind: Array, a: Airframe, gains: LinearGains, start: Array | None = None) -> Array:
    """The state in which the law stands still in a wind in the heading frame (3,), (15,).

    Args:
        wind: [m/s].
        a: The airframe.
        gains: The law.
        start: Where the search begins: that of a wind near it; the calm hover by default.

    Raises:
        SitlError: None is found.
    """
    x = np.zeros(WIND_STATES) if start is None else start.copy()
    for _ in range(HOVER_NEWTON_STEPS):
        off = rates(x, wind, a, gains)[STILL_RATES]
        if np.abs(off).max() < STANDS_STILL:
            return x
        step = np.linalg.lstsq(jacobian(x, wind, a, gains)[np.ix_(STILL_RATES, SHIFTED)], -off, rcond=None)[0]
        x[SHIFTED] += step * min(1.0, LARGEST_NEWTON_STEP / max(float(np.abs(step).max()), STANDS_STILL))
    raise SitlError(f"the linear law stands still nowhere in a wind of {wind.tolist()} m/s")


class Equilibria(NamedTuple):
    """Of level winds on a grid from -WIDEST_WIND to WIDEST_WIND, along the belly and to the left."""

    states: Array  # (n, n, 15)

    @classmethod
    def of(cls, a: Airframe, gains: LinearGains) -> Equilibria:
        """Each found from its neighbour's, from the calm on; where none is found, the neighbour's counts."""
        n = round(WIDEST_WIND / WIND_GRID)
        states = np.zeros((2 * n + 1, 2 * n + 1, WIND_STATES))
        for j, k in sorted(np.ndindex(2 * n + 1, 2 * n + 1), key=lambda at: math.hypot(at[0] - n, at[1] - n)):
            near = states[j - np.sign(j - n), k - np.sign(k - n)]
            wind = WIND_GRID * np.array((j - n, k - n, 0.0))
            try:
                states[j, k] = equilibrium(wind, a, gains, near)
            except SitlError:
                states[j, k] = near
        return cls(states)

    def at(self, winds: Array) -> Array:
        """Those of winds (k, 3), interpolated, (k, 15); beyond the grid those of its edge."""
        n = len(self.states)
        place = np.clip((winds[:, :2] + WIDEST_WIND) / WIND_GRID, 0.0, n - 1.0 - 1e-9)
        low = place.astype(int)
        (s, t), (j, k) = (place - low).T[:, :, None], low.T
        near, far = ((1.0 - t) * self.states[m, k] + t * self.states[m, k + 1] for m in (j, j + 1))
        return np.asarray((1.0 - s) * near + s * far)


class WindLooks(NamedTuple):
    """A recovery, one row per look, in the heading frame."""

    wind: float  # steady [m/s]
    time: Array  # (n,) [s]
    is_linear: npt.NDArray[np.bool_]  # (n,): whether the linear law flies
    believed: Array  # state as estimated, with the law's integral, (n, 15)
    true: Array  # likewise as it is
    felt: Array  # estimate of the wind, (n, 3) [m/s]
    blowing: Array  # the wind, (n, 3) [m/s]


class WindDraw(NamedTuple):
    """One recovery."""

    seed: int
    wind: float  # steady, from a random side [m/s]
    gusts: float  # rms per axis [m/s]


def fly(draw: WindDraw, craft: Craft) -> WindLooks:
    """Recover from any attitude, up to THROWN_SPEED and THROWN_RATE, and hold."""
    random = np.random.default_rng((draw.seed, 77))
    side, turn = random.uniform(0.0, 2.0 * math.pi), random.uniform(0.0, math.pi)
    vehicle = craft.fly(draw.seed, Start(up=RECOVERY_HEIGHT, airborne=True, heading=random.uniform(-math.pi, math.pi)))
    vehicle.set_wind((draw.wind * math.cos(side), draw.wind * math.sin(side), 0.0), draw.gusts)
    vehicle.begin_flight(Law.HOVER_ZERO_MOMENT)
    at, axis = vehicle.truth.body, _within(random, 1.0)
    axis /= np.linalg.norm(axis)
    turned = multiply(at.attitude, Quaternion(math.cos(0.5 * turn), *(math.sin(0.5 * turn) * axis).tolist()))
    v, w = (Vector(*_within(random, most).tolist()) for most in (THROWN_SPEED, THROWN_RATE))
    vehicle.place(Body(at.position, v, turned, w))
    looks = []
    while vehicle.time < RECOVERY_SECONDS:
        vehicle.advance(LOOK_EVERY)
        looks.append(_look(vehicle))
    time, linear, believed, true, felt, blowing = (np.array(part) for part in zip(*looks, strict=True))
    return WindLooks(draw.wind, time, linear, believed, true, felt, blowing)


def _within(random: np.random.Generator, most: float) -> Array:
    """A point in a ball, (3,)."""
    way = random.standard_normal(3)
    return np.asarray(way * most * random.uniform() ** (1.0 / 3.0) / np.linalg.norm(way))


def _look(vehicle: Simulation) -> tuple[float, bool, Array, Array, Vector, Vector]:
    seen, body = vehicle.estimate, vehicle.truth.body
    truth = seen._replace(position=body.position, velocity=body.velocity, attitude=body.attitude, rates=body.rates)
    heading = vehicle.reference.heading
    north = Quaternion(math.cos(0.5 * heading), 0.0, 0.0, math.sin(0.5 * heading))
    integral = rotate_inverse(north, vehicle.flight.controller.states.integral)

    def state(told: Estimate) -> Array:
        x = hover_linear.error(told, vehicle.reference.position, heading)
        return np.array([*x.position, *x.velocity, *x.tilt, *x.rates, *integral])

    winds = rotate_inverse(north, seen.wind), rotate_inverse(north, vehicle.wind)
    return vehicle.time, vehicle.law == Law.HOVER_LINEAR, state(seen), state(truth), *winds


class WindRow(NamedTuple):
    """Flights in one wind; shares are of those in which the linear law takes over, V of the proved level."""

    wind: float  # [m/s]
    flights: int
    entered: int
    calm: float  # share whose V about the calm hover is below the level then, by the estimate
    windy: float  # the same about the equilibrium in the estimated wind, its integral the best
    stayed: float  # share whose V about the equilibrium in the wind as it blows stays below it once settled, as it is
    inside: float  # share of the looks then
    usual: float  # median V of those


def row(flown: list[WindLooks], equilibria: Equilibria, P: Array) -> WindRow:
    """Figures of flights in the same wind."""
    without_integral = np.linalg.inv(np.linalg.inv(P)[:12, :12])  # the least V of those with any integral
    calm, windy, settled = [], [], []
    for flight in flown:
        first = np.flatnonzero(flight.is_linear)
        if not first.size:
            continue
        x = flight.believed[first[:1]]
        calm.append(_values(x, P)[0] < PROVED_LEVEL)
        off = (x - equilibria.at(flight.felt[first[:1]]))[:, :12]
        windy.append(_values(off, without_integral)[0] < PROVED_LEVEL)
        looks = (flight.time >= SETTLED_AFTER) & flight.is_linear
        settled.append(_values((flight.true - equilibria.at(flight.blowing))[looks], P))
    all_looks = np.concatenate(settled) if settled else np.zeros(0)
    return WindRow(
        wind=flown[0].wind,
        flights=len(flown),
        entered=len(calm),
        calm=_share(calm),
        windy=_share(windy),
        stayed=_share([bool((values < PROVED_LEVEL).all()) for values in settled if values.size]),
        inside=_share((all_looks < PROVED_LEVEL).tolist()),
        usual=float(np.median(all_looks)) if all_looks.size else math.nan,
    )


def _values(x: Array, P: Array) -> Array:
    return np.asarray(np.einsum("ni,ij,nj->n", x, P, x))


def _share(which: list[bool]) -> float:
    return float(np.mean(which)) if which else math.nan


def near_equilibria(a: Airframe, gains: LinearGains) -> Iterator[str]:
    """Equilibria in winds from ahead, and how V and the loop fall near them, as lines of text."""
    P, x = lyapunov_matrix(gains), np.zeros(WIND_STATES)
    L: Array = np.asarray(np.linalg.cholesky(P), dtype=np.float64)
    yield "wind from ahead   nose off [deg]   elevons [deg]   V from calm   V falls at [1/s]   slowest mode [1/s]"
    for wind in STUDIED_WINDS:
        air = np.array((-wind, 0.0, 0.0))
        x = equilibrium(air, a, gains, x)
        e = x[6:9] - (0.0, SQRT_HALF, 0.0)
        up = 2.0 * (e[0] * e[2] - math.sqrt(1.0 - e @ e) * e[1])
        p, v, tilt, w, integral = (Vector(*part) for part in x.reshape(5, 3).tolist())
        u = hover_linear.control(HoverError(p, v, tilt, w), integral, 0.0, gains)
        J = jacobian(x, air, a, gains)
        fall = -0.5 * float(np.linalg.eigvalsh(scaled(J, L))[-1])
        slowest = float(np.linalg.eigvals(J).real.max())
        yield (
            f"{wind:11.1f} m/s{math.degrees(math.acos(min(up, 1.0))):15.1f}{math.degrees(abs(u.dT1 / u.T1)):16.1f}"
            f"{x @ P @ x:14.2f}{fall:19.2f}{slowest:21.2f}"
        )


def lines(rows: list[WindRow]) -> Iterator[str]:
    """The table of the flights."""
    yield "wind       flights   entered   V < 1 then: calm   in the wind   stayed   looks below 1   median V"
    for made in rows:
        yield (
            f"{made.wind:4.1f} m/s{made.flights:10d}{made.entered:10d}{made.calm:19.0%}{made.windy:14.0%}"
            f"{made.stayed:9.0%}{made.inside:16.1%}{made.usual:11.2f}"
        )


def study_winds(args: argparse.Namespace) -> int:
    """Find the equilibria, fly the recoveries and print the tables."""
    check_seeded(args, {"gusts": 10.0})
    craft = craft_of(args)
    a = craft.model
    if not is_proved(a):
        raise SitlError(f"--airframe {args.airframe}: no V is stored that proves anything of its hover")
    gains = proved_gains(a)
    print("\n".join([*near_equilibria(a, gains), ""]), flush=True)
    equilibria = Equilibria.of(a, gains)
    draws = [
        WindDraw(seed, wind, args.gusts)
        for wind in STUDIED_WINDS
        for seed in range(args.first, args.first + args.flights)
    ]
    flown = fly_draws(partial(fly, craft=craft), draws, args.jobs, 1, lambda done: print_progress(done, len(draws)))
    rows = [
        row([flight for flight in flown if flight.wind == wind], equilibria, lyapunov_matrix(gains))
        for wind in STUDIED_WINDS
    ]
    print("\n".join(lines(rows)))
    if args.json is not None:
        write_json(args.json, [made._asdict() for made in rows])
    return 0
