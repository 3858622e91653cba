"""The compiled loop of one flight: control periods and jumps until the time is up.

``fly_with`` makes it of the functions that were generated from a register of laws; the product's own is kept on disk.
"""

from __future__ import annotations

import types
from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numpy.typing as npt

from sitl.compiled import LINKED, TIED, UNCOUNTED, bare, kernel, part, whole
from sitl.control.governor import activity
from sitl.control.reference import Reference
from sitl.model.airframe import Array
from sitl.model.ground import is_clear
from sitl.model.plant import is_finite
from sitl.model.state import Actuators
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
    get_airframe,
    get_ground,
    get_gust,
    get_is_landing,
    get_steady_wind,
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
from sitl.simulation.sensed import delayed, sensed
from sitl.storage import Kept, access

FLOWN, UNKNOWN_LAW, ZENO, DIVERGED, JUMPS_FULL = range(5)  # how a call of the loop ends
MAX_CHAIN = 12  # jumps at one instant: more than there are laws means that some law came twice

Records = npt.NDArray[Any]


class Diagnostics(NamedTuple):
    """Functions of a flight's state that are computed only if somebody looks."""

    v_hover: float  # V of the linear hover law
    v_forward: float  # V of the linear forward law about the path
    v_attitude: float  # V of the attitude law [rad2]
    governor: float  # share of the position loop's force that the governor takes away, 0..1


get_law = access(Flight, "controller.law").get
get_periods = access(Flight, "periods").get
get_plant = access(Flight, "plant").get
get_command = access(Flight, "controller.command").get
get_energy = access(Flight, "energy").get
get_faults = access(Environment, "faults").get
get_has_pitot = access(Environment, "sensors.has_pitot").get
get_estimate = access(Flight, "estimate").get
get_reference = access(Reference).get
get_governor = access(Design, "gains.zero_moment.governor").get
put_sample = access(Sample).put
put_jump_entry = access(JumpEntry).put
put_look = access(Diagnostics).put
_tick, _seek, _jump = COMPILED.tick, COMPILED.seek, COMPILED.jump
_is_known, _values, _v_hover = COMPILED.is_known, COMPILED.values, COMPILED.v_hover


@part
def estimate_wind(flight: Kept, column: int, air: Kept, design: Kept, a: Kept, draws: Array, row: int) -> None:
    """Update the wind estimate of a flight on the true state; with sensors the navigation filter estimates the wind."""
    update_wind_estimate(flight, column, air, design, a, draws, row)


@part
def tick(flight: Kept, column: int, reference: Kept, design: Kept) -> None:
    """Compute the commands of the law in force; a part of its own, so that two processes can share the compiling."""
    _tick(get_law(flight, column), flight, column, reference, design)


@part
def move(flight: Kept, column: int, air: Kept, a: Kept, in_force: Actuators) -> None:
    """Move the plant by one control period in air that does not rotate."""
    move_plant(flight, column, air, a, in_force, _wanted(flight, column, air, a, in_force))


@part
def move_in_field(flight: Kept, column: int, air: Kept, a: Kept, field: Kept, in_force: Actuators) -> None:
    """Move the plant by one control period in an arena's rotating air, which does not rotate near the ground."""
    wanted = _wanted(flight, column, air, a, in_force)
    if is_clear(get_plant(flight, column).body, get_ground(air, column)):  # near the ground the air does not turn
        move_in_swirl(flight, column, air, a, field, in_force, wanted)
    else:
        move_plant(flight, column, air, a, in_force, wanted)


@kernel
def _wanted(flight: Kept, column: int, air: Kept, a: Kept, in_force: Actuators) -> Actuators:
    """Positions to which the actuators go."""
    airframe, faults = get_airframe(a, column), get_faults(air, column)
    wanted = within_limits(flight, column, in_force, airframe)
    return wanted if is_whole(faults) else as_they_fail(flight, column, faults, airframe, wanted)


@kernel
def advance(
    flight: Kept,
    column: int,
    reference: Kept,
    air: Kept,
    design: Kept,
    a: Kept,
    gusts: Array,
    draws: Array,
    row: int,
    aboard: Kept,
    steps: Kept,
    fast: Array,
    slow: Array,
    field: Kept,
    swirls: Array,
    schedule: Array,
    bursts: Array,
    solids: Array,
) -> None:
    """One control period, before any jump."""
    update_gust(flight, column, air, gusts, row)
    swirls_here = swirls.shape[0] > 0
    if swirls_here:
        update_field(flight, column, air, field, schedule, bursts, swirls, row)
    sent = get_command(flight, column)
    if fast.shape[0] > 0:
        before = get_plant(flight, column)
        in_force = delayed(aboard["instruments"], sent, get_periods(flight, column))
    else:
        estimate_wind(flight, column, air, design, a, draws, row)
        in_force = sent
    tick(flight, column, reference, design)
    if swirls_here:
        move_in_field(flight, column, air, a, field, in_force)
    else:
        move(flight, column, air, a, in_force)
    if solids.shape[0] > 0:
        touch_solids(flight, column, a, field, solids)
    if fast.shape[0] > 0:
        aboard["filter"]["lands"] = get_is_landing(flight, column)
        wind = add(get_steady_wind(air, column), get_gust(flight, column))
        put_estimate(
            flight,
            column,
            sensed(
                aboard["instruments"], aboard["filter"], steps, a, before, get_plant(flight, column), wind, in_force,
                may_turn(flight, column), get_periods(flight, column), fast, slow, get_has_pitot(air, column),
            ),
        )  # fmt: skip
    run_timers(flight, column)


@part
def due_now(flight: Kept, column: int, reference: Kept, design: Kept) -> int:
    """The row of the jump that is due; -1 in the flow set."""
    return _seek(get_law(flight, column), flight, column, reference, design)


@part
def take_jump(flight: Kept, column: int, row: int, reference: Kept, design: Kept, entry: Kept) -> None:
    """Take a jump and record it, with the values of V before its reset maps."""
    source = get_law(flight, column)
    v_hover, v_forward, _ = _values(flight, column, reference, design)
    _jump(source, row, flight, column, reference, design)
    target, periods, energy = get_law(flight, column), get_periods(flight, column), get_energy(flight, column)
    put_jump_entry(entry, 0, JumpEntry(periods, source, target, row, v_hover, v_forward, energy))


@part
def write_sample(flight: Kept, column: int, reference: Kept, design: Kept, sample: Kept) -> None:
    """Record a sample; V of the linear hover law is recorded whatever law flies."""
    put_sample(sample, 0, sample_of(flight, column, reference, _v_hover(flight, column, reference, design)))


@part
def write_diagnostics(flight: Kept, column: int, reference: Kept, design: Kept, seen: Kept) -> None:
    """Compute the derived values, once per call: they cost more than a period's guards."""
    v_hover, v_forward, v_attitude = _values(flight, column, reference, design)
    e, r = get_estimate(flight, column), get_reference(reference, column)
    governor = activity(subtract(e.position, r.position), e.velocity, r.speed, get_governor(design, column))
    put_look(seen, 0, Diagnostics(v_hover, v_forward, v_attitude, governor))


@whole
def fly(
    flights: Records,
    references: Records,
    airs: Records,
    designs: Records,
    airframes: Records,
    gusts: Array,
    draws: Array,
    periods: int,
    every: int,
    samples: Records,
    jumps: Records,
    diagnostics_rows: Records,
    aboard: Records,
    steps: Records,
    fast: Array,
    slow: Array,
    fields: Records,
    swirls: Array,
    schedule: Array,
    bursts: Array,
    solids: Array,
) -> tuple[int, int, int, int]:
    """Fly one flight for some control periods, taking every jump that falls due.

    Args:
        flights: The flight, a record of :class:`Flight`, changed in place, (1,).
        references: Where to fly, a record of :class:`Reference`, (1,).
        airs: The air and the sensors of it, a record of :class:`Environment`, (1,).
        designs: The controller, a record of :class:`Design`, (1,).
        airframes: The airframe as it is, a record, (1,).
        gusts: Unit normals of the gusts, a row per period; none without gusts, (n, 3, 1).
        draws: Unit normals of the sensors, a row per period: velocity, accelerometer, pitot, (n, 5, 1).
        periods: How many control periods to fly; negative: only look, and take no jump.
        every: Periods between samples, which are taken after the jumps of their instant.
        samples: Receives :class:`Sample` records.
        jumps: Receives :class:`JumpEntry` records.
        diagnostics_rows: Receives what is seen of the flight in the end, a record of :class:`Diagnostics`, (1,).
        aboard: Instruments and filter, a record of :class:`~sitl.simulation.avionics.Aboard`, (1,).
        steps: What the filter has yet to come to, records of Step, (MAX_HORIZON,).
        fast: Draws of the instruments for a block of periods, (n, FAST_COLUMNS); n is 0 where laws see the truth.
        slow: Draws of its slow steps, (n / SLOW, SLOW_COLUMNS).
        fields: The arena's air, a record of :class:`~sitl.enclosure.wind_field.WindField`, (1,).
        swirls: Unit normals of its turbulence, a row per period; none where only the uniform wind blows, (n, 4).
        schedule: Of the wind wall: time and speed, (n, 2).
        bursts: Its 1-cos gusts: begin, duration and rise, (n, 3).
        solids: What may be touched besides the ground, (n, 9).

    Returns:
        Periods flown, samples and jumps written, and how it ended (FLOWN ... JUMPS_FULL).
    """
    flight, reference, air, design, a = flights[0], references[0], airs[0], designs[0], airframes[0]
    column = flights.shape[0] - 1  # 0, but not to the compiler, which would compile the parts for that number alone
    kept = noted = done = chain = column
    end = FLOWN if _is_known(get_law(flight, column)) else UNKNOWN_LAW
    while end == FLOWN and periods >= 0:
        row = due_now(flight, column, reference, design)
        if row >= 0:
            if chain == MAX_CHAIN or noted == jumps.shape[0]:
                end = ZENO if chain == MAX_CHAIN else JUMPS_FULL
                break
            take_jump(flight, column, row, reference, design, jumps[noted])
            noted += 1
            chain += 1
            continue
        chain = 0
        if done == periods:
            break
        if kept < samples.shape[0] and get_periods(flight, column) % every == 0:
            if not is_finite(get_plant(flight, column)):
                break
            write_sample(flight, column, reference, design, samples[kept])
            kept += 1
        advance(
            flight, column, reference, air, design, a, gusts, draws, done, aboard[0], steps, fast, slow, fields[0],
            swirls, schedule, bursts, solids,
        )  # fmt: skip
        done += 1
    if end == FLOWN and not is_finite(get_plant(flight, column)):
        end = DIVERGED
    write_diagnostics(flight, column, reference, design, diagnostics_rows[0])
    return done, kept, noted, end


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
    names = register.compile()._asdict()
    scope = {**globals(), **{f"_{name}": function for name, function in names.items()}}

    def anew(function: Callable[..., Any]) -> Callable[..., Any]:
        code = getattr(function, "py_func", function).__code__
        return types.FunctionType(code, scope, code.co_name)

    for function in (tick, due_now, take_jump, write_sample, write_diagnostics):
        scope[function.__name__] = bare(**UNCOUNTED, **LINKED)(anew(function))
    scope["advance"] = kernel(anew(advance))
    return bare(**UNCOUNTED, **TIED)(anew(fly))  # type: ignore[no-any-return]
