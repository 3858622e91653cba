"""Hover or fly: legs flown both ways, the distance from which forward flight costs less, and prediction errors."""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from protocol.dialect.vocabulary import DecisionReason, LegMode
from protocol.plans.plan import MissionItem
from protocol.ranges import MAX_AIRSPEED, MIN_AIRSPEED
from sitl import (
    PERIOD,
    Aircraft,
    Array,
    Configuration,
    DivergedError,
    Law,
    Settings,
    Simulation,
    SitlError,
    Start,
    Tuning,
    WorldSettings,
    load_airframe,
)
from sitl.defaults import GENTLE, STUDY_AIRFRAME
from sitl.design.gains import can_fly_forward
from sitl.lab.studies.seeded_flights import SAMPLE_PERIODS, STUDY_WORLD, has_finished_mission, waypoint
from sitl.prediction.corners import Leg
from sitl.prediction.mode_choice import Decision, forbidden
from sitl.prediction.point_mass import Prediction
from sitl.prediction.predictor import Abilities, predict_forward, predict_hover
from sitl.supervisor.guards import MIN_TRANSITION_LEG
from sitl.tools.plotting import blank_page, check_plot_path, save_page
from sitl.vehicle.aircraft import is_forward

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.contour import QuadContourSet


# Legs flown from hover to hover by the whole vehicle under its own autopilot, and errors of their predictions.
#
# A leg has ended when the vehicle hovers within the acceptance radius of its end.

LEG_HEIGHT = 45.0  # of the beginning of a leg [m]
HOVER_TIME = 8.0  # hovered in the wind before a leg [s]
MAX_LEG_TIME = 240.0  # [s]
MAX_JOURNEY_TIME = 900.0  # of a mission [s]
MIN_DISTANCE, MAX_DISTANCE = MIN_TRANSITION_LEG + 0.1, 300.0  # of a leg; shorter ones have no front transition [m]
AIRSPEED_RANGE = (MIN_AIRSPEED, MAX_AIRSPEED)  # of a cruise [m/s]


class FlownLeg(NamedTuple):
    """One leg as it was flown, and as the vehicle predicted it when it began."""

    leg: Leg
    leg_mode: LegMode
    time: float  # until it hovers at the end [s]; infinite if it never does
    energy: float  # until then, at the shafts [J]; infinite if it never does
    predicted: Prediction  # from the vehicle's own estimate of the wind
    flew_forward: bool  # at any time
    sunk: float  # below its lower end at most [m]
    risen: float  # above its higher end at most [m]


class FlownMission(NamedTuple):
    """A mission as it was flown."""

    complete: bool
    time: float  # [s]
    energy: float  # at the shafts [J]
    decisions: list[tuple[int, Decision]]  # leg by leg, with the mission item the leg ends at
    energy_by_law: dict[Law, float]  # [J]


class ErrorSizes(NamedTuple):
    """Relative errors of many predictions."""

    median: float  # of the absolute value
    p90: float  # 90th percentile of the absolute value
    mean: float  # signed


class PredictionError(NamedTuple):
    """Relative errors of the predictions of many legs."""

    legs: int
    lost: int  # flown legs that never arrived, left out
    time: ErrorSizes
    energy: ErrorSizes


def abilities(airframe: str = STUDY_AIRFRAME, airspeed: float = 15.0, pace: int = GENTLE) -> Abilities:
    """Abilities of a vehicle with default parameters.

    Args:
        airframe: Parameter set.
        airspeed: Of the cruise [m/s].
        pace: Of INDI.

    Raises:
        SitlError: If the parameter set is unknown or cannot fly forward, or the airspeed is out of range.
    """
    parameters = load_airframe(airframe).parameters
    if not can_fly_forward(parameters):
        raise SitlError(f"airframe {airframe} has no trim between hover and cruise: every leg is hovered")
    slowest, fastest = AIRSPEED_RANGE
    if not slowest <= airspeed <= fastest:
        raise SitlError(f"airspeed {airspeed:g} m/s is not within {slowest:g} and {fastest:g}")
    return Abilities(parameters, Tuning(pace=pace), True, Settings().hover_speed, airspeed)


def fly_leg(
    leg: Leg, leg_mode: LegMode, airspeed: float = 15.0, airframe: str = STUDY_AIRFRAME, pace: int = GENTLE
) -> FlownLeg:
    """Fly one leg from hover to hover with the whole vehicle, autopilot included.

    Args:
        leg: To fly.
        leg_mode: In the hover, or forward wherever the supervisor makes the transition.
        airspeed: Of the cruise in forward flight [m/s].
        airframe: Parameter set.
        pace: Of INDI.

    Raises:
        SitlError: If the parameter set is unknown or the leg ends below the ground.
    """
    if LEG_HEIGHT + leg.climb < 1.0:
        raise SitlError(f"a climb of {leg.climb:g} m from {LEG_HEIGHT:g} m ends below the ground")
    settings = Settings(leg_mode=int(leg_mode), airspeed=airspeed, min_leg=0.0)
    aircraft = _hovering(leg, settings, airframe, Tuning(pace=pace))
    vehicle, autopilot = aircraft.vehicle, aircraft.autopilot
    autopilot.missions.load([waypoint(leg.distance, 0.0, LEG_HEIGHT + leg.climb)])
    autopilot.missions.start()
    time, energy = vehicle.time, vehicle.energy
    heights, flew_forward, arrived = [LEG_HEIGHT], False, False
    try:
        while not arrived and vehicle.time - time < MAX_LEG_TIME:
            aircraft.advance(SAMPLE_PERIODS)
            flew_forward |= is_forward(vehicle)
            heights.append(vehicle.truth.body.position.z)
            arrived = has_finished_mission(aircraft)
    except DivergedError:
        arrived = False
    decision = autopilot.decisions()[0][1]
    return FlownLeg(
        leg=leg,
        leg_mode=leg_mode,
        time=vehicle.time - time if arrived else math.inf,
        energy=vehicle.energy - energy if arrived else math.inf,
        predicted=decision.hover if leg_mode is LegMode.HOVER else decision.forward,
        flew_forward=flew_forward,
        sunk=LEG_HEIGHT + min(leg.climb, 0.0) - min(heights),
        risen=max(heights) - LEG_HEIGHT - max(leg.climb, 0.0),
    )


def _hovering(leg: Leg, settings: Settings, airframe: str, tuning: Tuning) -> Aircraft:
    """An aircraft that hovers in the wind where a leg to the north begins, turned away from it."""
    start = Start(up=LEG_HEIGHT, airborne=True, heading=-leg.turn)
    vehicle = Simulation(load_airframe(airframe).parameters, start=start, tuning=tuning)
    speed = math.hypot(leg.tail_wind, leg.cross_wind)
    azimuth = math.degrees(math.atan2(leg.cross_wind, -leg.tail_wind))
    configuration = Configuration(settings, vehicle.tuning, WorldSettings(speed, azimuth, battery=1e9))
    aircraft = Aircraft(vehicle, STUDY_WORLD, configuration, airborne=True)
    aircraft.advance(round(HOVER_TIME / PERIOD))
    return aircraft


def fly_mission(
    items: Sequence[MissionItem], leg_mode: LegMode, min_leg: float = 25.0, airframe: str = STUDY_AIRFRAME
) -> FlownMission:
    """Fly a mission from the ground to the ground, in calm.

    Args:
        items: The mission.
        leg_mode: NONE leaves every leg to the decision; the others ask for one way wherever it is possible.
        min_leg: DRK_FWD_LEG, shorter legs are hovered [m].
        airframe: Parameter set.
    """
    vehicle = Simulation(load_airframe(airframe).parameters)
    settings = Settings(leg_mode=int(leg_mode), min_leg=min_leg)
    aircraft = Aircraft(vehicle, STUDY_WORLD, Configuration(settings, vehicle.tuning, WorldSettings(battery=1e9)))
    autopilot = aircraft.autopilot
    autopilot.missions.load(items)
    autopilot.arming.arm(force=True)
    autopilot.missions.start()
    decisions: list[tuple[int, Decision]] = []
    while not (autopilot.mission is None or autopilot.mission.finished) and vehicle.time < MAX_JOURNEY_TIME:
        aircraft.advance(SAMPLE_PERIODS)
        decisions += autopilot.decisions()
    return FlownMission(
        complete=has_finished_mission(aircraft),
        time=vehicle.time,
        energy=vehicle.energy,
        decisions=decisions,
        energy_by_law=dict(vehicle.energy_by_law),
    )


def draw(legs: int, able: Abilities, seed: int = 1, *, forward: bool) -> list[tuple[Leg, float]]:
    """Random legs of all kinds, each with an airspeed.

    Distances of 10 to 300 m, climbs of -30 to 30 m, winds of up to 4 m/s along and across, airspeeds of 10 to 18 m/s;
    a third is in calm, half is level, and a third begins turned away.

    Args:
        legs: How many.
        able: What the vehicle can do.
        seed: Of the draw.
        forward: Whether to draw only legs that may be flown forward.
    """
    random = np.random.default_rng(seed)
    drawn: list[tuple[Leg, float]] = []
    while len(drawn) < legs:
        tail, cross = random.uniform(-4.0, 4.0, 2) * (random.random() > 1.0 / 3.0)
        climb = random.uniform(-30.0, 30.0) * (random.random() > 0.5)
        turn = random.uniform(-math.pi, math.pi) * (random.random() < 1.0 / 3.0)
        distance = math.exp(random.uniform(math.log(10.0), math.log(MAX_DISTANCE)))
        leg = Leg(distance, float(climb), float(tail), float(cross), float(turn), LEG_HEIGHT + min(float(climb), 0.0))
        airspeed = float(random.uniform(10.0, 18.0))
        if not forward or why_not_forward(leg, able) is DecisionReason.NONE:
            drawn.append((leg, airspeed))
    return drawn


def fly_all(
    legs: Sequence[tuple[Leg, float]], leg_mode: LegMode, airframe: str = STUDY_AIRFRAME, pace: int = GENTLE
) -> list[FlownLeg]:
    """Fly legs, each at its airspeed, all of them one way."""
    return [fly_leg(leg, leg_mode, airspeed, airframe, pace) for leg, airspeed in legs]


def prediction_error(flights: Sequence[FlownLeg]) -> PredictionError:
    """Errors of the predictions of flown legs; those that never arrived are only counted.

    Raises:
        SitlError: If no leg arrived.
    """
    arrived = [one for one in flights if math.isfinite(one.energy) and math.isfinite(one.predicted.energy)]
    if not arrived:
        raise SitlError("no leg arrived")
    time = np.array([one.predicted.time / one.time - 1.0 for one in arrived])
    energy = np.array([one.predicted.energy / one.energy - 1.0 for one in arrived])
    return PredictionError(len(arrived), len(flights) - len(arrived), _sizes(time), _sizes(energy))


def _sizes(relative: Array) -> ErrorSizes:
    size = np.abs(relative)
    return ErrorSizes(float(np.median(size)), float(np.quantile(size, 0.9)), float(relative.mean()))


def why_not_forward(leg: Leg, able: Abilities) -> DecisionReason:
    """The reason why a leg cannot be flown forward whatever it costs, or NONE; DRK_FWD_LEG does not count."""
    why = forbidden(leg, able)
    return DecisionReason.TOO_SHORT if why is DecisionReason.NONE and leg.distance < MIN_DISTANCE else why


# Hover or fly: the break-even distance, predicted and flown.
#
# It is the distance at which a leg costs the same energy in the hover and in forward flight: shorter legs are hovered,
# longer ones flown. It is predicted by :mod:`sitl.prediction.predictor`, and flown by
# :mod:`sitl.lab.studies.break_even.break_even_flights`.


TRIED_DISTANCES = np.geomspace(MIN_DISTANCE, MAX_DISTANCE, 24)
FINE_DISTANCES = np.geomspace(MIN_DISTANCE, MAX_DISTANCE, 400)
LEG_CLIMBS = (-30.0, -10.0, 0.0, 10.0, 30.0)
LEG_WINDS = (-4.0, -3.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0, 4.0)
LEG_TURNS = (0.0, 0.5 * math.pi)  # from the heading before a leg to the leg's [rad]
DISTANCE_TOLERANCE = 0.25  # of a break-even distance [m]


class BreakEven(NamedTuple):
    """The break-even distance of legs of one kind."""

    climb: float  # [m]
    tail_wind: float  # [m/s]
    cross_wind: float  # [m/s]
    turn: float  # at their beginning [rad]
    distance: float  # from which on forward flight costs less [m]; infinite: not within 300 m
    barred: DecisionReason  # why shorter legs cannot be flown forward, if that sets the distance; else NONE


Saving = Callable[[float], float]  # energy of the hover less that of forward flight, over the distance [J]


def predicted(able: Abilities, climb: float, tail: float = 0.0, cross: float = 0.0, turn: float = 0.0) -> BreakEven:
    """The break-even distance by the prediction that the vehicle itself decides with.

    Args:
        able: What the vehicle can do.
        climb: Altitude gained on every leg [m].
        tail: Wind along the legs [m/s].
        cross: Wind across them [m/s].
        turn: From the heading before the leg to the leg's [rad].
    """

    def saving(distance: float) -> float:
        leg = Leg(distance, climb, tail, cross, turn)
        return predict_hover(leg, able).energy - predict_forward(leg, able).energy

    sought = BreakEven(climb, tail, cross, turn, math.inf, DecisionReason.ENERGY)
    return _search(saving, able, sought, TRIED_DISTANCES)


def flown(
    able: Abilities, airframe: str, climb: float, tail: float = 0.0, cross: float = 0.0, turn: float = 0.0
) -> BreakEven:
    """The break-even distance in flight, searched near the predicted one; arguments as for :func:`predicted`."""

    def saving(distance: float) -> float:
        leg = Leg(distance, climb, tail, cross, turn)
        hover, forward = (
            fly_leg(leg, leg_mode, able.airspeed, airframe, able.tuning.pace).energy
            for leg_mode in (LegMode.HOVER, LegMode.FORWARD)
        )
        return hover - forward

    expected = predicted(able, climb, tail, cross, turn)
    about = 40.0 if math.isinf(expected.distance) else expected.distance
    return _search(saving, able, expected._replace(distance=math.inf), about * np.array((0.6, 0.8, 1.0, 1.25, 1.6)))


def _search(saving: Saving, able: Abilities, sought: BreakEven, distances: Array) -> BreakEven:
    """The last change from loss to gain among the distances that may be flown, refined by bisection.

    By bisection, because a flight that never arrives costs infinite energy: methods that interpolate cannot use that.
    """
    allowed = [
        float(d) for d in FINE_DISTANCES if why_not_forward(Leg(float(d), sought.climb), able) is DecisionReason.NONE
    ]
    if not allowed:
        return sought._replace(distance=math.inf, barred=DecisionReason.TOO_STEEP)
    shortest = allowed[0]
    tried = sorted({shortest, *(float(d) for d in distances if d > shortest)})
    gains = [saving(d) > 0.0 for d in tried]
    if not gains[-1]:
        return sought._replace(distance=math.inf, barred=DecisionReason.ENERGY)
    losses = [i for i, gain in enumerate(gains) if not gain]
    if not losses:
        reason = why_not_forward(Leg(0.98 * shortest, sought.climb), able)
        return sought._replace(distance=shortest, barred=reason)
    low, high = tried[losses[-1]], tried[losses[-1] + 1]
    while high - low > DISTANCE_TOLERANCE:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if saving(middle) > 0.0 else (middle, high)
    return sought._replace(distance=0.5 * (low + high), barred=DecisionReason.NONE)


def table(able: Abilities) -> list[BreakEven]:
    """Predicted break-evens for every climb and tail wind, for legs straight ahead and after a quarter turn."""
    return [predicted(able, climb, tail, turn=turn) for turn in LEG_TURNS for tail in LEG_WINDS for climb in LEG_CLIMBS]


# A page of hover or fly: what forward flight saves over distance and wind, and where it breaks even.


PLOTTED_CLIMBS = (-10.0, 0.0, 10.0)
PLOTTED_DISTANCES = np.geomspace(10.0, MAX_DISTANCE, 24)
PLOTTED_WINDS = np.linspace(-4.0, 4.0, 13)
SAVING_LEVELS = np.linspace(-100.0, 100.0, 21)  # [%]


def saving(able: Abilities, climb: float, turn: float) -> Array:
    """Share of the hover's energy that forward flight saves, winds by distances [%]; NaN where it is barred."""
    saved = np.full((len(PLOTTED_WINDS), len(PLOTTED_DISTANCES)), np.nan)
    for row, wind in enumerate(PLOTTED_WINDS):
        for column, distance in enumerate(PLOTTED_DISTANCES):
            leg = Leg(float(distance), climb, float(wind), turn=turn)
            if why_not_forward(leg, able) is DecisionReason.NONE:
                hover, forward = predict_hover(leg, able), predict_forward(leg, able)
                saved[row, column] = 100.0 * (1.0 - forward.energy / hover.energy)
    return np.asarray(np.clip(saved, SAVING_LEVELS[0], SAVING_LEVELS[-1]))


def save_plot(able: Abilities, cells: Sequence[BreakEven], tried: Sequence[BreakEven], path: Path) -> None:
    """Draw a panel per climb and turn.

    Args:
        able: What the vehicle can do.
        cells: Break-even distances predicted.
        tried: Break-even distances flown.
        path: Of the plot: .png, .svg or .pdf.

    Raises:
        SitlError: If matplotlib is missing or the file cannot be written.
    """
    check_plot_path(path)
    page = blank_page(11.0, 6.6)
    page.suptitle(f"Energy forward flight at {able.airspeed:g} m/s saves against hovering at {able.hover_speed:g} m/s")
    panels = page.subplots(len(LEG_TURNS), len(PLOTTED_CLIMBS), sharex=True, sharey=True)
    for row, turn in enumerate(LEG_TURNS):
        for column, climb in enumerate(PLOTTED_CLIMBS):
            axis = panels[row, column]
            drawn = _panel(axis, saving(able, climb, turn))
            axis.set_title(f"climb {climb:+g} m, turned by {math.degrees(turn):.0f} deg", fontsize=9)
            _points(axis, [c for c in cells if (c.climb, c.turn) == (climb, turn)], "k.", "predicted")
            _points(axis, [c for c in tried if (c.climb, c.turn) == (climb, turn)], "r*", "flown")
    for axis in panels[-1]:
        axis.set_xlabel("distance [m]")
    for axis in panels[:, 0]:
        axis.set_ylabel("tail wind [m/s]")
    panels[0, 0].legend(loc="lower right", fontsize=8)
    page.colorbar(drawn, ax=panels, label="saved [%]; grey: barred", shrink=0.8)
    save_page(page, path, dpi=90)


def _panel(axis: Axes, saved: Array) -> QuadContourSet:
    axis.set_facecolor("lightgrey")
    drawn = axis.contourf(PLOTTED_DISTANCES, PLOTTED_WINDS, saved, SAVING_LEVELS, cmap="RdBu")
    axis.set_xscale("log")
    axis.axvline(MIN_DISTANCE, color="grey", linewidth=0.8, linestyle=":")
    axis.set_xticks([10, 20, 50, 100, 200], ["10", "20", "50", "100", "200"])
    return drawn


def _points(axis: Axes, cells: Sequence[BreakEven], marks: str, label: str) -> None:
    found = [cell for cell in cells if math.isfinite(cell.distance)]
    axis.plot([c.distance for c in found], [c.tail_wind for c in found], marks, label=label)


CHECKED_LEGS = {"forward": 150, "hover": 75}  # legs flown to check the prediction of each way
WIND_CLASSES = (("calm", 0.0, 1e-9), ("wind below 3 m/s", 1e-9, 3.0), ("wind of 3 to 5.7 m/s", 3.0, math.inf))


def study_breakeven(args: argparse.Namespace) -> int:
    """Predict, fly if asked, print the tables and draw the plot."""
    if args.plot is not None:
        check_plot_path(args.plot)

    able = abilities(args.airframe, args.airspeed, args.pace)
    cells = table(able)
    found, errors = _fly(args) if args.fly else ([], {})
    if args.json:
        print(json.dumps(_data(cells, found, errors), indent=1))
    else:
        print("\n".join(_lines(cells, found, errors)))
    if args.plot is not None:
        save_plot(able, cells, found, args.plot)
        if not args.json:
            print(f"plot: {args.plot}")
    return 0


def _fly(args: argparse.Namespace) -> tuple[list[BreakEven], dict[str, PredictionError]]:
    able = abilities(args.airframe, args.airspeed, args.pace)
    found = [flown(able, args.airframe, climb, turn=turn) for turn in LEG_TURNS for climb in (0.0, 10.0, -10.0)]
    errors = {}
    for name, way in (("hover", LegMode.HOVER), ("forward", LegMode.FORWARD)):
        flights = fly_all(draw(CHECKED_LEGS[name], able, forward=way is LegMode.FORWARD), way, args.airframe, args.pace)
        for wind, low, high in WIND_CLASSES:
            kind = [one for one in flights if low <= math.hypot(one.leg.tail_wind, one.leg.cross_wind) < high]
            errors[f"{name}, {wind}"] = prediction_error(kind)
    return found, errors


def _lines(
    cells: Sequence[BreakEven], found: Sequence[BreakEven], errors: Mapping[str, PredictionError]
) -> Iterator[str]:
    yield "Distance from which forward flight costs less than the hover [m], predicted"
    yield "(t: shorter legs are too short for the supervisor, s: shorter legs are too steep; -: not within 300 m)"
    climbs = sorted({cell.climb for cell in cells})
    for turn in sorted({cell.turn for cell in cells}):
        yield f"\nturned by {math.degrees(turn):.0f} deg at the start; columns: climb, rows: wind along the leg"
        yield f"{'':>9}" + "".join(f"{climb:+8.0f} m" for climb in climbs)
        for wind in sorted({cell.tail_wind for cell in cells}):
            row = {c.climb: c for c in cells if (c.turn, c.tail_wind) == (turn, wind)}
            yield f"{wind:+5.0f} m/s" + "".join(f"{_distance(row[climb]):>10}" for climb in climbs)
    if found:
        yield "\nin calm                     predicted     flown"
    for cell in found:
        known = next(c for c in cells if c[:4] == cell[:4])
        legs = f"climb {cell.climb:+.0f} m, turned {math.degrees(cell.turn):.0f} deg"
        yield f"{legs:<26}{_distance(known):>11}{_distance(cell):>10}"
    if errors:
        yield f"\nerror of the prediction{'':10}{'legs':>5}{'lost':>5}   median / 90 % / mean"
    for name, e in errors.items():
        yield f"{name:<33}{e.legs:>5}{e.lost:>5}   time {error_words(e.time)}, energy {error_words(e.energy)}"


def _distance(cell: BreakEven) -> str:
    mark = {DecisionReason.TOO_SHORT: " t", DecisionReason.TOO_STEEP: " s"}.get(cell.barred, "  ")
    return f"{cell.distance:.1f}{mark}" if math.isfinite(cell.distance) else "-  "


def error_words(sizes: ErrorSizes) -> str:
    """Median, 90 % and mean, as text."""
    return f"{sizes.median:.1%} / {sizes.p90:.1%} / {sizes.mean:+.1%}"


def _data(
    cells: Sequence[BreakEven], found: Sequence[BreakEven], errors: Mapping[str, PredictionError]
) -> dict[str, object]:
    """All results; distances that were not found are null."""
    return {
        "ok": True,
        "predicted": [_cell(cell) for cell in cells],
        "flown": [_cell(cell) for cell in found],
        "errors": {name: error._asdict() for name, error in errors.items()},
    }


def _cell(cell: BreakEven) -> dict[str, object]:
    distance = cell.distance if math.isfinite(cell.distance) else None
    return cell._asdict() | {"distance": distance, "barred": cell.barred.name}
