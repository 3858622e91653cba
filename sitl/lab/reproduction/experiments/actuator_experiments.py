"""The actuators in flight: their limits and their lag."""

from __future__ import annotations

import math
from dataclasses import replace
from enum import StrEnum
from typing import NamedTuple

import numpy as np

from sitl import Actuators, Airframe, Start
from sitl.control.governor import LINEAR
from sitl.lab.reproduction.equations.actuator_response import response
from sitl.lab.reproduction.experiment import (
    REPORT_SET,
    Conditions,
    Experiment,
    ExperimentResult,
    Illustration,
    Panel,
    Statement,
    printed,
)
from sitl.lab.reproduction.flight_panels import SvgSheet, thin
from sitl.lab.scenarios import RATE, SCENARIOS, ScenarioEvent, Track, fly, position_error, settling_time
from sitl.model.actuators import limited, moved

# The limits of the actuators, as the compiled step of the plant obeys them (report, section 2.1.2).

TICK = 0.001  # [s]
HOVER_MOTOR_SPEED = 690.0  # of the motors at the start [rad/s]
BEYOND = Actuators(1e4, 1e4, math.radians(90.0), math.radians(90.0))
BELOW = Actuators(0.0, 0.0, -math.radians(90.0), -math.radians(90.0))
LIMITS_PLACE = "2.1.2"


def driven(start: Actuators, command: Actuators, duration: float, a: Airframe) -> Actuators:
    """The actuators after a time under a command, armed."""
    now, wanted = start, limited(command, True, a)
    for _ in range(round(duration / TICK)):
        now = moved(now, wanted, TICK, a)
    return now


def run_actuator_limits(conditions: Conditions) -> ExperimentResult:
    """Drive motors and elevons against their stops, and measure how fast they go."""
    a = conditions.airframe(REPORT_SET)
    start = Actuators(HOVER_MOTOR_SPEED, HOVER_MOTOR_SPEED, 0.0, 0.0)
    soon, high, low = driven(start, BEYOND, 0.01, a), driven(start, BEYOND, 2.0, a), driven(start, BELOW, 2.0, a)
    rate, acceleration = soon.left_elevon / 0.01, (soon.left_motor - HOVER_MOTOR_SPEED) / 0.01
    swing = math.radians(60.0) / rate
    return ExperimentResult(
        [
            Statement(LIMITS_PLACE, "a motor commanded beyond its range turns by", printed("1000"), high.left_motor,
                      "rad/s", is_input=True),
            Statement(LIMITS_PLACE, "a motor commanded below its range turns by", printed("200"), low.left_motor,
                      "rad/s", is_input=True),
            Statement(LIMITS_PLACE, "a motor accelerates at most by", printed("3000"), acceleration, "rad/s2",
                      is_input=True),
            Statement(LIMITS_PLACE, "an elevon stops at", printed("30"), math.degrees(high.left_elevon), "deg",
                      is_input=True),
            Statement(LIMITS_PLACE, "an elevon turns at most by", printed("5.24"), rate, "rad/s",
                      is_input=True, note="printed in rad/s2"),
            Statement(LIMITS_PLACE, "an elevon needs for 60 deg", printed("0.2"), swing, "s", is_input=True),
        ],
        [],
    )  # fmt: skip


ACTUATOR_LIMITS = Experiment(
    "limits",
    "Limits of the actuators",
    "2.1.2",
    "Motors and elevons are driven against their limits in the plant's own actuator model; what they do is measured.",
    run_actuator_limits,
)


# Saturated against first-order actuators, and the search for the limit cycle (report, 2.1.2 and Perspectives).
#
# The report models the actuators by rate limits, says that they act like a first-order lag, with subtleties that depend
# on the frequency, and hopes that the comparison shows the limit cycle seen in the flight arena.


NO_RATE_LIMIT = 1e7  # a rate that is never reached [rad/s or rad/s2]
BANDWIDTHS = (10.0, 12.0, 14.0, 16.0, 18.0, 20.0, 25.0, 30.0)  # lambda [rad/s]
TARGET_STEPS = (0.3, 1.0, 2.0, 3.0, 5.0)  # of the target, on every axis [m]
JUDGED_TIME = 10.0  # the last part of a flight, which decides [s]
MIN_SWING = math.radians(1.0)  # peak to peak; an elevon that moves less does not oscillate


class Ending(StrEnum):
    """End of a flight."""

    SETTLED = "settled"
    CYCLE = "limit cycle"
    LOST = "lost"


class Oscillation(NamedTuple):
    """The motion of the left elevon in the last seconds of a flight."""

    ending: Ending
    amplitude: float  # half of peak to peak [rad]
    frequency: float  # of the strongest line of the spectrum [Hz]
    distance: float  # greatest distance to the target [m]


def models(conditions: Conditions) -> dict[str, Airframe]:
    """The compared actuator models by name."""
    saturated = conditions.airframe("nominal")
    return {
        "saturated": saturated,
        "first order": conditions.airframe("nominal-first-order"),
        "only the motors' rate": saturated._replace(delta_rate=NO_RATE_LIMIT),
        "only the elevons' rate": saturated._replace(omega_rate=NO_RATE_LIMIT),
    }


def step_flight(a: Airframe, lam: float, step: float, seed: int) -> Track:
    """The zero-moment law alone, from the hover to a target ``step`` away on every axis [m]."""
    hover = SCENARIOS["hover"]
    scenario = replace(
        hover,
        start=Start(),
        events=(ScenarioEvent(0.0, target=(step, step, step)),),
        duration=2.0 * JUDGED_TIME,
        tuning=hover.tuning._replace(lam=lam, governor=LINEAR),
    )
    return fly(scenario, seed=seed, airframe=a, keep_diverged=True)


def oscillation(track: Track) -> Oscillation:
    """Classify the end of a flight: a limit cycle is bounded, and does not decay over the last seconds."""
    count = round(JUDGED_TIME * RATE)
    distance = float(position_error(track)[-count:].max())
    elevon = track.actuator[-count:, 2]
    if track.diverged or track.jumps or distance > 50.0:  # a jump is the failsafe's
        return Oscillation(Ending.LOST, math.nan, math.nan, distance)
    halves = [float(np.ptp(half)) for half in np.split(elevon[: 2 * (len(elevon) // 2)], 2)]
    spectrum = np.abs(np.fft.rfft(elevon - elevon.mean()))
    frequency = float(np.fft.rfftfreq(elevon.size, 1.0 / RATE)[spectrum.argmax()])
    sustained = min(halves) > MIN_SWING and halves[1] > 0.7 * halves[0]
    ending = Ending.CYCLE if sustained else Ending.SETTLED
    return Oscillation(ending, 0.5 * halves[1], frequency, distance)


def endings(a: Airframe, seed: int) -> list[list[Oscillation]]:
    """Ends of the flights at all bandwidths (statements) and steps (columns)."""
    return [[oscillation(step_flight(a, lam, step, seed)) for step in TARGET_STEPS] for lam in BANDWIDTHS]


def run(conditions: Conditions) -> ExperimentResult:
    """Frequency response, the hover flight under both models, and the map of limit cycles."""
    airframes, seed = models(conditions), conditions.seed
    maps = {name: endings(a, seed) for name, a in airframes.items()}
    cycling, calm = (step_flight(airframes[name], 18.0, 1.0, seed) for name in ("saturated", "first order"))
    panels = [_response(airframes), _maps(maps), _example(cycling, calm)]
    return ExperimentResult([], panels, [*_alike(airframes, seed), *_cycles(maps)])


def _alike(airframes: dict[str, Airframe], seed: int) -> list[Illustration]:
    hover = SCENARIOS["hover"]
    flights = [fly(hover, seed=seed, airframe=airframes[name]) for name in ("saturated", "first order")]
    settled = [settling_time(flight, 0.05) for flight in flights]
    illustrations = [
        Illustration("2.1.2", "[5, 5, 5] settles with first-order actuators after", settled[1], "s", "the same way",
                     f"saturated: {settled[0]:.2f} s; lambda = 10 rad/s")
    ]  # fmt: skip
    for amplitude, frequency in ((5.0, 6.0), (30.0, 2.0), (30.0, 6.0)):
        lags = [
            -math.degrees(response(airframes[name], 2, math.radians(amplitude), frequency)[1])
            for name in ("saturated", "first order")
        ]
        name = f"elevon lag, {amplitude:.0f} deg at {frequency:.0f} Hz, saturated less first order"
        illustrations.append(
            Illustration("2.1.2", name, lags[0] - lags[1], "deg", "the same way, with subtleties by frequency",
                         f"{lags[0]:.0f} against {lags[1]:.0f} deg; the report names no amplitude and no frequency")
        )  # fmt: skip
    return illustrations


def _cycles(maps: dict[str, list[list[Oscillation]]]) -> list[Illustration]:
    illustrations = []
    for name, table in maps.items():
        found = [flight for flight in _each(table) if flight[2].ending is Ending.CYCLE]
        lowest = min((lam for lam, _, _ in found), default=math.nan)
        illustrations.append(
            Illustration("Perspectives", f"limit cycle, {name}: from lambda", lowest, "rad/s", "observed in the arena",
                         f"{_where(found, table)}; the arena's gains are not printed")
        )  # fmt: skip
    return illustrations


def _each(table: list[list[Oscillation]]) -> list[tuple[float, float, Oscillation]]:
    """Bandwidth, step and oscillation of every flight of a map."""
    return [
        (lam, step, flight)
        for lam, line in zip(BANDWIDTHS, table, strict=True)
        for step, flight in zip(TARGET_STEPS, line, strict=True)
    ]


def _where(found: list[tuple[float, float, Oscillation]], table: list[list[Oscillation]]) -> str:
    flights = len(BANDWIDTHS) * len(TARGET_STEPS)
    lost = sum(o.ending is Ending.LOST for line in table for o in line)
    if not found:
        return (
            f"none among {flights} flights up to {BANDWIDTHS[-1]:.0f} rad/s and {TARGET_STEPS[-1]:.0f} m ({lost} lost)"
        )
    lam, step, first = found[0]
    return (
        f"{len(found)} of {flights} flights ({lost} lost); first after a step of {step:g} m at lambda = {lam:.0f}: "
        f"elevons +-{math.degrees(first.amplitude):.0f} deg at {first.frequency:.1f} Hz, {first.distance:.1f} m off"
    )


def _response(airframes: dict[str, Airframe]) -> Panel:
    """Gain and phase of the saturated and the first-order actuators, over frequency."""
    frequencies = np.geomspace(0.5, 15.0, 20)
    sheet = SvgSheet("motors-response", 2, columns=2, height=2.0)
    with sheet as axes:
        for column, (which, amplitudes, unit) in enumerate(((0, (50.0, 300.0), "rad/s"), (2, (5.0, 30.0), "deg"))):
            for name in ("saturated", "first order"):
                for amplitude in amplitudes if name == "saturated" else amplitudes[:1]:
                    size = amplitude if which == 0 else math.radians(amplitude)
                    points = np.array([response(airframes[name], which, size, float(f)) for f in frequencies])
                    label = f"{name}, {amplitude:.0f} {unit}" if name == "saturated" else name
                    axes[column].loglog(frequencies, points[:, 0], label=label)
                    axes[column + 2].semilogx(frequencies, np.degrees(np.unwrap(points[:, 1])))
            axes[column].set_title(("motor", "elevon")[column], fontsize=9)
            axes[column].set_yticks([0.2, 0.5, 1.0], ["0.2", "0.5", "1"])
            axes[column].minorticks_off()
            axes[column + 2].set_xticks([1.0, 2.0, 5.0, 10.0], ["1", "2", "5", "10"])
            axes[column + 2].minorticks_off()
            axes[column].legend(fontsize=7)
            axes[column + 2].set_xlabel("frequency [Hz]")
        axes[0].set_ylabel("gain")
        axes[2].set_ylabel("phase [deg]")
        for axis in axes:
            axis.grid(alpha=0.2)
    return Panel(
        "", "Actuators as describing functions: saturated (two amplitudes) and first order",
        "The saturation acts as the first order does, with some subtleties that depend on the frequency.",
        "True of small motions. Of large ones the rate limit's lag reaches 90 deg and its gain falls with the "
        "amplitude: that is what a limit cycle needs.", sheet.svg,
    )  # fmt: skip


def _maps(maps: dict[str, list[list[Oscillation]]]) -> Panel:
    sheet = SvgSheet("motors-map", 2, columns=2, height=2.3)
    marks = {Ending.SETTLED: ("o", "#3fa66b"), Ending.CYCLE: ("s", "#e07b39"), Ending.LOST: ("x", "crimson")}
    with sheet as axes:
        for axis, (name, table) in zip(axes, maps.items(), strict=True):
            for ending, (mark, colour) in marks.items():
                points = [(lam, step) for lam, step, flight in _each(table) if flight.ending is ending]
                if points:
                    axis.semilogy(*np.array(points).T, mark, color=colour, markersize=5, label=str(ending))
            axis.set_title(name, fontsize=9)
            axis.set_yticks(TARGET_STEPS, [f"{step:g}" for step in TARGET_STEPS])
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
        "motors' rate limit alone there is none; the elevons' rate limit causes it.", sheet.svg,
    )  # fmt: skip


def _example(cycling: Track, calm: Track) -> Panel:
    sheet = SvgSheet("motors-cycle", 2, height=1.9)
    with sheet as axes:
        for name, track in (("saturated", cycling), ("first order", calm)):
            axes[0].plot(*thin(track.time, np.degrees(track.actuator[:, 2])), label=name, linewidth=0.9)
            axes[1].plot(*thin(track.time, position_error(track)), label=name, linewidth=0.9)
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
        "for ever. First order: settled. Whether this was the arena's cycle cannot be decided: "
        "its gains are not given.", sheet.svg,
    )  # fmt: skip


ACTUATOR_LAG = Experiment(
    "motors",
    "Saturated against first-order actuators",
    "2.1.2, Perspectives",
    "The report models the actuators by rate limits, holds that a first order would act the same way, and leaves the "
    "limit cycle seen in earlier flight tests for later. Here both models fly the same steps of the target over a "
    "range of attitude bandwidths; a limit cycle is an oscillation that neither grows nor dies in the last 10 s.",
    run,
    airframes=("nominal", "nominal-first-order"),
)
