"""Check of an airframe: does it hover, does it turn over, and does it fly, on paper and then on its instruments.

Numbers come first, from the design model: thrust, authority about each axis, trims over the wind and in forward flight.
Then the whole vehicle flies on sensors: a hold in wind, a leg with both transitions, a landing. A row that misses its
limit says in words what is too small. Where a number misses it, the airframe itself is too weak, not its laws.

The wind of the flights goes with the square root of the wing loading: what leans by 20 deg in 3 m/s with 7 kg/m2 leans
by 50 with 2.5, and no vehicle lands so.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from protocol.dialect.vocabulary import LegMode
from sitl import Aircraft, Airframe, Configuration, DivergedError, Settings, Start, WorldSettings, load_airframe
from sitl.design import linearise
from sitl.design.gains import FORWARD_SPEEDS
from sitl.design.proved import is_proved
from sitl.design.scaling import scale_of
from sitl.design.trim import Trim, level_trim, trims
from sitl.lab.campaigns.case_flights import fly_shipped
from sitl.lab.studies.seeded_flights import SAMPLE_PERIODS, STUDY_WORLD, Craft, waypoint
from sitl.lab.studies.spec_studies import craft_changes
from sitl.model.propeller import hover_speed, thrust
from sitl.simulation.situation import regime
from sitl.vehicle.aircraft import is_forward

MIN_THRUST_SHARE = 1.3  # of the weight, all propellers at full speed
MIN_TURN_SHARE = 0.4  # angular acceleration in the hover, by g / b: a small vehicle has to be quicker
MAX_HOVER_WIND = 8.0  # in which trims are looked for [m/s]
MIN_HOVER_WIND = 2.0  # held at least, by sqrt(g b), the speed of vehicles of its size: 4.6 m/s of one of 0.54 m
MIN_ELEVON_MARGIN = math.radians(3.0)  # what control needs beyond a trim [rad]
CRUISE_SPEEDS = (12.0, 15.0, 18.0)  # [m/s]
CHECK_WIND, CHECK_GUSTS = 3.0, 0.5  # of the flights, at the shipped sets' wing loading [m/s]
MAX_OFF = 1.0  # of a hold, for 95 % of the time [m]
CHECK_LEG, LEG_HEIGHT_ABOVE = 300.0, 40.0  # of the leg that is flown forward [m]
CHECK_LEG_TIME, MIN_LEG_HEIGHT = 120.0, 15.0  # [s], [m]
TURN_AXES = ("roll", "pitch", "yaw")


class CheckRow(NamedTuple):
    """One line of the check."""

    name: str
    value: str
    limit: str
    passed: bool
    remedy: str = ""  # in words, where it is missed
    flown: bool = False  # by the laws; else a number of the airframe itself


def check_airframe(name: str, seed: int = 1, *, fly: bool = True) -> list[CheckRow]:
    """All rows of an airframe.

    Args:
        name: Parameter set or TOML file.
        seed: Of the flights.
        fly: Whether to fly it, too.
    """
    a = load_airframe(name).parameters
    rows = [*_numbers(a)]
    if fly:
        rows += [row._replace(flown=True) for row in _flights(Craft(airframe=name), seed)]
    return rows


def incapable(rows: Sequence[CheckRow]) -> str:
    """The airframe's own numbers that miss their limits, in words; empty if none."""
    return "; ".join(f"{row.name} {row.value}, must be {row.limit}" for row in rows if not (row.passed or row.flown))


def _numbers(a: Airframe) -> Iterator[CheckRow]:
    yield _thrust(a)
    yield _hover_speed(a)
    yield from _authority(a)
    yield from _trims(a)
    proof = "yes" if is_proved(a) else "no: sampled thresholds (scripts/prove_hover.py)"
    yield CheckRow("region of the hover proved", proof, "-", True)


def _thrust(a: Airframe) -> CheckRow:
    share = 2.0 * thrust(a.omega_max, 0.0, a) * (1.0 - a.S_ratio * a.C_d0) / (a.m * a.g)
    remedy = f"thrust at omega_max is too small for {a.m:g} kg: a greater k_f or omega_max, or less mass"
    return _at_least("thrust to weight", share, MIN_THRUST_SHARE, "", remedy)


def _hover_speed(a: Airframe) -> CheckRow:
    speed = hover_speed(a)
    inside = a.omega_min < speed < a.omega_max
    limits = f"{a.omega_min:.0f} to {a.omega_max:.0f} rad/s"
    return CheckRow(
        "propellers in the hover", f"{speed:.0f} rad/s", limits, inside, "the weight asks for another speed"
    )


def _authority(a: Airframe) -> Iterator[CheckRow]:
    """Angular accelerations in the hover by full deflections, and by a fifth of the hover's thrust moved across."""
    _, B = linearise.hover(a)
    T = thrust(hover_speed(a), 0.0, a)
    across, apart, together = (
        np.array((0.2, -0.2, 0.0, 0.0)),
        np.array((0.0, 0.0, 1.0, -1.0)),
        np.array((0, 0, 1.0, 1.0)),
    )
    moves = (apart * a.delta_max * T, together * a.delta_max * T, across * T)
    causes = ("elevons apart (xi_f, a_y, J1)", "elevons together (xi_f, xi_m, Delta_r, J2)", "motors apart (p_y, J3)")
    for axis, name, move, cause in zip(range(3), TURN_AXES, moves, causes, strict=True):
        turn = float(abs((B[9:12] @ move)[axis]))
        limit = MIN_TURN_SHARE * a.g / a.b
        yield _at_least(f"{name} in the hover", turn, limit, "rad/s2", f"too small for its inertia: {cause}")


def _trims(a: Airframe) -> Iterator[CheckRow]:
    winds = [0.5 * step for step in range(round(2.0 * MAX_HOVER_WIND) + 1)]
    held = 0.0
    for wind, trim in zip(winds, trims(a, np.array(winds)), strict=True):
        if not _is_held(trim):
            break
        held = wind
    remedy = f"no trim in more: {_shortage(trims(a, min(held + 0.5, MAX_HOVER_WIND))[0], a)}"
    yield _at_least("hover held in wind to", held, MIN_HOVER_WIND * math.sqrt(a.g * a.b), "m/s", remedy)
    flown = trims(a, np.array(CRUISE_SPEEDS))
    margin = max(math.degrees(trim.margin) if trim.exists else -math.inf for trim in flown)
    remedy = f"no trim at {', '.join(f'{speed:g}' for speed in CRUISE_SPEEDS)} m/s: {_shortage(flown[1], a)}"
    yield _at_least("elevons left in cruise", margin, math.degrees(MIN_ELEVON_MARGIN), "deg", remedy)
    gaps = [trim for trim in map(partial(level_trim, a), FORWARD_SPEEDS) if not trim.exists]
    widest = min(gaps, key=lambda trim: trim.margin, default=None)
    remedy = f"no level flight at {widest.speed:g} m/s: {_shortage(widest, a)}" if widest else ""
    yield CheckRow("both transitions", "no" if gaps else "yes", "trims at 0 to 15 m/s", not gaps, remedy)


def _is_held(trim: Trim) -> bool:
    return trim.exists and trim.margin >= MIN_ELEVON_MARGIN


def _shortage(trim: Trim, a: Airframe) -> str:
    """Limit that a trim misses, in words."""
    if math.isinf(trim.delta):
        return "no angle of the elevons balances it (xi_f, xi_m, Delta_r)"
    if trim.margin < MIN_ELEVON_MARGIN:
        needed, most = abs(math.degrees(trim.delta)), math.degrees(a.delta_max)
        return f"elevons need {needed:.1f} of {most:.1f} deg (xi_f, xi_m, Delta_r)"
    if trim.omega <= a.omega_min:
        return "the motors turn too fast at their slowest (omega_min)"
    return "the motors are too slow (omega_max, k_f)"


def _flights(craft: Craft, seed: int) -> Iterator[CheckRow]:
    """The whole vehicle on sensors, each flight ended by what it does and never by an exception."""
    yield _hold(craft, seed)
    yield _guarded("forward leg and back", "arrives", lambda: _leg(craft, seed))
    yield _landing(craft, seed)


def _hold(craft: Craft, seed: int) -> CheckRow:
    wind, gusts = _air(craft)
    air = {"vary.wind.grid": [wind], "parameters.SIM_GUST_RMS": gusts, "run.seed": seed}
    flown = fly_shipped("holds", {**craft_changes(craft), **air})
    name = f"hold in {wind:.2g} m/s, off"
    if flown.error:
        return CheckRow(name, flown.error, f"<= {MAX_OFF:g} m", False, "it does not hold a point")
    remedy = "it wanders: authority in the hover, or vibration against its instruments"
    across = flown.measures["across"]
    return CheckRow(name, f"{across:.2f} m", f"<= {MAX_OFF:g} m", across <= MAX_OFF, remedy)


def _air(craft: Craft) -> tuple[float, float]:
    """Wind and gusts of the flights [m/s]."""
    speed = scale_of(craft.model).speed
    return CHECK_WIND * speed, CHECK_GUSTS * speed


def _guarded(name: str, limit: str, row: Callable[[], CheckRow]) -> CheckRow:
    """A row that is missed if its flight ends where the model cannot compute on."""
    try:
        return row()
    except DivergedError as error:
        return CheckRow(name, str(error).split(":")[0], limit, False, "the flight left what the model can compute")


def _leg(craft: Craft, seed: int) -> CheckRow:
    """A leg flown forward, to a stop at its end."""
    vehicle = craft.fly(seed, Start(up=LEG_HEIGHT_ABOVE, airborne=True))
    settings = Settings(leg_mode=int(LegMode.FORWARD))
    wind, gusts = _air(craft)
    world = WorldSettings(wind, 90.0, gusts, battery=1e9)
    aircraft = Aircraft(vehicle, STUDY_WORLD, Configuration(settings, vehicle.tuning, world), airborne=True)
    aircraft.autopilot.missions.load([waypoint(CHECK_LEG, 0.0, LEG_HEIGHT_ABOVE)])
    aircraft.autopilot.missions.start()
    flew_forward, lowest, arrived = False, LEG_HEIGHT_ABOVE, False
    began = vehicle.time
    while not arrived and vehicle.crash is None and vehicle.time - began < CHECK_LEG_TIME:
        aircraft.advance(SAMPLE_PERIODS)
        flew_forward |= is_forward(vehicle)
        lowest = min(lowest, vehicle.truth.body.position.z)
        mission = aircraft.autopilot.mission
        arrived = mission is not None and mission.finished
    passed = arrived and flew_forward and lowest >= MIN_LEG_HEIGHT
    done = f"{'forward' if flew_forward else 'hovered'}, {'arrived' if arrived else f'{regime(vehicle)}'}"
    value = f"{done} in {vehicle.time - began:.0f} s, {lowest:.0f} m at lowest"
    remedy = "a transition fails: trims, thrust to weight, or authority above"
    return CheckRow(
        "forward leg and back", value, f"arrives, >= {MIN_LEG_HEIGHT:g} m of {LEG_HEIGHT_ABOVE:g}", passed, remedy
    )


def _landing(craft: Craft, seed: int) -> CheckRow:
    wind, gusts = _air(craft)
    air = {"vary.wind.uniform": [0.0, wind], "parameters.SIM_GUST_RMS": gusts, "run.seed": seed}
    flown = fly_shipped("landings", {**craft_changes(craft), **air})
    upright = flown.measures["upright"] > 0.0
    value = flown.error or f"{'upright' if upright else 'not upright'}, touched at {flown.measures['sink']:.1f} m/s"
    remedy = "feet (foot_x, foot_y, foot_z) or max_contact_speed"
    return CheckRow("landing", value, "upright", upright, remedy)


def _at_least(name: str, value: float, limit: float, unit: str, remedy: str) -> CheckRow:
    known = "none" if math.isinf(value) else f"{value:.2f} {unit}".strip()
    return CheckRow(name, known, f">= {limit:.3g} {unit}".strip(), value >= limit, remedy)


def summary(name: str, rows: list[CheckRow]) -> list[str]:
    """The rows as a table, and in words what is too small."""
    width = max(len(row.value) for row in rows) + 2
    lines = [name, ""]
    lines += [f"{'ok' if row.passed else 'NO':<4}{row.name:<28}{row.value:<{width}}{row.limit}" for row in rows]
    missed = [row for row in rows if not row.passed]
    lines += ["", *(f"{row.name} is {row.value}, must be {row.limit}: {row.remedy}" for row in missed)]
    weak = incapable(rows)
    lines += [f"the airframe itself is too weak for these tests, not its laws: {weak}"] if weak else []
    lines.append(f"{len(rows) - len(missed)} of {len(rows)} passed")
    return lines


def run_check(args: argparse.Namespace) -> int:
    """Check the airframe that is named; 1 if a row misses its limit."""
    rows = check_airframe(args.file, args.seed)
    print("\n".join(summary(args.file, rows)))
    return 0 if all(row.passed for row in rows) else 1
