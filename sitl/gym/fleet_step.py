"""One control interval of many flights, compiled: by commands, or by the product's own controller.

Flights do not touch one another: any number of them, in any order and by any number of threads, gives the same bits.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sitl.compiled import entry, kernel
from sitl.gym.action_kinds import AS_ACTUATORS, commanded, shift_reference
from sitl.gym.rewards import MOST_OBSERVED, is_lost, observe_state, reward_rate
from sitl.model.airframe import Array
from sitl.model.plant import is_finite
from sitl.model.vectors import add
from sitl.simulation.flight import (
    Flight,
    put_estimate,
    put_known_wind,
    run_timers,
    update_gust,
)
from sitl.simulation.loop import MAX_CHAIN, due_now, estimate_wind, motion_of, move, take_jump, tick
from sitl.simulation.sensed import delayed, sensed
from sitl.storage import Records, value_of, writer

put_command = writer(Flight, lambda flight: flight.controller.command)


class FleetArrays(NamedTuple):
    """Flights side by side, n of them, and what they fly by."""

    flights: Records  # of Flight, changed in place, (n,)
    airframes: Records  # of Airframe: as each is, (n,)
    airs: Records  # of Environment, (n,)
    goals: Records  # of Goal, (n,)
    references: Records  # of Reference; the product's controllers follow them, (n,)
    told: Records  # of Reference, as the task has it, (1,)
    designs: Records  # of Design, (1,)
    jumps: Records  # of JumpEntry, overwritten, (n,)
    gusts: Array  # unit normals of a block of periods, (n, block, 3), or of none, (n, 0, 3)
    readings: Array  # of the wind's sensors where laws see the truth, (n, block, 5), or of none


class SenseArrays(NamedTuple):
    """Instruments and filters; of no use where the truth is seen."""

    aboard: Records  # of Aboard, (n,)
    steps: Records  # of Step, (n, MAX_HORIZON)
    fast: Array  # random draws of a block of periods, (n, block, FAST_COLUMNS), or of none, (n, 0, FAST_COLUMNS)
    slow: Array  # (n, block / SLOW_PERIODS, SLOW_COLUMNS)


class Outcome(NamedTuple):
    """Result of an interval, written in place."""

    observations: npt.NDArray[np.float32]  # (n, OBSERVED)
    rewards: Array  # (n,)
    lost: npt.NDArray[np.bool_]  # (n,)
    flies: npt.NDArray[np.bool_]  # (n,) others are only observed


class Turn(NamedTuple):
    """Some flights, the length of their interval, and their kind of action."""

    first: int
    end: int
    periods: int
    kind: int


@kernel
def look(fleet: FleetArrays, outcome: Outcome, scratch: Array, i: int, flies: bool) -> None:
    """Observation, reward and ending of a flight; one that is not finite is lost, and observed as zeros."""
    flight, goal = fleet.flights[i], value_of(fleet.goals[i])
    plant, row = value_of(flight.plant), outcome.observations[i]
    if is_finite(plant):
        observe_state(scratch, value_of(flight.estimate), goal, value_of(fleet.designs[0].a))
        outcome.rewards[i] = reward_rate(plant, goal) if flies else 0.0
        outcome.lost[i] = flies and (flight.controller.has_crashed or is_lost(plant, goal))
    else:
        scratch[:] = 0.0
        outcome.rewards[i], outcome.lost[i] = 0.0, flies
    for j in range(len(scratch)):
        row[j] = scratch[j] if abs(scratch[j]) <= MOST_OBSERVED else 0.0  # a filter's estimate may not be finite


@entry
def step_by_commands(
    fleet: FleetArrays, senses: SenseArrays, actions: Array, outcome: Outcome, scratch: Array, turn: Turn
) -> None:
    """Fly flights by actions for an interval.

    Args:
        fleet: The flights.
        senses: Their instruments.
        actions: (n, 4) from -1 to 1.
        outcome: Receives what is seen.
        scratch: Room for an observation.
        turn: Which, and how long.
    """
    design = fleet.designs[0]
    model = value_of(design.a)
    is_sensed, block = senses.fast.shape[1] > 0, fleet.gusts.shape[1]
    for i in range(turn.first, turn.end):
        flight, air, a, own = fleet.flights[i], fleet.airs[i], fleet.airframes[i], senses.aboard[i if is_sensed else 0]
        steps, fast, slow = senses.steps[i], senses.fast[i], senses.slow[i]
        gusts, action, flies = fleet.gusts[i], actions[i], outcome.flies[i]
        gusty = air.gust_rms > 0.0 and block > 0
        for k in range(turn.periods if flies else 0):
            if gusty:
                update_gust(flight, air, gusts, flight.periods % block)
            before, in_force = value_of(flight.plant), value_of(flight.controller.command)
            if is_sensed:
                in_force = delayed(own.instruments, in_force, flight.periods)
            else:
                put_known_wind(flight, add(value_of(air.wind), value_of(flight.gust)))
            if k == 0 or turn.kind != AS_ACTUATORS:
                put_command(flight, commanded(turn.kind, action, value_of(flight.estimate), design, model))
            move(flight, air, a, in_force)
            if is_sensed:
                put_estimate(flight, sensed(own, steps, a, motion_of(flight, air, before, in_force), fast, slow))
        look(fleet, outcome, scratch, i, flies)


@entry
def step_by_controller(
    fleet: FleetArrays, senses: SenseArrays, actions: Array, outcome: Outcome, scratch: Array, turn: Turn
) -> None:
    """Fly flights by the product's own controller for an interval, to references that actions shift.

    Arguments as for :func:`step_by_commands`; the order within a period is that of the flight loop.
    """
    design, told = fleet.designs[0], fleet.told[0]
    is_sensed, block = senses.fast.shape[1] > 0, fleet.gusts.shape[1]
    for i in range(turn.first, turn.end):
        flight, air, a, own = fleet.flights[i], fleet.airs[i], fleet.airframes[i], senses.aboard[i if is_sensed else 0]
        steps, fast, slow, reference = senses.steps[i], senses.fast[i], senses.slow[i], fleet.references[i]
        gusts, readings, flies = fleet.gusts[i], fleet.readings[i], outcome.flies[i]
        gusty = air.gust_rms > 0.0 and block > 0
        shift_reference(reference, told, actions[i])
        for _ in range(turn.periods if flies else 0):
            for _ in range(MAX_CHAIN):
                row = due_now(flight, reference, design)
                if row < 0:
                    break
                take_jump(flight, reference, design, row, fleet.jumps[i])
            if gusty:
                update_gust(flight, air, gusts, flight.periods % block)
            before, in_force = value_of(flight.plant), value_of(flight.controller.command)
            if is_sensed:
                in_force = delayed(own.instruments, in_force, flight.periods)
            else:
                estimate_wind(flight, air, design, a, readings, flight.periods % readings.shape[0])
            tick(flight, reference, design)
            move(flight, air, a, in_force)
            if is_sensed:
                put_estimate(flight, sensed(own, steps, a, motion_of(flight, air, before, in_force), fast, slow))
            run_timers(flight)
        look(fleet, outcome, scratch, i, flies)
