"""Saturated against first-order actuators, and the search for the limit cycle (report, 2.1.2 and Perspectives).

The report takes rate limits for the actuators, says that they act as a first-order lag would, with subtleties that
depend on the frequency, and hopes that the comparison brings out the limit cycle seen in the flight arena.
"""

from __future__ import annotations

import math
from dataclasses import replace
from enum import StrEnum
from typing import NamedTuple

import numpy as np

from sitl.airframe import load
from sitl.control.governor import LINEAR
from sitl.model.airframe import Airframe
from sitl.simulation.simulation import Start
from sitl.studies.report import SCENARIOS, error, settling_time
from sitl.studies.reproduction.actuator_response import response, response_panel
from sitl.studies.reproduction.draw import Sheet, thin
from sitl.studies.reproduction.experiment import Experiment, Outcome, Panel, Row, judge
from sitl.studies.scenario import RATE, Ask, Figure, Track, fly

FAST = 1e7  # a rate that is no limit
BANDWIDTHS = (10.0, 12.0, 14.0, 16.0, 18.0, 20.0, 25.0, 30.0)  # lambda [rad/s]
STEPS = (0.3, 1.0, 2.0, 3.0, 5.0)  # of the target, on every axis [m]
WATCHED = 10.0  # a flight's last seconds decide [s]
STILL = math.radians(1.0)  # an elevon that moves less is no oscillation


class Ending(StrEnum):
    """How a flight ends."""

    SETTLED = "settled"
    CYCLE = "limit cycle"
    LOST = "lost"


class Oscillation(NamedTuple):
    """What an elevon does in a flight's last seconds."""

    ending: Ending
    amplitude: float  # half of peak to peak [rad]
    frequency: float  # of the strongest line of the spectrum [Hz]
    distance: float  # greatest distance to the target [m]


def models() -> dict[str, Airframe]:
    """The actuator models that are compared."""
    saturated = load("nominal").parameters
    return {
        "saturated": saturated,
        "first order": load("nominal-first-order").parameters,
        "only the motors' rate": saturated._replace(delta_rate=FAST),
        "only the elevons' rate": saturated._replace(omega_rate=FAST),
    }


def step_flight(a: Airframe, lam: float, step: float, seed: int) -> Track:
    """The zero-moment law alone, from the hover to a target ``step`` away on every axis [m]."""
    hover = SCENARIOS["hover"]
    scenario = replace(
        hover,
        start=Start(),
        asks=(Ask(0.0, target=(step, step, step)),),
        duration=2.0 * WATCHED,
        tuning=hover.tuning._replace(lam=lam, governor=LINEAR),
    )
    return fly(scenario, seed=seed, airframe=a, keep_diverged=True)


def oscillation(track: Track) -> Oscillation:
    """Tell a limit cycle: bounded, still there in both halves of the last seconds, and as large in either."""
    count = round(WATCHED * RATE)
    distance = float(error(track)[-count:].max())
    elevon = track.actuator[-count:, 2]
    if track.diverged or track.jumps or distance > 50.0:  # a jump is the failsafe's
        return Oscillation(Ending.LOST, math.nan, math.nan, distance)
    halves = [float(np.ptp(half)) for half in np.split(elevon[: 2 * (len(elevon) // 2)], 2)]
    spectrum = np.abs(np.fft.rfft(elevon - elevon.mean()))
    frequency = float(np.fft.rfftfreq(elevon.size, 1.0 / RATE)[spectrum.argmax()])
    sustained = min(halves) > STILL and halves[1] > 0.7 * halves[0]
    ending = Ending.CYCLE if sustained else Ending.SETTLED
    return Oscillation(ending, 0.5 * halves[1], frequency, distance)


def endings(a: Airframe, seed: int) -> list[list[Oscillation]]:
    """How the flights of all bandwidths (rows) and steps (columns) end."""
    return [[oscillation(step_flight(a, lam, step, seed)) for step in STEPS] for lam in BANDWIDTHS]


def run(seed: int) -> Outcome:
    """Frequency response, the hover flight under both models, and the map of limit cycles."""
    made = models()
    maps = {name: endings(a, seed) for name, a in made.items()}
    rows = [*_alike(made, seed), *_cycles(maps)]
    example = step_flight(made["saturated"], 18.0, 1.0, seed)
    return Outcome(
        rows, [response_panel(made), _maps(maps), _example(example, step_flight(made["first order"], 18.0, 1.0, seed))]
    )


def _alike(made: dict[str, Airframe], seed: int) -> list[Row]:
    hover = SCENARIOS["hover"]
    flights = [fly(hover, seed=seed, airframe=made[name]) for name in ("saturated", "first order")]
    settled = [settling_time(flight, 0.05) for flight in flights]
    rows = [
        judge(
            "2.1.2",
            Figure("[5, 5, 5] settles with first-order actuators", settled[1], "s", "as saturated",
                   abs(settled[1] - settled[0]) < 0.3),
            f"saturated: {settled[0]:.2f} s; lambda = 10 rad/s",
        )
    ]  # fmt: skip
    for amplitude, frequency in ((5.0, 6.0), (30.0, 2.0), (30.0, 6.0)):
        lags = [
            -math.degrees(response(made[name], 2, math.radians(amplitude), frequency)[1])
            for name in ("saturated", "first order")
        ]
        name = f"elevon lag, {amplitude:.0f} deg at {frequency:.0f} Hz, saturated less first order"
        figure = Figure(name, lags[0] - lags[1], "deg", "the same way", abs(lags[0] - lags[1]) < 15.0)
        cause = f"{lags[0]:.0f} against {lags[1]:.0f} deg"
        if not figure.holds:
            cause += ": a rate limit's lag depends on amplitude and frequency, a first order's on the frequency alone"
        rows.append(judge("2.1.2", figure, cause))
    return rows


def _cycles(maps: dict[str, list[list[Oscillation]]]) -> list[Row]:
    rows = []
    for name, table in maps.items():
        found = [(lam, step, o) for lam, line in zip(BANDWIDTHS, table, strict=True)
                 for step, o in zip(STEPS, line, strict=True) if o.ending is Ending.CYCLE]  # fmt: skip
        lowest = min((lam for lam, _, _ in found), default=math.nan)
        figure = Figure(f"limit cycle, {name}: from lambda", lowest, "rad/s", "observed", bool(found))
        rows.append(judge("Perspectives", figure, _where(found, table)))
    return rows


def _where(found: list[tuple[float, float, Oscillation]], table: list[list[Oscillation]]) -> str:
    flights = len(BANDWIDTHS) * len(STEPS)
    lost = sum(o.ending is Ending.LOST for line in table for o in line)
    if not found:
        return f"none among {flights} flights up to {BANDWIDTHS[-1]:.0f} rad/s and {STEPS[-1]:.0f} m ({lost} lost)"
    lam, step, first = found[0]
    return (
        f"{len(found)} of {flights} flights ({lost} lost); first after a step of {step:g} m at lambda = {lam:.0f}: "
        f"elevons +-{math.degrees(first.amplitude):.0f} deg at {first.frequency:.1f} Hz, {first.distance:.1f} m off"
    )


def _maps(maps: dict[str, list[list[Oscillation]]]) -> Panel:
    sheet = Sheet("motors-map", 2, columns=2, height=2.3)
    marks = {Ending.SETTLED: ("o", "#3fa66b"), Ending.CYCLE: ("s", "#e07b39"), Ending.LOST: ("x", "crimson")}
    with sheet as axes:
        for axis, (name, table) in zip(axes, maps.items(), strict=True):
            for ending, (mark, colour) in marks.items():
                points = [(lam, step) for lam, line in zip(BANDWIDTHS, table, strict=True)
                          for step, o in zip(STEPS, line, strict=True) if o.ending is ending]  # fmt: skip
                if points:
                    axis.semilogy(*np.array(points).T, mark, color=colour, markersize=5, label=str(ending))
            axis.set_title(name, fontsize=9)
            axis.set_yticks(STEPS, [f"{step:g}" for step in STEPS])
            axis.minorticks_off()
            axis.grid(alpha=0.2)
        for axis in (axes[0], axes[2]):
            axis.set_ylabel("step [m]")
        for axis in axes[2:]:
            axis.set_xlabel("lambda [rad/s]")
        axes[0].set_ylim(0.15, None)
        axes[0].legend(fontsize=7, loc="lower center", ncols=3)
    return Panel(
        "", "How a step of the target ends, by attitude bandwidth, size of the step and actuator model",
        "The analysis of the saturations could show the limit cycle observed in the flight arena.",
        "It does: the hover stays stable, and a large enough step throws the vehicle on a limit cycle. With the "
        "motors' rate limit alone there is none; it is the elevons' rate that makes it.", sheet.svg,
    )  # fmt: skip


def _example(cycling: Track, calm: Track) -> Panel:
    sheet = Sheet("motors-cycle", 2, height=1.9)
    with sheet as axes:
        for name, track in (("saturated", cycling), ("first order", calm)):
            axes[0].plot(*thin(track.time, np.degrees(track.actuator[:, 2])), label=name, linewidth=0.9)
            axes[1].plot(*thin(track.time, error(track)), label=name, linewidth=0.9)
        for axis, label in zip(axes, ("left elevon [deg]", "distance [m]"), strict=True):
            axis.set_ylabel(label)
            axis.grid(alpha=0.2)
        axes[0].legend()
        axes[1].set_xlabel("t [s]")
    seen = oscillation(cycling)
    return Panel(
        "", "The same step of 1 m at lambda = 18 rad/s under both actuator models",
        "A limit cycle was observed in the arena; its study was left for later.",
        f"Saturated: elevons from stop to stop at {seen.frequency:.1f} Hz, {seen.distance:.1f} m around the target, "
        "for ever. First order: settled. Whether the arena's cycle was this one cannot be told: "
        "its gains are not given.", sheet.svg,
    )  # fmt: skip


EXPERIMENT = Experiment(
    "motors",
    "Saturated against first-order actuators",
    "2.1.2, Perspectives",
    "The report models the actuators by rate limits, holds that a first order would act the same way, and leaves the "
    "limit cycle seen in earlier flight tests for later. Here both models fly the same steps of the target over a "
    "range of attitude bandwidths; a limit cycle is an oscillation that neither grows nor dies in the last 10 s.",
    run,
)
