"""The compiled loop of one flight: control periods and jumps until the time is up.

What depends on the register of laws is handed to the loop as :class:`LawParts`: the product's own are compiled apart
and kept on disk; those of another register are compiled with the loop, anew in every process.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import NamedTuple

from sitl.compiled import entry, kernel, part, unkept_entry
from sitl.control.governor import activity
from sitl.control.reference import Reference
from sitl.enclosure.wind_field import Wall, WindField
from sitl.model.airframe import Airframe, Array
from sitl.model.ground import is_clear
from sitl.model.plant import is_finite
from sitl.model.state import Actuators, Plant
from sitl.model.vectors import add, subtract
from sitl.simulation.actuator_faults import is_whole
from sitl.simulation.dispatch import COMPILED, Compiled, Register
from sitl.simulation.flight import (
    Design,
    Environment,
    Flight,
    JumpEntry,
    Sample,
    as_they_fail,
    may_turn,
    move_in_swirl,
    move_plant,
    put_estimate,
    run_timers,
    sample_of,
    touch_solids,
    update_field,
    update_gust,
    update_wind_estimate,
    within_limits,
)
from sitl.simulation.sensed import Aboard, Motion, delayed, sensed
from sitl.storage import Records, value_of, writer

FLOWN, UNKNOWN_LAW, ZENO, DIVERGED, JUMPS_FULL = range(5)  # how a call of the loop ends
MAX_CHAIN = 12  # jumps at one instant: more than there are laws means that some law came twice


class Diagnostics(NamedTuple):
    """Functions of a flight's state that are computed only if somebody looks."""

    v_hover: float  # V of the linear hover law
    v_forward: float  # V of the linear forward law about the path
    v_attitude: float  # V of the attitude law [rad2]
    governor: float  # share of the position loop's force that the governor takes away, 0..1


class FlightRecords(NamedTuple):
    """Arrays of one record each: the vehicle, its controller, and the air around it."""

    flights: Records  # of Flight, changed in place
    references: Records  # of Reference
    designs: Records  # of Design
    airframes: Records  # of Airframe: as it is
    airs: Records  # of Environment
    fields: Records  # of WindField: the arena's air


class AboardRecords(NamedTuple):
    """Instruments and filter."""

    aboard: Records  # of Aboard, (1,)
    steps: Records  # what the filter has yet to come to, of Step, (MAX_HORIZON,)
    fast: Array  # random draws of the instruments, of a block; none where laws see the truth, (n, FAST_COLUMNS)
    slow: Array  # of their slow steps, (n / SLOW, SLOW_COLUMNS)


class Surrounding(NamedTuple):
    """The wind wall, obstacles, and random draws from the first period of a call on."""

    wall: Wall
    solids: Array  # what may be touched besides the ground, (n, 9)
    gusts: Array  # unit normals of the gusts; none without gusts, (n, 3)
    swirls: Array  # of the arena's turbulence; none where only the uniform wind blows, (n, 4)
    sensors: Array  # of the sensors of the truth: velocity, accelerometer, pitot, (n, 5)


class Present(NamedTuple):
    """What there is in a call besides the vehicle; told once, as counting references to arrays takes time."""

    gusts: bool
    swirls: bool
    solids: bool
    instruments: bool  # else the laws see the truth


class Parties(NamedTuple):
    """The records of :class:`FlightRecords` themselves."""

    flight: Flight
    reference: Reference
    design: Design
    airframe: Airframe
    air: Environment
    field: WindField


class LogRecords(NamedTuple):
    """Receives what happens."""

    samples: Records  # of Sample
    jumps: Records  # of JumpEntry
    diagnostics: Records  # of Diagnostics, in the end, (1,)


class Span(NamedTuple):
    """How far a call of the loop flies."""

    periods: int  # control periods; negative: only look, and take no jump
    every: int  # periods between samples, which are taken after the jumps of their instant


class LawParts(NamedTuple):
    """Compiled functions that depend on the register of laws."""

    tick: Callable[[Flight, Reference, Design], None]  # the commands of the law in force
    due_now: Callable[[Flight, Reference, Design], int]  # row of the jump that is due; -1 in the flow set
    take_jump: Callable[[Flight, Reference, Design, int, JumpEntry], None]  # takes it and records it
    write_sample: Callable[[Flight, Reference, Design, Sample], None]
    write_diagnostics: Callable[[Flight, Reference, Design, Diagnostics], None]
    is_known: Callable[[int], bool]  # whether there is such a law


put_sample = writer(Sample, lambda sample: sample)
put_jump_entry = writer(JumpEntry, lambda entry: entry)
put_diagnostics = writer(Diagnostics, lambda diagnostics: diagnostics)
put_lands = writer(Aboard, lambda aboard: aboard.filter.lands)


def law_parts(laws: Compiled) -> LawParts:
    """The loop's parts that call a register's generated functions."""
    law_tick, seek, jump, values, v_hover_of = laws.tick, laws.seek, laws.jump, laws.values, laws.v_hover

    @kernel
    def tick(flight: Flight, reference: Reference, design: Design) -> None:
        law_tick(flight.controller.law, flight, reference, design)

    @kernel
    def due_now(flight: Flight, reference: Reference, design: Design) -> int:
        return seek(flight.controller.law, flight, reference, design)

    @kernel
    def take_jump(flight: Flight, reference: Reference, design: Design, row: int, entry: JumpEntry) -> None:
        source = flight.controller.law
        v_hover, v_forward, _ = values(flight, reference, design)  # before the reset maps
        jump(source, row, flight, reference, design)
        target, periods, energy = flight.controller.law, flight.periods, flight.energy
        put_jump_entry(
            entry,
            JumpEntry(
                periods=periods,
                source=source,
                target=target,
                row=row,
                v_hover=v_hover,
                v_forward=v_forward,
                energy=energy,
            ),
        )

    @kernel
    def write_sample(flight: Flight, reference: Reference, design: Design, sample: Sample) -> None:
        put_sample(sample, sample_of(flight, reference, v_hover_of(flight, reference, design)))

    @kernel
    def write_diagnostics(flight: Flight, reference: Reference, design: Design, seen: Diagnostics) -> None:
        v_hover, v_forward, v_attitude = values(flight, reference, design)
        e, r = value_of(flight.estimate), value_of(reference)
        governor = value_of(design.gains.zero_moment.governor)
        taken = activity(subtract(e.position, r.position), e.velocity, r.speed, governor)
        put_diagnostics(seen, Diagnostics(v_hover, v_forward, v_attitude, taken))

    return LawParts(
        tick=tick,
        due_now=due_now,
        take_jump=take_jump,
        write_sample=write_sample,
        write_diagnostics=write_diagnostics,
        is_known=laws.is_known,
    )


# The product's own laws: parts that are compiled apart, so that two processes share a first start's work.
_tick, _due_now, _take_jump, _write_sample, _write_diagnostics, _is_known = law_parts(COMPILED)


@part
def tick(flight: Flight, reference: Reference, design: Design) -> None:
    """Compute the commands of the law in force."""
    _tick(flight, reference, design)


@part
def due_now(flight: Flight, reference: Reference, design: Design) -> int:
    """The row of the jump that is due; -1 in the flow set."""
    return _due_now(flight, reference, design)


@part
def take_jump(flight: Flight, reference: Reference, design: Design, row: int, entry: JumpEntry) -> None:
    """Take a jump and record it, with the values of V before its reset maps."""
    _take_jump(flight, reference, design, row, entry)


@part
def write_sample(flight: Flight, reference: Reference, design: Design, sample: Sample) -> None:
    """Record a sample; V of the linear hover law is recorded whatever law flies."""
    _write_sample(flight, reference, design, sample)


@part
def write_diagnostics(flight: Flight, reference: Reference, design: Design, seen: Diagnostics) -> None:
    """Compute the derived values, once per call: they cost more than a period's guards."""
    _write_diagnostics(flight, reference, design, seen)


@part
def estimate_wind(flight: Flight, air: Environment, design: Design, a: Airframe, normals: Array, row: int) -> None:
    """Update the wind estimate of a flight on the true state; with sensors the navigation filter estimates the wind."""
    update_wind_estimate(flight, air, design, a, normals, row)


@part
def move(flight: Flight, air: Environment, a: Airframe, in_force: Actuators) -> None:
    """Move the plant by one control period in air that does not rotate."""
    move_plant(flight, air, a, in_force, _wanted(flight, air, a, in_force))


@part
def move_in_field(flight: Flight, air: Environment, a: Airframe, field: WindField, in_force: Actuators) -> None:
    """Move the plant by one control period in an arena's rotating air, which does not rotate near the ground."""
    wanted = _wanted(flight, air, a, in_force)
    if is_clear(value_of(flight.plant.body), value_of(air.ground)):
        move_in_swirl(flight, air, a, field, in_force, wanted)
    else:
        move_plant(flight, air, a, in_force, wanted)


@kernel
def _wanted(flight: Flight, air: Environment, a: Airframe, in_force: Actuators) -> Actuators:
    """Positions to which the actuators go."""
    airframe, faults = value_of(a), value_of(air.faults)
    wanted = within_limits(flight, in_force, airframe)
    return wanted if is_whole(faults) else as_they_fail(flight, faults, airframe, wanted)


@kernel
def _sense(now: Parties, aboard: AboardRecords, before: Plant, in_force: Actuators) -> None:
    """The estimate of instruments and filter at the end of a period."""
    flight, air, own = now.flight, now.air, aboard.aboard[0]
    put_lands(own, flight.controller.is_landing)
    motion = Motion(
        before=before,
        plant=value_of(flight.plant),
        wind=add(value_of(air.wind), value_of(flight.gust)),
        command=in_force,
        may_turn=may_turn(flight),
        period=flight.periods,
        has_tube=air.sensors.has_pitot,
    )
    put_estimate(flight, sensed(own, aboard.steps, now.airframe, motion, aboard.fast, aboard.slow))


def _period(tick: Callable[..., None]) -> Callable[..., None]:
    """The function that flies one control period, before any jump."""

    @kernel
    def advance(now: Parties, present: Present, aboard: AboardRecords, around: Surrounding, row: int) -> None:
        flight, design, a, air, field = now.flight, now.design, now.airframe, now.air, now.field
        if present.gusts:
            update_gust(flight, air, around.gusts, row)
        if present.swirls:
            update_field(flight, air, field, around.wall, around.swirls, row)
        before, in_force = value_of(flight.plant), value_of(flight.controller.command)
        if present.instruments:
            in_force = delayed(aboard.aboard[0].instruments, in_force, flight.periods)
        else:
            estimate_wind(flight, air, design, a, around.sensors, row)
        tick(flight, now.reference, design)
        if present.swirls:
            move_in_field(flight, air, a, field, in_force)
        else:
            move(flight, air, a, in_force)
        if present.solids:
            touch_solids(flight, a, field, around.solids)
        if present.instruments:
            _sense(now, aboard, before, in_force)
        run_timers(flight)

    return advance


def _jumps(due_now: Callable[..., int], take_jump: Callable[..., None]) -> Callable[..., tuple[int, int]]:
    """The function that takes all jumps of one instant; it gives how many are noted in all, and how it ended."""

    @kernel
    def take_jumps(now: Parties, log: LogRecords, noted: int) -> tuple[int, int]:
        row, chain = due_now(now.flight, now.reference, now.design), 0
        while row >= 0:
            if chain == MAX_CHAIN:
                return noted, ZENO
            if noted == log.jumps.shape[0]:
                return noted, JUMPS_FULL
            take_jump(now.flight, now.reference, now.design, row, log.jumps[noted])
            noted += 1
            chain += 1
            row = due_now(now.flight, now.reference, now.design)
        return noted, FLOWN

    return take_jumps


def flight_loop(parts: LawParts) -> Callable[..., tuple[int, int, int, int]]:
    """The loop about these laws, see :func:`fly`."""
    write_sample, write_diagnostics, is_known = parts.write_sample, parts.write_diagnostics, parts.is_known
    advance, take_jumps = _period(parts.tick), _jumps(parts.due_now, parts.take_jump)

    @kernel
    def fly_on(
        records: FlightRecords, aboard: AboardRecords, around: Surrounding, log: LogRecords, span: Span
    ) -> tuple[int, int, int, int]:
        flight, reference, design = records.flights[0], records.references[0], records.designs[0]
        now = Parties(flight, reference, design, records.airframes[0], air=records.airs[0], field=records.fields[0])
        present = Present(
            gusts=around.gusts.shape[0] > 0,
            swirls=around.swirls.shape[0] > 0,
            solids=around.solids.shape[0] > 0,
            instruments=aboard.fast.shape[0] > 0,
        )
        sampled = noted = done = 0
        end = FLOWN if is_known(flight.controller.law) else UNKNOWN_LAW
        while end == FLOWN and span.periods >= 0:
            noted, end = take_jumps(now, log, noted)
            if end != FLOWN or done == span.periods:
                break
            if sampled < log.samples.shape[0] and flight.periods % span.every == 0:
                if not is_finite(value_of(flight.plant)):
                    break
                write_sample(flight, reference, design, log.samples[sampled])
                sampled += 1
            advance(now, present, aboard, around, done)
            done += 1
        if end == FLOWN and not is_finite(value_of(flight.plant)):
            end = DIVERGED
        write_diagnostics(flight, reference, design, log.diagnostics[0])
        return done, sampled, noted, end

    return fly_on


_fly_on = flight_loop(
    LawParts(
        tick=tick,
        due_now=due_now,
        take_jump=take_jump,
        write_sample=write_sample,
        write_diagnostics=write_diagnostics,
        is_known=_is_known,
    )
)


@entry
def fly(
    records: FlightRecords, aboard: AboardRecords, around: Surrounding, log: LogRecords, span: Span
) -> tuple[int, int, int, int]:
    """Fly one flight for some control periods, taking every jump that falls due.

    Args:
        records: The flight, which is changed in place, and what it flies by.
        aboard: Instruments and filter.
        around: Wind wall, obstacles and random draws.
        log: Receives samples, jumps and diagnostics.
        span: How far.

    Returns:
        Periods flown, samples and jumps written, and how it ended (FLOWN ... JUMPS_FULL).
    """
    return _fly_on(records, aboard, around, log, span)


# Parts that do not need one another: two processes compile some each, in about the same time.
MAIN_SHARE = (
    tick,
    move,
    estimate_wind,
    move_in_field,
    update_field,
    touch_solids,
    write_sample,
    take_jump,
    write_diagnostics,
)
SENSES, DECISIONS = (sensed,), (due_now,)


@cache
def fly_with(register: Register) -> Callable[..., tuple[int, int, int, int]]:
    """The same loop about other laws; it is compiled anew in every process."""
    return unkept_entry(flight_loop(law_parts(register.compile())))
