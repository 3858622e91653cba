"""The compiled loop of a block: as many flights side by side as vector instructions take, each the same as alone.

A phase is a loop over the block's columns around the same functions that fly a single flight. Where all flights of a
block are out of the ground's reach and under ``HOVER_LINEAR`` or ``HOVER_ZERO_MOMENT``, such a loop becomes vector
code; else the flights take turns. Neither changes a bit of any flight.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from protocol.dialect.vocabulary import Law
from sitl.compiled import part, subroutine, whole
from sitl.model.airframe import Array
from sitl.model.ground import CLEAR, clearance
from sitl.model.state import Actuators
from sitl.simulation.dispatch import COMPILED
from sitl.simulation.flight import (
    Flight,
    as_reported,
    get_airframe,
    get_ground,
    get_model,
    glide,
    is_as_reported,
    move_plant,
    run_timers,
    sense,
    update_gust,
    update_wind_estimate,
    within_limits,
)
from sitl.simulation.loop import JUMPS_FULL, MAX_CHAIN, ZENO, due_now, take_jump, write_sample
from sitl.storage import WIDTH, Kept, access, column_rows

_tick, _needs, _watch, _due = COMPILED.tick_in_line, COMPILED.needs, COMPILED.watch, COMPILED.due
get_law, get_command = access(Flight, "controller.law").get, access(Flight, "controller.command").get
get_actuators, put_actuators = access(Actuators)
get_periods = access(Flight, "periods").get
get_position = access(Flight, "plant.body.position").get
(LAW,) = column_rows(Flight, "controller.law")
LINEAR, ZERO_MOMENT = Law.HOVER_LINEAR.value, Law.HOVER_ZERO_MOMENT.value
MIXED = -1


@subroutine
def common_law(block: Array) -> int:
    """The law that all flights of a block are under, or MIXED."""
    for column in range(1, WIDTH):
        if block[LAW * WIDTH + column] != block[LAW * WIDTH]:
            return MIXED
    return int(block[LAW * WIDTH])


@subroutine
def are_clear(block: Array, air: Array) -> bool:
    """Whether the ground is out of the reach of all flights of a block."""
    lowest = clearance(get_ground(air, 0), get_position(block, 0))
    for column in range(1, WIDTH):
        lowest = min(lowest, clearance(get_ground(air, column), get_position(block, column)))
    return bool(lowest > CLEAR)


@part
def blow_all(block: Array, air: Array, gusts: Array, row: int) -> None:
    """The gusts of all flights."""
    for column in range(WIDTH):
        update_gust(block, column, air, gusts, row)


@subroutine
def are_as_reported(a: Array) -> bool:
    """Whether all airframes of a block are of the report's kind."""
    alike = True
    for column in range(WIDTH):
        alike = alike and is_as_reported(get_airframe(a, column))
    return alike


@part
def sense_all(alike: bool, block: Array, air: Array, design: Kept, a: Array, draws: Array, row: int) -> None:
    """The wind estimates of all flights; ``alike``: all airframes, the design's too, are of the report's kind."""
    if alike:
        model = as_reported(get_model(design, 0))
        for column in range(WIDTH):
            sense(block, column, air, design, model, as_reported(get_airframe(a, column)), draws, row)
    else:
        for column in range(WIDTH):
            update_wind_estimate(block, column, air, design, a, draws, row)


@part
def tick_all(law: int, block: Array, reference: Array, design: Kept) -> None:
    """The commands of all flights."""
    if law == LINEAR:
        for column in range(WIDTH):
            _tick(LINEAR, block, column, reference, design)
    elif law == ZERO_MOMENT:
        for column in range(WIDTH):
            _tick(ZERO_MOMENT, block, column, reference, design)
    else:
        for column in range(WIDTH):
            _tick(get_law(block, column), block, column, reference, design)


@part
def move_all(alike: bool, block: Array, air: Array, a: Array, in_force: Array) -> None:
    """The plants of all flights."""
    if are_clear(block, air) and alike:
        for column in range(WIDTH):
            glide(block, column, air, as_reported(get_airframe(a, column)), get_actuators(in_force, column))
    elif are_clear(block, air):
        for column in range(WIDTH):
            glide(block, column, air, get_airframe(a, column), get_actuators(in_force, column))
    else:
        for column in range(WIDTH):
            command = get_actuators(in_force, column)
            wanted = within_limits(block, column, command, get_airframe(a, column))
            move_plant(block, column, air, a, command, wanted)
    for column in range(WIDTH):
        run_timers(block, column)


@part
def watch_all(law: int, block: Array, reference: Array, design: Kept, rows: npt.NDArray[np.int64]) -> bool:
    """The jumps that are due, into ``rows`` (WIDTH,); whether there is one."""
    if law == LINEAR:
        for column in range(WIDTH):
            rows[column] = _due(LINEAR, _watch(_needs(LINEAR), block, column, reference, design))
    elif law == ZERO_MOMENT:
        for column in range(WIDTH):
            rows[column] = _due(ZERO_MOMENT, _watch(_needs(ZERO_MOMENT), block, column, reference, design))
    else:
        for column in range(WIDTH):
            rows[column] = due_now(block, column, reference, design)
    due = -1
    for column in range(WIDTH):
        due = max(due, rows[column])
    return due >= 0


@part
def take_all(
    block: Array,
    reference: Array,
    design: Kept,
    rows: Kept,
    jumps: Kept,
    noted: Kept,
    ends: Kept,
) -> None:
    """Take the jumps that are due, chains of them as well."""
    for column in range(WIDTH):
        chain = 0
        row = rows[column]
        while row >= 0 and ends[column] == 0:
            if chain == MAX_CHAIN or noted[column] == jumps.shape[1]:
                ends[column] = ZENO if chain == MAX_CHAIN else JUMPS_FULL
                break
            take_jump(block, column, row, reference, design, jumps[column, noted[column]])
            noted[column] += 1
            chain += 1
            row = due_now(block, column, reference, design)


@whole
def fly_block(
    block: Array,
    reference: Array,
    air: Array,
    designs: npt.NDArray[Any],
    a: Array,
    gusts: Array,
    draws: Array,
    periods: int,
    every: int,
    kept: int,
    samples: npt.NDArray[Any],
    jumps: npt.NDArray[Any],
    noted: npt.NDArray[np.int64],
    ends: npt.NDArray[np.int64],
    rows: npt.NDArray[np.int64],
    in_force: Array,
) -> int:
    """Fly a block of flights for some control periods, taking every jump that falls due.

    Args:
        block: The flights, changed in place, a block of Flight.
        reference: Where to fly, a block of Reference.
        air: Air and sensors, a block of Environment.
        designs: The controller of all of them, a record of Design, (1,).
        a: The airframes as they are, a block of Airframe.
        gusts: Unit normals of the gusts, (n, 3, WIDTH); n is 0 without gusts.
        draws: Unit normals of the sensors, (n, 5, WIDTH).
        periods: How many control periods to fly.
        every: Periods between samples, which are taken after the jumps of their instant.
        kept: Samples of each flight that were written before.
        samples: Receives Sample records, (WIDTH, n); the whole of them, since a part would be compiled for anew.
        jumps: Receives JumpEntry records, (WIDTH, n).
        noted: How many jumps each flight has noted, counted on, (WIDTH,).
        ends: Why a flight cannot go on, 0 while it can, (WIDTH,).
        rows: Room for the jumps that are due, (WIDTH,).
        in_force: Room for the commands in force, a block of Actuators.

    Returns:
        Samples of each flight that are written now, those before included.
    """
    design = designs[0]
    alike = are_as_reported(a) and is_as_reported(get_model(design, 0))
    for done in range(periods + 1):
        law = common_law(block)
        if watch_all(law, block, reference, design, rows):
            take_all(block, reference, design, rows, jumps, noted, ends)
            law = common_law(block)
        if done == periods:
            break
        if kept < samples.shape[1] and get_periods(block, 0) % every == 0:
            for column in range(WIDTH):
                write_sample(block, column, reference, design, samples[column, kept])
            kept += 1
        blow_all(block, air, gusts, done)
        sense_all(alike, block, air, design, a, draws, done)
        for column in range(WIDTH):
            put_actuators(in_force, column, get_command(block, column))
        tick_all(law, block, reference, design)
        move_all(alike, block, air, a, in_force)
    return kept


# Each is kept for itself, as code that another processor's machine code can be made of.
PARTS = (blow_all, sense_all, tick_all, move_all, watch_all, take_all)
