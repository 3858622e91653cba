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
from sitl.storage import Records, load, writer

FLOWN, UNKNOWN_LAW, ZENO, DIVERGED, JUMPS_FULL = range(5)  # how a call of the loop ends
MAX_CHAIN = 12  # jumps at one instant: more than there are laws means that some law came twice


class Diagnostics(NamedTuple):
    """Functions of a flight's state that are computed only if somebody looks."""

    v_hover: float  # V of the linear hover law
    v_forward: float  # V of the linear forward law about the path
    v_attitude: float  # V of the attitude law [rad2]
    governor: float  # share of the position loop's force that the governor takes away, 0..1


class VehicleRecords(NamedTuple):
    """Records of the vehicle and its controller, (1,) each."""

    flights: Records  # of Flight, changed in place
    references: Records  # of Reference
    designs: Records  # of Design
    airframes: Records  # of Airframe: as it is
    aboard: Records  # of :class:`~sitl.simulation.avionics.Aboard`: instruments and filter
    steps: Records  # what the filter has yet to come to, of Step, (MAX_HORIZON,)


class WorldRecords(NamedTuple):
    """The world around it."""

    airs: Records  # of Environment, (1,)
    fields: Records  # the arena's air, of :class:`~sitl.enclosure.wind_field.WindField`, (1,)
    schedule: Array  # of the wind wall: time and speed, (n, 2)
    bursts: Array  # its 1-cos gusts: begin, duration and rise, (n, 3)
    solids: Array  # what may be touched besides the ground, (n, 9)


class PeriodDraws(NamedTuple):
    """Random draws from the first period of a call on."""

    gusts: Array  # unit normals of the gusts; none without gusts, (n, 3)
    sensors: Array  # of the sensors of the truth: velocity, accelerometer, pitot, (n, 5)
    swirls: Array  # of the arena's turbulence; none where only the uniform wind blows, (n, 4)
    fast: Array  # of the instruments, of a whole block; none where laws see the truth, (n, FAST_COLUMNS)
    slow: Array  # of their slow steps, (n / SLOW, SLOW_COLUMNS)


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
        put_jump_entry(entry, JumpEntry(periods, source, target, row, v_hover, v_forward, energy))

    @kernel
    def write_sample(flight: Flight, reference: Reference, design: Design, sample: Sample) -> None:
        put_sample(sample, sample_of(flight, reference, v_hover_of(flight, reference, design)))

    @kernel
    def write_diagnostics(flight: Flight, reference: Reference, design: Design, seen: Diagnostics) -> None:
        v_hover, v_forward, v_attitude = values(flight, reference, design)
        e, r = load(flight.estimate), load(reference)
        governor = load(design.gains.zero_moment.governor)
        taken = activity(subtract(e.position, r.position), e.velocity, r.speed, governor)
        put_diagnostics(seen, Diagnostics(v_hover, v_forward, v_attitude, taken))

    return LawParts(tick, due_now, take_jump, write_sample, write_diagnostics, laws.is_known)


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
def estimate_wind(flight: Flight, air: Environment, design: Design, a: Airframe, normals: Array) -> None:
    """Update the wind estimate of a flight on the true state; with sensors the navigation filter estimates the wind."""
    update_wind_estimate(flight, air, design, a, normals)


@part
def move(flight: Flight, air: Environment, a: Airframe, in_force: Actuators) -> None:
    """Move the plant by one control period in air that does not rotate."""
    move_plant(flight, air, a, in_force, _wanted(flight, air, a, in_force))


@part
def move_in_field(flight: Flight, air: Environment, a: Airframe, field: WindField, in_force: Actuators) -> None:
    """Move the plant by one control period in an arena's rotating air, which does not rotate near the ground."""
    wanted = _wanted(flight, air, a, in_force)
    if is_clear(load(flight.plant.body), load(air.ground)):
        move_in_swirl(flight, air, a, field, in_force, wanted)
    else:
        move_plant(flight, air, a, in_force, wanted)


@kernel
def _wanted(flight: Flight, air: Environment, a: Airframe, in_force: Actuators) -> Actuators:
    """Positions to which the actuators go."""
    airframe, faults = load(a), load(air.faults)
    wanted = within_limits(flight, in_force, airframe)
    return wanted if is_whole(faults) else as_they_fail(flight, faults, airframe, wanted)


@kernel
def _sense(vehicle: VehicleRecords, air: Environment, draws: PeriodDraws, before: Plant, in_force: Actuators) -> None:
    """The estimate of instruments and filter at the end of a period."""
    flight, aboard = vehicle.flights[0], vehicle.aboard[0]
    put_lands(aboard, flight.controller.is_landing)
    motion = Motion(
        before=before,
        plant=load(flight.plant),
        wind=add(load(air.wind), load(flight.gust)),
        command=in_force,
        may_turn=may_turn(flight),
        period=flight.periods,
        has_tube=air.sensors.has_pitot,
    )
    put_estimate(flight, sensed(aboard, vehicle.steps, vehicle.airframes[0], motion, draws.fast, draws.slow))


def flight_loop(parts: LawParts) -> Callable[..., tuple[int, int, int, int]]:
    """The loop about these laws, see :func:`fly`."""
    tick, due_now, take_jump, write_sample, write_diagnostics, is_known = parts

    @kernel
    def advance(vehicle: VehicleRecords, world: WorldRecords, draws: PeriodDraws, row: int) -> None:
        """One control period, before any jump."""
        flight, design, a = vehicle.flights[0], vehicle.designs[0], vehicle.airframes[0]
        air, field = world.airs[0], world.fields[0]
        is_sensed, swirls = draws.fast.shape[0] > 0, draws.swirls.shape[0] > 0
        if draws.gusts.shape[0] > 0:
            update_gust(flight, air, draws.gusts[row])
        if swirls:
            update_field(flight, air, field, Wall(world.schedule, world.bursts), draws.swirls[row])
        before, in_force = load(flight.plant), load(flight.controller.command)
        if is_sensed:
            in_force = delayed(vehicle.aboard[0].instruments, in_force, flight.periods)
        else:
            estimate_wind(flight, air, design, a, draws.sensors[row])
        tick(flight, vehicle.references[0], design)
        if swirls:
            move_in_field(flight, air, a, field, in_force)
        else:
            move(flight, air, a, in_force)
        if world.solids.shape[0] > 0:
            touch_solids(flight, a, field, world.solids)
        if is_sensed:
            _sense(vehicle, air, draws, before, in_force)
        run_timers(flight)

    @kernel
    def fly_on(
        vehicle: VehicleRecords, world: WorldRecords, draws: PeriodDraws, log: LogRecords, span: Span
    ) -> tuple[int, int, int, int]:
        """Fly on; see :func:`fly`."""
        flight, reference, design = vehicle.flights[0], vehicle.references[0], vehicle.designs[0]
        sampled = noted = done = chain = 0
        end = FLOWN if is_known(flight.controller.law) else UNKNOWN_LAW
        while end == FLOWN and span.periods >= 0:
            row = due_now(flight, reference, design)
            if row >= 0:
                if chain == MAX_CHAIN or noted == log.jumps.shape[0]:
                    end = ZENO if chain == MAX_CHAIN else JUMPS_FULL
                    break
                take_jump(flight, reference, design, row, log.jumps[noted])
                noted += 1
                chain += 1
                continue
            chain = 0
            if done == span.periods:
                break
            if sampled < log.samples.shape[0] and flight.periods % span.every == 0:
                if not is_finite(load(flight.plant)):
                    break
                write_sample(flight, reference, design, log.samples[sampled])
                sampled += 1
            advance(vehicle, world, draws, done)
            done += 1
        if end == FLOWN and not is_finite(load(flight.plant)):
            end = DIVERGED
        write_diagnostics(flight, reference, design, log.diagnostics[0])
        return done, sampled, noted, end

    return fly_on


_fly_on = flight_loop(LawParts(tick, due_now, take_jump, write_sample, write_diagnostics, _is_known))


@entry
def fly(
    vehicle: VehicleRecords, world: WorldRecords, draws: PeriodDraws, log: LogRecords, span: Span
) -> tuple[int, int, int, int]:
    """Fly one flight for some control periods, taking every jump that falls due.

    Args:
        vehicle: The flight, which is changed in place, its controller and what is aboard.
        world: Air, arena, obstacles.
        draws: Random draws of the periods.
        log: Receives samples, jumps and diagnostics.
        span: How far.

    Returns:
        Periods flown, samples and jumps written, and how it ended (FLOWN ... JUMPS_FULL).
    """
    return _fly_on(vehicle, world, draws, log, span)


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
