"""The compiled loop of one flight: control periods and jumps until the time is up.

Parts are compiled apart and kept on disk, so that two processes share a first start's work. The loop about another
register of laws is compiled in one, anew in every process.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from inspect import getsource
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
from sitl.simulation.dispatch import COMPILED, Register
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
from sitl.simulation.sensed import Aboard, Motion, delayed, sensed, sensed_by
from sitl.storage import Records, value_of, writer

FLOWN, UNKNOWN_LAW, ZENO, DIVERGED, JUMPS_FULL = range(5)  # how a call of the loop ends
MAX_CHAIN = 12  # jumps at one instant: more than there are laws means that some law came twice


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


class WorldArrays(NamedTuple):
    """The wind wall, obstacles, and random draws from the first period of a call on."""

    wall: Wall
    solids: Array  # what may be touched besides the ground, (n, 9)
    gusts: Array  # unit normals of the gusts; none without gusts, (n, 3)
    swirls: Array  # of the arena's turbulence; none where only the uniform wind blows, (n, 4)
    sensors: Array  # of the sensors of the truth: velocity, accelerometer, pitot, (n, 5)


class LogRecords(NamedTuple):
    """Receives what happens."""

    samples: Records  # of Sample
    jumps: Records  # of JumpEntry
    diagnostics: Records  # of Diagnostics, in the end, (1,)


class Diagnostics(NamedTuple):
    """Functions of a flight's state that are computed only if somebody looks."""

    v_hover: float  # V of the linear hover law
    v_forward: float  # V of the linear forward law about the path
    v_attitude: float  # V of the attitude law [rad2]
    governor: float  # share of the position loop's force that the governor takes away, 0..1


class Span(NamedTuple):
    """Length of a call of the loop, and of the steps between samples."""

    periods: int  # control periods; negative: only look, and take no jump
    every: int  # periods between samples, which are taken after the jumps of their instant


put_sample = writer(Sample, lambda sample: sample)
put_jump_entry = writer(JumpEntry, lambda entry: entry)
put_diagnostics = writer(Diagnostics, lambda diagnostics: diagnostics)
put_lands = writer(Aboard, lambda aboard: aboard.filter.lands)
_tick, _seek, _jump = COMPILED.tick, COMPILED.seek, COMPILED.jump
_is_known, _values, _v_hover = COMPILED.is_known, COMPILED.values, COMPILED.v_hover


@part
def tick(flight: Flight, reference: Reference, design: Design) -> None:
    """Compute the commands of the law in force."""
    _tick(flight.controller.law, flight, reference, design)


@part
def due_now(flight: Flight, reference: Reference, design: Design) -> int:
    """The row of the jump that is due; -1 in the flow set."""
    return _seek(flight.controller.law, flight, reference, design)


@part
def take_jump(flight: Flight, reference: Reference, design: Design, row: int, entry: JumpEntry) -> None:
    """Take a jump and record it, with the values of V before its reset maps."""
    source = flight.controller.law
    v_hover, v_forward, _ = _values(flight, reference, design)
    _jump(source, row, flight, reference, design)
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


@part
def write_sample(flight: Flight, reference: Reference, design: Design, sample: Sample) -> None:
    """Record a sample; V of the linear hover law is recorded whatever law flies."""
    put_sample(sample, sample_of(flight, reference, _v_hover(flight, reference, design)))


@part
def write_diagnostics(flight: Flight, reference: Reference, design: Design, seen: Diagnostics) -> None:
    """Compute the derived values, once per call: they cost more than a period's guards."""
    v_hover, v_forward, v_attitude = _values(flight, reference, design)
    e, r = value_of(flight.estimate), value_of(reference)
    governor = value_of(design.gains.zero_moment.governor)
    taken = activity(subtract(e.position, r.position), e.velocity, r.speed, governor)
    put_diagnostics(seen, Diagnostics(v_hover, v_forward, v_attitude, taken))


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
def motion_of(flight: Flight, air: Environment, before: Plant, in_force: Actuators) -> Motion:
    """The motion that the instruments meet in a period."""
    return Motion(
        before=before,
        plant=value_of(flight.plant),
        wind=add(value_of(air.wind), value_of(flight.gust)),
        command=in_force,
        may_turn=may_turn(flight),
        period=flight.periods,
        has_tube=air.sensors.has_pitot,
    )


# One function: each layer above the parts would be compiled with all of them again.
@entry
def fly(  # noqa: C901, PLR0912, PLR0915
    records: FlightRecords, aboard: AboardRecords, around: WorldArrays, log: LogRecords, span: Span
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
    flight, reference, design = records.flights[0], records.references[0], records.designs[0]
    a, air, field, own = records.airframes[0], records.airs[0], records.fields[0], aboard.aboard[0]
    # Read once, as counting references to arrays takes time.
    steps, fast, slow, normals = aboard.steps, aboard.fast, aboard.slow, around.sensors
    gusty, swirls, solids = len(around.gusts) > 0, len(around.swirls) > 0, len(around.solids) > 0
    is_sensed, samples, jumps = len(aboard.fast) > 0, len(log.samples), len(log.jumps)
    sampled = noted = done = chain = 0
    end = FLOWN if _is_known(flight.controller.law) else UNKNOWN_LAW
    while end == FLOWN and span.periods >= 0:
        row = due_now(flight, reference, design)
        if row >= 0:
            if chain == MAX_CHAIN or noted == jumps:
                end = ZENO if chain == MAX_CHAIN else JUMPS_FULL
                break
            take_jump(flight, reference, design, row, log.jumps[noted])
            noted += 1
            chain += 1
            continue
        chain = 0
        if done == span.periods:
            break
        if sampled < samples and flight.periods % span.every == 0:
            if not is_finite(value_of(flight.plant)):
                break
            write_sample(flight, reference, design, log.samples[sampled])
            sampled += 1
        if gusty:
            update_gust(flight, air, around.gusts, done)
        if swirls:
            update_field(flight, air, field, around.wall, around.swirls, done)
        before, in_force = value_of(flight.plant), value_of(flight.controller.command)
        if is_sensed:
            in_force = delayed(own.instruments, in_force, flight.periods)
        else:
            estimate_wind(flight, air, design, a, normals, done)
        tick(flight, reference, design)
        if swirls:
            move_in_field(flight, air, a, field, in_force)
        else:
            move(flight, air, a, in_force)
        if solids:
            touch_solids(flight, a, field, around.solids)
        if is_sensed:
            put_lands(own, flight.controller.is_landing)
            motion = motion_of(flight, air, before, in_force)
            put_estimate(flight, sensed(own, steps, a, motion, fast, slow))
        run_timers(flight)
        done += 1
    if end == FLOWN and not is_finite(value_of(flight.plant)):
        end = DIVERGED
    write_diagnostics(flight, reference, design, log.diagnostics[0])
    return done, sampled, noted, end


# Parts that do not need one another: two processes compile some each, in about the same time.
MAIN_SHARE = (
    tick,
    due_now,
    move,
    estimate_wind,
    move_in_field,
    update_field,
    touch_solids,
    write_sample,
    take_jump,
    write_diagnostics,
)
SENSES = (sensed,)
PARTS = (*MAIN_SHARE, *SENSES)


@cache
def fly_with(register: Register) -> Callable[..., tuple[int, int, int, int]]:
    """The same loop about other laws: its text is read once more, where the names stand for their functions."""
    laws = {f"_{name}": function for name, function in register.compile()._asdict().items()}
    scope = {**globals(), **laws, "part": kernel, "entry": unkept_entry}
    if register.navigate is not None:
        scope["sensed"] = sensed_by(register.navigate)
    for function in (tick, due_now, take_jump, write_sample, write_diagnostics, fly):
        exec(getsource(getattr(function, "py_func", function)), scope)  # noqa: S102 - the text above
    return scope["fly"]  # type: ignore[no-any-return]
