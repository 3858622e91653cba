r"""Gain, phase and delay margins of each law: its loop opened where the actuators act, about a settled flight.

A control period is a map of all numbers that a flight keeps, z' = F(z); its Jacobian A, by central differences, holds
plant, actuators and law as they are compiled, and the wind estimator with the gain that it has reached. The positions u
of the actuators are among z: what the body takes from them is B, all else R, so that

.. math::
    L(z) = E_u (z I - R)^{-1} B, \qquad z = e^{i \omega T}

tells which positions answer positions: a factor on it is one on motors' and elevons' effect, which the law does not
know. Taken as thrust, yaw, pitch and roll, each loop is opened with the other three closed. The law sees the truth: of
a delay margin the instruments' own delay is to be taken off.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from sitl import (
    PERIOD,
    Airframe,
    Array,
    Law,
    Reference,
    Simulation,
    SitlError,
    Start,
    Tuning,
    along,
    hover_at,
    leg,
    load_airframe,
)
from sitl.lab.studies.seeded_flights import write_json
from sitl.model.vectors import norm
from sitl.simulation.tuning import INDI, REPORTED, ROBUST_PI

LOOP_HEIGHT, LOOP_LEG, LOOP_AIRSPEED = 60.0, 4000.0, 15.0  # [m], [m], [m/s]
SETTLED_RATE = 0.02  # a vehicle that turns faster at the end has not settled [rad/s]
SETTLING, QUIET = 40.0, 10.0  # with noise in what the wind is estimated from, and without [s]
LEAST_LOOP_WIND, LOOP_WIND = 0.3, 5.0  # from ahead [m/s]; at no air at all the laws' angles to it have no derivative
LOOP_DIFFERENCE = 1e-6  # of the differences, of each number's size where that is over 1
LEAST_DERIVATIVE = 1e-12  # a derivative below this is one of numbers that do not touch
FREQUENCIES = np.geomspace(0.05, 0.98 * math.pi / PERIOD, 500)  # [rad/s]
LOOPS = ("thrust", "yaw", "pitch", "roll")
MIXED = 0.5 * np.array(((1, 1, 0, 0), (1, -1, 0, 0), (0, 0, 1, 1), (0, 0, 1, -1)))  # of (w1, w2, delta1, delta2)
POSITIONS_AT, KNOWN_AT, COMMANDS_AT = "plant.actuators", "estimate.actuators", "controller.command"  # in a flight
FIXED = "controller.wind.covariance"  # likewise: what stays as it is, as the gain of the wind estimator then does
UNSTABLE = 1.0 + 0.1 * PERIOD  # eigenvalue above this; what grows slower is the drift of a flight not quite settled
LEAST_GAIN, GREATEST_GAIN = 0.71, 2.0  # factors, -3 and +6 dB, between which a loop ought to be stable
MIN_PHASE = math.radians(25.0)  # margin that it ought to have
NOT_OURS = Law.ROBUST_PI  # a law that is shown for comparison, and not judged

BY_REPORT = Tuning(controller=REPORTED)


class SettledFlight(NamedTuple):
    """A flight about which a law is looked at."""

    name: str
    begins: Law
    tuning: Tuning
    airspeed: float = 0.0  # along a leg; 0: a hover [m/s]
    wind: float = 0.0  # from ahead [m/s]


SETTLED_FLIGHTS = (
    SettledFlight("hover", Law.HOVER_LINEAR, Tuning(v_leave=math.inf), 0.0, LEAST_LOOP_WIND),
    SettledFlight("hover", Law.HOVER_ZERO_MOMENT, BY_REPORT._replace(v_enter=0.0), 0.0, LEAST_LOOP_WIND),
    SettledFlight("hover", Law.INDI, Tuning(controller=INDI), 0.0, LEAST_LOOP_WIND),
    SettledFlight("hover", Law.ROBUST_PI, Tuning(controller=ROBUST_PI), 0.0, LEAST_LOOP_WIND),
    SettledFlight("hover in 5 m/s", Law.HOVER_ZERO_MOMENT, BY_REPORT, 0.0, LOOP_WIND),
    SettledFlight("hover in 5 m/s", Law.INDI, Tuning(controller=INDI), 0.0, LOOP_WIND),
    SettledFlight("hover in 5 m/s", Law.ROBUST_PI, Tuning(controller=ROBUST_PI), 0.0, LOOP_WIND),
    SettledFlight("cruise", Law.HOVER_LINEAR, BY_REPORT, LOOP_AIRSPEED),
    SettledFlight("cruise", Law.HOVER_LINEAR, BY_REPORT._replace(forward_linear=1), LOOP_AIRSPEED),
    SettledFlight("cruise", Law.INDI, Tuning(controller=INDI), LOOP_AIRSPEED),
)


class LoopMargin(NamedTuple):
    """Margins of one loop: so much more or less, or later, and it is unstable."""

    channel: str
    least_gain: float  # factor on the loop below which it is unstable; 0: none
    greatest_gain: float  # factor above which it is; infinite: none
    phase: float  # [rad]
    crossover: float  # greatest frequency at which the loop has a gain of 1 [rad/s]
    delay: float  # [s]

    @property
    def suffices(self) -> bool:
        """Whether gain and phase margins are those that a loop ought to have."""
        gains = self.least_gain <= LEAST_GAIN and self.greatest_gain >= GREATEST_GAIN
        return gains and self.phase >= MIN_PHASE


class LawMargins(NamedTuple):
    """Margins of the law that a flight settled under."""

    flight: str
    law: str
    radius: float  # greatest magnitude of an eigenvalue
    loops: tuple[LoopMargin, ...]  # none where it does not settle


class PeriodMap(NamedTuple):
    """One control period about a flight, z' = A z in deviations."""

    A: Array  # (n, n)
    positions: npt.NDArray[np.int_]  # which of z are the actuators' positions, or the commands that they are at, (4,)
    of_actuators: npt.NDArray[np.bool_]  # which of z are either, or what is known of them, (n,)


def numbers(value: Any, place: str = "") -> Iterator[tuple[str, float]]:  # noqa: ANN401 - any NamedTuple
    """The real numbers of nested named values, each with its place."""
    if isinstance(value, tuple):
        for name, part in zip(getattr(value, "_fields", range(len(value))), value, strict=True):
            yield from numbers(part, f"{place}.{name}" if place else str(name))
    elif type(value) is float:
        yield place, value


def with_numbers(value: Any, taken: Iterator[float]) -> Any:  # noqa: ANN401 - likewise
    """The same named values with other real numbers, in the order of :func:`numbers`."""
    if isinstance(value, tuple):
        parts = [with_numbers(part, taken) for part in value]
        return type(value)(*parts) if hasattr(value, "_fields") else tuple(parts)
    return next(taken) if type(value) is float else value


def period_map(vehicle: Simulation) -> PeriodMap:
    """The Jacobian of the next control period; the flight is afterwards as before.

    Raises:
        SitlError: If a jump falls due in it.
    """
    flight, jumps = vehicle.flight, len(vehicle.jumps)
    places, about = zip(*numbers(flight), strict=True)

    def moved(z: Array) -> Array:
        vehicle.flight = with_numbers(flight, iter(z.tolist()))
        vehicle.advance(1)
        return np.array([number for _, number in numbers(vehicle.flight)])

    z = np.array(about)
    sizes = LOOP_DIFFERENCE * np.maximum(1.0, np.abs(z))
    steps = np.diag(sizes)
    A = np.array([(moved(z + e) - moved(z - e)) / (2.0 * size) for e, size in zip(steps, sizes, strict=True)]).T
    vehicle.flight = flight
    if len(vehicle.jumps) > jumps:
        raise SitlError(f"{vehicle.law.name}: no settled flight, a jump falls due")
    fixed = [place.startswith(FIXED) for place in places]
    A[fixed], A[:, fixed] = 0.0, 0.0
    of_actuators = np.array([place.startswith((POSITIONS_AT, KNOWN_AT, COMMANDS_AT)) for place in places])
    # Actuators without a lag are at the command within the period, whatever they were at.
    known = [np.flatnonzero([place.startswith(name) for place in places]) for name in (POSITIONS_AT, COMMANDS_AT)]
    return PeriodMap(A, max(known, key=lambda u: np.abs(A[~of_actuators][:, u]).sum()), of_actuators)


def opened(around: PeriodMap) -> tuple[Array, Array, Array]:
    """R, B and E_u of the loop opened at the actuators, without the numbers that have no part in it."""
    A, u = around.A, around.positions
    B, R = A[:, u].copy(), A.copy()
    B[around.of_actuators] = 0.0
    R[np.ix_(np.flatnonzero(~around.of_actuators), u)] = 0.0
    touched = np.abs(R) > LEAST_DERIVATIVE
    driven = _reached(touched, np.abs(B).max(axis=1) > LEAST_DERIVATIVE)
    sees = np.zeros(len(A), bool)
    sees[u] = True
    part = driven & _reached(touched.T, sees)
    part[u] = True
    return R[np.ix_(part, part)], B[part], np.eye(len(A))[u][:, part]


def _reached(touched: npt.NDArray[np.bool_], start: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """The numbers that are reached from some of them, step by step."""
    reached = start
    while True:
        further = reached | (touched & reached).any(axis=1)
        if (further == reached).all():
            return reached
        reached = further


def responses(around: PeriodMap) -> Array:
    """The four loops over ``FREQUENCIES``, each with the other three closed, as negative feedback sees them, (n, 4)."""
    R, B, E = opened(around)
    z = np.exp(1j * FREQUENCIES * PERIOD)
    x = np.linalg.solve(z[:, None, None] * np.eye(len(R)) - R, np.broadcast_to(B.astype(complex), (len(z), *B.shape)))
    L = MIXED @ (E @ x) @ np.linalg.inv(MIXED)
    loops = np.empty((len(z), 4), complex)
    for i in range(4):
        o = [j for j in range(4) if j != i]
        others = np.linalg.solve(np.eye(3) - L[:, o][:, :, o], L[:, o][:, :, [i]])
        loops[:, i] = -(L[:, i, i] + (L[:, [i]][:, :, o] @ others)[:, 0, 0])
    return loops


def margin_of(channel: str, loop: Array) -> LoopMargin:
    """Margins of a loop over ``FREQUENCIES``, between which it is taken to be straight, (n,)."""
    reals = [(1.0 - t) * loop[k].real + t * loop[k + 1].real for k, t in _zeros(loop.imag)]
    gains = [-1.0 / real for real in reals if real < 0.0]
    crossings = [
        (np.angle((1.0 - t) * loop[k] + t * loop[k + 1]), (1.0 - t) * FREQUENCIES[k] + t * FREQUENCIES[k + 1])
        for k, t in _zeros(np.abs(loop) - 1.0)
    ]
    return LoopMargin(
        channel,
        max((gain for gain in gains if gain < 1.0), default=0.0),
        min((gain for gain in gains if gain > 1.0), default=math.inf),
        float(min((math.pi - abs(angle) for angle, _ in crossings), default=math.inf)),
        float(max((frequency for _, frequency in crossings), default=0.0)),
        float(min(((math.pi + angle) % math.tau / frequency for angle, frequency in crossings), default=math.inf)),
    )


def _zeros(values: Array) -> list[tuple[int, float]]:
    """Changes of sign of a function over the frequencies: the index before, and how far from there to the next."""
    return [(int(k), float(values[k] / (values[k] - values[k + 1]))) for k in np.flatnonzero(np.diff(values > 0.0))]


def settled(flight: SettledFlight, a: Airframe) -> Simulation:
    """A vehicle that has flown until its law has settled."""
    vehicle = Simulation(a, start=Start(up=LOOP_HEIGHT, airborne=True), tuning=flight.tuning)
    vehicle.set_wind((-flight.wind, 0.0, 0.0), 0.0)
    vehicle.reference = _reference(flight.airspeed)
    vehicle.begin_flight(flight.begins)
    vehicle.step(SETTLING)
    vehicle.noise = vehicle.noise._replace(velocity=0.0, accelerometer=0.0, pitot=0.0)
    vehicle.step(QUIET)
    return vehicle


def margins_of(flight: SettledFlight, a: Airframe) -> LawMargins:
    """Margins of the law that a flight settles under."""
    vehicle = settled(flight, a)
    if norm(vehicle.truth.body.rates) > SETTLED_RATE:
        return LawMargins(flight.name, vehicle.law.name, math.inf, ())
    around = period_map(vehicle)
    radius = float(np.abs(np.linalg.eigvals(around.A)).max())
    return LawMargins(flight.name, vehicle.law.name, radius, tuple(map(margin_of, LOOPS, responses(around).T)))


def _reference(airspeed: float) -> Reference:
    there = hover_at((0.0, 0.0, LOOP_HEIGHT), 0.0)
    path = leg((0.0, 0.0, LOOP_HEIGHT), (LOOP_LEG, 0.0, LOOP_HEIGHT), LOOP_AIRSPEED)
    return along(there, path, 0.0) if airspeed else there


def loop_table(found: list[LawMargins]) -> list[str]:
    """All margins, as lines of text."""
    lines = [f"{'flight':<16}{'law':<24}{'loop':<8}{'gain':>18}{'phase':>7}{'crossover':>12}{'delay':>8}"]
    for law in found:
        for loop in law.loops:
            gain = f"{loop.least_gain:.2f} to {loop.greatest_gain:.1f}"
            phase, delay = f"{math.degrees(loop.phase):.0f}°", f"{1e3 * loop.delay:.0f} ms"
            mark = "" if loop.suffices else " *"
            text = f"{gain:>18}{phase:>7}{loop.crossover:>6.1f} rad/s{delay:>8}{mark}"
            lines.append(f"{law.flight:<16}{law.law:<24}{loop.channel:<8}{text}")
        if law.radius > UNSTABLE:
            growth = f"unstable: growth {math.log(law.radius) / PERIOD:.2f}/s" if law.loops else "does not settle"
            lines.append(f"{law.flight:<16}{law.law:<24}{growth}")
    return lines


def study_loops(args: argparse.Namespace) -> int:
    """Print the margins; exit code 1 if a law of ours is unstable, or bears less than -3 to 6 dB or 25°."""
    a = load_airframe(args.airframe).parameters
    found = [margins_of(flight, a) for flight in SETTLED_FLIGHTS]
    ours = [law for law in found if law.law != NOT_OURS.name]
    weak = sum(not loop.suffices for law in ours for loop in law.loops)
    unstable = sum(law.radius > UNSTABLE for law in ours)
    print("\n".join(loop_table(found)))
    print(f"of {len(ours)} settled flights under laws of ours {unstable} are unstable, {weak} loops bear less (*)")
    if args.json is not None:
        write_json(args.json, [law._asdict() | {"loops": [loop._asdict() for loop in law.loops]} for law in found])
    return 1 if weak or unstable else 0
