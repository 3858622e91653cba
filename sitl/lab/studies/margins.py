"""Margins of delay and noise of the estimate: flights by law over a delay and a factor on all noise.

The delay stands between inertial reading and actuator, on top of everything that the instruments' specifications
state; the noise is every noise density, noise and vibration of those, times a factor. The vehicle is told the delay,
for which its forward law gives up bandwidth, or is not told.
"""

from __future__ import annotations

import argparse
import enum
import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from sitl import (
    PERIOD,
    Array,
    DivergedError,
    Law,
    Recording,
    Simulation,
    Start,
    Tuning,
    along,
    hover_at,
    leg,
    load_sensors,
)
from sitl.lab.studies.proportions import counted
from sitl.lab.studies.seeded_flights import (
    Craft,
    check_seeded,
    craft_of,
    fly_draws,
    ignore_progress,
    print_progress,
    write_json,
)
from sitl.lab.studies.wrong_models import noisier
from sitl.simulation.tuning import CONTROLLERS, REPORTED

MARGIN_HEIGHT = 60.0  # [m]
STEP_OFF = 0.5  # how far from its reference a hover begins [m]
HOVER_SECONDS, LEG_SECONDS = 25.0, 45.0
SETTLED_SECONDS = 10.0  # of a hover, before which it may still be on its way
MARGIN_LEG, MARGIN_AIRSPEED = 350.0, 15.0  # [m], [m/s]
MIN_CRUISE_SPEED = 10.0  # over the ground, above which a front transition is done [m/s]
NEAR_REFERENCE = 3.0  # about the reference in the end, with satellites [m]
MAX_HEIGHT_ERROR = 15.0  # along a leg [m]
DELAYS = (0.0, 0.01, 0.02, 0.03, 0.04, 0.05, 0.06, 0.08)  # [s]
NOISE_FACTORS = (1.0, 2.0, 4.0, 8.0)


class MarginManoeuvre(enum.Enum):
    """Manoeuvre of a flight."""

    HOVER_LINEAR = "hover, linear law"
    HOVER_ZERO_MOMENT = "hover, zero-moment law"
    FORWARD = "transitions and cruise"
    HOVER_INDI = "hover, INDI"


REPORT_MANOEUVRES = (MarginManoeuvre.HOVER_LINEAR, MarginManoeuvre.HOVER_ZERO_MOMENT, MarginManoeuvre.FORWARD)
INDI_MANOEUVRES = (MarginManoeuvre.HOVER_INDI, MarginManoeuvre.FORWARD)


class MarginDraw(NamedTuple):
    """One flight."""

    seed: int
    manoeuvre: MarginManoeuvre
    delay: float  # [s]
    noise: float  # factor
    told: bool = True  # whether the vehicle knows the delay


class MarginFlight(NamedTuple):
    """Result of one flight."""

    draw: MarginDraw
    converged: bool
    error: float  # rms distance from the reference once settled; of the height along a leg [m]
    activity: float  # rms rate of the elevons [rad/s]
    fault: str  # empty if it converged


def fly(draw: MarginDraw, craft: Craft) -> MarginFlight:
    """Fly one manoeuvre in calm air."""
    vehicle = started(draw, craft)
    hovers = draw.manoeuvre is not MarginManoeuvre.FORWARD
    there = hover_at((STEP_OFF if hovers else 0.0, 0.0, MARGIN_HEIGHT), 0.0)
    path = leg((0.0, 0.0, MARGIN_HEIGHT), (MARGIN_LEG, 0.0, MARGIN_HEIGHT), MARGIN_AIRSPEED)
    vehicle.reference = there if hovers else along(there, path, 0.0)
    try:
        flown = vehicle.record(HOVER_SECONDS if hovers else LEG_SECONDS, 1.0 / PERIOD)
    except DivergedError:
        return MarginFlight(draw, False, math.inf, math.inf, "diverged")
    return _judged_hover(draw, flown) if hovers else _judged_leg(draw, flown)


def started(draw: MarginDraw, craft: Craft) -> Simulation:
    """The vehicle of a draw, in the air and at rest."""
    specified = load_sensors(craft.sensors)
    sensors = noisier(specified, draw.noise, draw.delay)
    vehicle = Simulation(
        craft.model,
        seed=draw.seed,
        start=Start(up=MARGIN_HEIGHT, airborne=True),
        tuning=_alone(draw.manoeuvre, craft.tuning),
        navigation=craft.navigation,
        sensors=sensors,
    )
    if not draw.told:
        vehicle.avionics.sensors = specified  # what it knows of its instruments; they stay as they are
        vehicle.retune(vehicle.tuning)
    vehicle.begin_flight(Law.HOVER_LINEAR if draw.manoeuvre is MarginManoeuvre.HOVER_LINEAR else Law.HOVER_ZERO_MOMENT)
    return vehicle


def _alone(manoeuvre: MarginManoeuvre, tuning: Tuning) -> Tuning:
    """Thresholds under which a hover law flies alone."""
    if manoeuvre is MarginManoeuvre.HOVER_LINEAR:
        return tuning._replace(v_leave=math.inf)
    return tuning._replace(v_enter=0.0) if manoeuvre is MarginManoeuvre.HOVER_ZERO_MOMENT else tuning


def elevon_activity(flown: Recording) -> float:
    """Rms rate of both elevons of a recording at the control rate [rad/s]."""
    return float(np.sqrt(np.mean((np.diff(flown.actuators[:, 2:], axis=0) / PERIOD) ** 2)))


def _judged_hover(draw: MarginDraw, flown: Recording) -> MarginFlight:
    off = flown.position[flown.time - flown.time[0] > SETTLED_SECONDS] - (STEP_OFF, 0.0, MARGIN_HEIGHT)
    distance = np.sqrt((off**2).sum(axis=1))
    error, farthest = float(np.sqrt(np.mean(distance**2))), float(distance.max())
    fault = "" if farthest < NEAR_REFERENCE else f"{farthest:.0f} m away"
    return MarginFlight(draw, not fault, error, elevon_activity(flown), fault)


def _judged_leg(draw: MarginDraw, flown: Recording) -> MarginFlight:
    high = np.abs(flown.position[:, 2] - MARGIN_HEIGHT)
    error = float(np.sqrt(np.mean(high**2)))
    return MarginFlight(draw, not (fault := _leg_fault(flown, high)), error, elevon_activity(flown), fault)


def _leg_fault(flown: Recording, high: Array) -> str:
    """The first fault along a leg, in words; empty if there was none."""
    speed = np.hypot(flown.velocity[:, 0], flown.velocity[:, 1])
    fast, lost = np.flatnonzero(speed > MIN_CRUISE_SPEED), np.flatnonzero(high > MAX_HEIGHT_ERROR)
    if len(fast) == 0 or (len(lost) and lost[0] < fast[0]):
        return "front transition"
    if len(lost) and flown.position[lost[0], 0] < MARGIN_LEG - 60.0:
        return "cruise"
    end = flown.position[-1] - (MARGIN_LEG, 0.0, MARGIN_HEIGHT)
    return "back transition" if len(lost) or float(np.sqrt((end**2).sum())) > 2.0 * NEAR_REFERENCE else ""


def run(
    draws: Sequence[MarginDraw], craft: Craft, jobs: int = 2, on_progress: Callable[[int], None] = ignore_progress
) -> list[MarginFlight]:
    """Fly all draws; their order and results do not depend on the jobs."""
    return fly_draws(partial(fly, craft=craft), draws, jobs, on_progress=on_progress)


def grid(
    seeds: range,
    delays: Sequence[float] = DELAYS,
    factors: Sequence[float] = NOISE_FACTORS,
    controller: str = "hybrid",
    *,
    told: bool = True,
) -> list[MarginDraw]:
    """Every manoeuvre of a controller with every delay and factor, by all seeds."""
    return [
        MarginDraw(seed, manoeuvre, delay, factor, told)
        for manoeuvre in (REPORT_MANOEUVRES if CONTROLLERS[controller] == REPORTED else INDI_MANOEUVRES)
        for factor in factors
        for delay in delays
        for seed in seeds
    ]


def summary(flown: Sequence[MarginFlight]) -> list[str]:
    """A map for each manoeuvre: how many converged, error and elevon activity, by delay and noise."""
    lines = []
    for manoeuvre in dict.fromkeys(flight.draw.manoeuvre for flight in flown):
        own = [flight for flight in flown if flight.draw.manoeuvre is manoeuvre]
        delays = sorted({flight.draw.delay for flight in own})
        factors = sorted({flight.draw.noise for flight in own})
        lines += [f"{manoeuvre.value}: converged / flown, rms error [m], elevons [deg/s]"]
        lines += ["   noise" + "".join(f"{f'{1e3 * delay:g} ms':>19}" for delay in delays)]
        for factor in factors:
            cells = [[f for f in own if f.draw.noise == factor and f.draw.delay == delay] for delay in delays]
            lines += [f"{factor:>7g}x" + "".join(f"{_cell(cell):>19}" for cell in cells)]
        lines += [""]
    return lines


def _cell(flights: Sequence[MarginFlight]) -> str:
    good = [flight for flight in flights if flight.converged]
    if not good:
        return f"0/{len(flights)}"
    error, activity = (float(np.median([flight[k] for flight in good])) for k in (2, 3))
    return f"{len(good)}/{len(flights)} {error:.2f} {math.degrees(activity):.0f}"


SURVIVED_DELAY = 0.04  # from sensor to actuator, that everything converges with at the specified noise [s]
SURVIVED_UNTOLD = 0.03  # likewise, if the vehicle does not know it [s]


def study_margins(args: argparse.Namespace) -> int:
    """Fly the map and print it; exit code 1 if 40 ms, or 30 ms untold, are not survived at the specified noise."""
    limits = {name: most for name, most in (("delay", 0.1), ("noise", 100.0)) if getattr(args, name) is not None}
    check_seeded(args, limits)

    seeds = range(args.first, args.first + args.flights)
    draws = grid(seeds, args.delay or DELAYS, args.noise or NOISE_FACTORS, args.controller, told=not args.untold)
    flown = run(draws, craft_of(args), args.jobs, lambda done: print_progress(done, len(draws)))
    print("\n".join(summary(flown)))
    most = SURVIVED_UNTOLD if args.untold else SURVIVED_DELAY
    needed = [flight for flight in flown if flight.draw.delay <= most and flight.draw.noise <= 1.0]
    if needed:
        kept = sum(flight.converged for flight in needed)
        print(f"up to {1e3 * most:g} ms at the specified noise: {counted(kept, len(needed))} converge", flush=True)
    if args.json is not None:
        write_json(args.json, [flight._asdict() | {"draw": _plain(flight.draw)} for flight in flown])
    return 0 if all(flight.converged for flight in needed) else 1


def _plain(draw: MarginDraw) -> dict[str, object]:
    return draw._asdict() | {"manoeuvre": draw.manoeuvre.value}
