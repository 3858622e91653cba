"""The vehicles of a telemetry log, and a summary of the flights of one: from a reader to numbers and names."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import DecisionReason, Law, LegMode, Reason
from protocol.errors import FileError
from protocol.flight_log.flight_clock import FlightClock, flight_clock
from protocol.flight_log.flown_legs import LoggedLeg, flown_legs
from protocol.names import enum_name, mode_name, name_of
from protocol.tlog import Damage, TlogReader, message_name
from protocol.units import NO_ITEM
from protocol.wire.message import Source, source_of


def vehicles(reader: TlogReader) -> list[Source]:
    """(system, component) of each vehicle that sent a HEARTBEAT."""
    return [source for source in _sources(reader, reader.rows("HEARTBEAT")) if _is_vehicle(reader, source)]


def stations(reader: TlogReader) -> list[Source]:
    """Other sources that sent a HEARTBEAT."""
    return [source for source in _sources(reader, reader.rows("HEARTBEAT")) if not _is_vehicle(reader, source)]


def chosen_vehicle(reader: TlogReader, name: str, system: int | None = None) -> Source:
    """A vehicle of a log.

    Args:
        reader: The log.
        name: What errors call it.
        system: System id; None: the first vehicle.

    Raises:
        FileError: There is none, or none with this id.
    """
    found = vehicles(reader)
    if not found:
        raise FileError(f"{name}: no vehicle sent a HEARTBEAT in this log")
    chosen = [source for source in found if system in {None, source[0]}]
    if not chosen:
        raise FileError(f"{name}: no vehicle {system} in this log; it has {_listed(found)}")
    return chosen[0]


def log_clock(reader: TlogReader, name: str, system: int | None = None) -> FlightClock:
    """The clock of a vehicle of a log; of a log without one the recorder's. Errors as of ``chosen_vehicle``."""
    is_bare = system is None and not vehicles(reader)
    return flight_clock(reader, (0, 0) if is_bare else chosen_vehicle(reader, name, system))


def of_vehicle(reader: TlogReader, name: str, system: int) -> TlogReader:
    """The log without other vehicles than the one with a system id; errors as of ``chosen_vehicle``."""
    taken = chosen_vehicle(reader, name, system)
    others = [source[0] for source in vehicles(reader) if source[0] != taken[0]]
    return reader.only(~np.isin(reader.systems, others))


def others_note(reader: TlogReader, taken: Source) -> str:
    """Note that names the vehicle taken of several; empty if the log has no other."""
    others = [source for source in vehicles(reader) if source != taken]
    if not others:
        return ""
    return f"vehicle {taken[0]}/{taken[1]} is taken; the log also has {_listed(others)} (--vehicle ID)"


def damage_note(reader: TlogReader) -> str:
    """Note of the damage in a log of another kind; empty if there is none, and for telemetry logs, often damaged."""
    if reader.origin is None or not reader.damage:
        return ""
    first, count = reader.damage[0], len(reader.damage)
    places = "once" if count == 1 else f"in {count:,} places, first"
    return f"damaged {places} at byte {first.offset:,}: {first.what}"


def _listed(found: Sequence[Source]) -> str:
    return ("vehicle " if len(found) == 1 else "vehicles ") + ", ".join(f"{one}/{two}" for one, two in found)


def _sources(reader: TlogReader, rows: NDArray[np.int64]) -> list[Source]:
    pairs = np.stack((reader.systems[rows], reader.components[rows]), axis=1)
    return [(int(system), int(component)) for system, component in np.unique(pairs, axis=0)]


def _is_vehicle(reader: TlogReader, source: Source) -> bool:
    kinds = reader.columns("HEARTBEAT", source)["autopilot"]
    return bool(np.any(kinds != mavlink.MAV_AUTOPILOT_INVALID))


Floats = NDArray[np.float64]
Columns = Mapping[str, NDArray[Any]]

TELEMETRY_LOG = "telemetry log"  # the format that is no other
_MAX_GAP = 5.0  # between messages of a flight; nothing is assumed about a longer gap [s]
_EARTH_RADIUS = 6_371_000.0  # [m]


@dataclass(frozen=True, slots=True, kw_only=True)
class MessageCount:
    """Number and rate of one message from one source."""

    name: str
    count: int
    rate: float  # mean over the log [Hz]
    system: int
    component: int


@dataclass(frozen=True, slots=True)
class Period:
    """A state and the times in the log [s] from which and until which it lasted."""

    name: str
    start: float
    end: float


@dataclass(frozen=True, slots=True, kw_only=True)
class LoggedJump:
    """One jump of the hybrid controller."""

    time: float  # in the log [s]
    number: int
    law_from: str
    law_to: str
    reason: str
    v: float  # Lyapunov value of the guard; NaN for a guard without one
    name: str


@dataclass(frozen=True, slots=True, kw_only=True)
class LoggedDecision:
    """Hover or forward flight on one leg; the time of an impossible one is infinite."""

    time: float  # in the log [s]
    seq: int | None  # mission item at the end of the leg
    way: str
    reason: str
    distance: float  # [m]
    climb: float  # [m]
    hover_time: float  # [s]
    hover_energy: float  # [J]
    forward_time: float  # [s]
    forward_energy: float  # [J]


@dataclass(frozen=True, slots=True, kw_only=True)
class LoggedText:
    """One STATUSTEXT, its chunks joined."""

    time: float  # in the log [s]
    severity: str
    text: str
    system: int
    component: int


@dataclass(frozen=True, slots=True, kw_only=True)
class LoggedFlight:
    """The flights of one vehicle."""

    system: int
    component: int
    type: str
    autopilot: str
    clock_rate: float = 1.0  # how much faster than the recorder's clock the vehicle's ran, which has the times here
    modes: tuple[Period, ...]
    armed: tuple[Period, ...]
    distance: float | None  # flown while armed [m]
    height: float | None  # maximum above the local frame's origin [m]
    speed: float | None  # maximum over ground [m/s]
    cross_track_rms: float | None  # distance from the path while armed [m]
    cross_track_max: float | None  # [m]
    laws: dict[str, float]  # vehicle's time in each control law [s]
    energy: dict[str, float]  # used in each control law [J]
    vtol: tuple[Period, ...]  # hover, forward flight and the transitions between them
    decisions: tuple[LoggedDecision, ...]
    jumps: tuple[LoggedJump, ...]
    legs: tuple[LoggedLeg, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class LogSummary:
    """Contents of a log."""

    size: int  # [byte]
    format: str = TELEMETRY_LOG  # or the kind of the file whose content is told as messages
    records: int
    start_usec: int  # since 1970
    byte_order: str  # of the time stamps: big or little
    duration: float  # [s]
    version_1: int
    version_2: int
    signed: int
    unknown: int  # records outside the dialect, whose checksum cannot be verified
    clock_steps: int  # how often the recording clock went back
    clock_back: float  # largest of these steps [s]
    clock_set_forward: int  # how often it was set forward: no time of the flight
    clock_forward: float  # largest of these leaps [s]
    flights: tuple[LoggedFlight, ...]
    stations: tuple[Source, ...]  # other sources that sent a HEARTBEAT
    messages: tuple[MessageCount, ...]
    texts: tuple[LoggedText, ...]
    damage: tuple[Damage, ...]


@np.errstate(invalid="ignore", over="ignore")  # a log may hold any bits, also NaN and infinite numbers
def summarise(reader: TlogReader, system: int | None = None) -> LogSummary:
    """The summary of a log with at least one record; with a system id, of its vehicle's messages and texts alone."""
    clock = reader.clock
    duration = float(clock.playing[-1])
    clocks = {source: flight_clock(reader, source) for source in vehicles(reader)}
    flights = tuple(_flight(own) for source, own in clocks.items() if system in {None, source[0]})
    return LogSummary(
        size=reader.size,
        format=TELEMETRY_LOG if reader.origin is None else reader.origin.kind,
        records=len(reader),
        start_usec=clock.start_usec,
        byte_order=reader.byte_order,
        duration=duration,
        version_1=int((reader.versions == 1).sum()),
        version_2=int((reader.versions == 2).sum()),
        signed=int(reader.signed.sum()),
        unknown=int((~reader.known).sum()),
        clock_steps=len(reader.backward),
        clock_back=float(-np.diff(reader.times).min(initial=0)) / 1e6,
        clock_set_forward=len(clock.forward),
        clock_forward=float(clock.steps(clock.forward).max(initial=0.0)),
        flights=flights,
        stations=tuple(stations(reader)),
        messages=tuple(each for each in _counts(reader, duration) if system in {None, each.system}),
        texts=tuple(each for each in _texts(reader, clocks) if system in {None, each.system}),
        damage=reader.damage,
    )


def _counts(reader: TlogReader, duration: float) -> tuple[MessageCount, ...]:
    kinds = np.stack((reader.ids, reader.systems, reader.components), axis=1)
    kinds, counts = np.unique(kinds, axis=0, return_counts=True)
    found = [
        MessageCount(
            name=message_name(number),
            count=count,
            rate=count / duration if duration else 0.0,
            system=system,
            component=component,
        )
        for (number, system, component), count in zip(kinds.tolist(), counts.tolist(), strict=True)
    ]
    return tuple(sorted(found, key=lambda message: (message.system, message.component, message.name)))


def _texts(reader: TlogReader, clocks: Mapping[Source, FlightClock]) -> tuple[LoggedText, ...]:
    """Texts of all sources; those of no vehicle stand by the first vehicle's clock."""
    others = next((clock.arrivals for clock in clocks.values()), reader.clock.playing)
    texts: list[LoggedText] = []
    last: dict[Source, int] = {}
    for row in reader.rows("STATUSTEXT").tolist():
        if (message := reader.decode(row)) is None:
            continue
        source = source_of(message)
        if message.id and message.chunk_seq and source in last:
            first = texts[last[source]]
            texts[last[source]] = replace(first, text=first.text + message.text)
            continue
        last[source] = len(texts)
        texts.append(
            LoggedText(
                time=float(clocks[source].arrivals[row] if source in clocks else others[row]),
                severity=enum_name("MAV_SEVERITY", message.severity),
                text=message.text,
                system=source[0],
                component=source[1],
            )
        )
    return tuple(texts)


def _flight(clock: FlightClock) -> LoggedFlight:
    reader, source, times = clock.reader, clock.source, clock.arrivals
    rows, beats = reader.rows("HEARTBEAT", source), reader.columns("HEARTBEAT", source)
    end = float(times[-1])
    modes = _mode_names(beats)
    armed = (beats["base_mode"].astype(np.int64) & int(mavlink.MAV_MODE_FLAG_SAFETY_ARMED)) != 0
    distance, height, speed = _path(reader, clock, source, rows, armed)
    cross_track = _cross_track(reader, source, rows, armed)
    return LoggedFlight(
        system=source[0],
        component=source[1],
        type=enum_name("MAV_TYPE", int(beats["type"][-1])),
        autopilot=enum_name("MAV_AUTOPILOT", int(beats["autopilot"][-1])),
        clock_rate=clock.rate,
        modes=tuple(_periods(times[rows], modes, end)),
        armed=tuple(p for p in _periods(times[rows], ["armed" if a else "" for a in armed], end) if p.name),
        distance=distance,
        height=height,
        speed=speed,
        cross_track_rms=None if cross_track is None else float(np.sqrt(np.mean(cross_track**2))),
        cross_track_max=None if cross_track is None else float(np.max(np.abs(cross_track))),
        laws=_laws(reader, clock, source),
        energy=_energy(reader, clock, source),
        vtol=_vtol(reader, times, source),
        decisions=_decisions(clock),
        jumps=_jumps(clock),
        legs=flown_legs(clock),
    )


def _mode_names(beats: Columns) -> list[str]:
    rows = zip(*(beats[field].tolist() for field in ("autopilot", "type", "custom_mode")), strict=True)
    return [mode_name(autopilot, kind, number) or f"mode {number}" for autopilot, kind, number in rows]


def _periods(times: Floats, names: list[str], end: float) -> list[Period]:
    """Runs of equal names; each lasts until the next begins, the last one until the end of the log [s]."""
    begins = [k for k, name in enumerate(names) if k == 0 or name != names[k - 1]]
    return [
        Period(names[k], float(times[k]), end if following is None else float(times[following]))
        for k, following in pairwise([*begins, None])
        if k is not None
    ]


def _path(
    reader: TlogReader, clock: FlightClock, source: Source, beat_rows: NDArray[np.int64], armed: NDArray[np.bool_]
) -> tuple[float | None, float | None, float | None]:
    """Distance flown while armed [m], maximum height [m] and speed [m/s]; None without a message with positions."""
    name = "LOCAL_POSITION_NED" if len(reader.rows("LOCAL_POSITION_NED", source)) else "GLOBAL_POSITION_INT"
    rows, fields = reader.rows(name, source), reader.columns(name, source)
    if not len(rows):
        return None, None, None
    position, velocity = (_local if name == "LOCAL_POSITION_NED" else _geodetic)(fields)
    order = _order(clock, name)
    steps = np.linalg.norm(np.diff(position[order], axis=0), axis=1)
    flying = _armed_at(rows, beat_rows, armed)[order]
    counted = flying[1:] & flying[:-1] & (np.diff(clock.reader.clock.playing[rows]) < _MAX_GAP)
    height = float(np.nanmax(-position[:, 2], initial=0.0))
    speed = float(np.nanmax(np.linalg.norm(velocity, axis=1), initial=0.0))
    return float(np.nansum(steps[counted])), height, speed


def _armed_at(rows: NDArray[np.int64], beat_rows: NDArray[np.int64], armed: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Whether the vehicle was armed at each of some records, by the HEARTBEAT before it."""
    flying = np.zeros(len(rows), dtype=np.bool_)
    beat = np.searchsorted(beat_rows, rows) - 1
    flying[beat >= 0] = armed[beat[beat >= 0]]
    return flying


def _cross_track(
    reader: TlogReader, source: Source, beat_rows: NDArray[np.int64], armed: NDArray[np.bool_]
) -> Floats | None:
    """Distances from the path while armed [m]; None without any."""
    errors = reader.columns("NAV_CONTROLLER_OUTPUT", source)["xtrack_error"].astype(np.float64)
    flying = _armed_at(reader.rows("NAV_CONTROLLER_OUTPUT", source), beat_rows, armed)
    errors = errors[flying & np.isfinite(errors)]
    return errors if len(errors) else None


def _local(fields: Columns) -> tuple[Floats, Floats]:
    """Positions NED [m] and velocities NED [m/s], shape (n, 3)."""
    return (
        np.stack([fields[axis].astype(np.float64) for axis in ("x", "y", "z")], axis=1),
        np.stack([fields[axis].astype(np.float64) for axis in ("vx", "vy", "vz")], axis=1),
    )


def _geodetic(fields: Columns) -> tuple[Floats, Floats]:
    """Positions NED [m] and velocities NED [m/s] from GLOBAL_POSITION_INT, shape (n, 3).

    On a plane through the first fix; positions without a fix, (0, 0), are NaN. The earth is a sphere here: lengths are
    correct to half a percent within some tens of kilometres.
    """
    lat, lon = (np.radians(fields[angle] * 1e-7) for angle in ("lat", "lon"))
    fixed = (lat != 0.0) | (lon != 0.0)
    radius = np.where(fixed, _EARTH_RADIUS, np.nan)
    north, east = lat * radius, lon * radius * np.cos(lat[np.argmax(fixed)])
    down = fields["relative_alt"] * -1e-3
    velocity = np.stack([fields[axis] * 1e-2 for axis in ("vx", "vy", "vz")], axis=1)
    return np.stack((north, east, down), axis=1), velocity


def _order(clock: FlightClock, name: str) -> NDArray[np.int64]:
    """Messages in the order in which they were made: late ones stand where they belong."""
    return np.argsort(clock.times_of(name), kind="stable")


def _laws(reader: TlogReader, clock: FlightClock, source: Source) -> dict[str, float]:
    """Time in each control law [s], on the vehicle's clock: a simulation may run faster than the recorder's clock."""
    states = reader.columns("DARKO_HYBRID_STATE", source)
    order = _order(clock, "DARKO_HYBRID_STATE")
    laws = states["law"][order][:-1]
    steps = np.diff(states["time_boot_ms"][order].astype(np.float64) / 1e3)
    steps = np.where((steps > 0.0) & (steps < _MAX_GAP), steps, 0.0)
    return {name_of(Law, number): float(steps[laws == number].sum()) for number in np.unique(laws).tolist()}


def _energy(reader: TlogReader, clock: FlightClock, source: Source) -> dict[str, float]:
    """Energy used in each control law [J]; after a restart, the vehicle counts from zero."""
    order = _order(clock, "DARKO_ENERGY")
    totals = reader.columns("DARKO_ENERGY", source)["energy_by_law"][order].astype(np.float64)
    used = np.nansum(np.clip(np.diff(totals, axis=0), 0.0, None), axis=0)
    return {name_of(Law, law): joules for law, joules in enumerate(used.tolist()) if joules > 0.0}


def _vtol(reader: TlogReader, times: Floats, source: Source) -> tuple[Period, ...]:
    rows = reader.rows("EXTENDED_SYS_STATE", source)
    states = reader.columns("EXTENDED_SYS_STATE", source)["vtol_state"]
    if not np.any(states):  # MAV_VTOL_STATE_UNDEFINED: not a VTOL vehicle
        return ()
    return tuple(_periods(times[rows], [enum_name("MAV_VTOL_STATE", int(v)) for v in states], float(times[-1])))


def _decisions(clock: FlightClock) -> tuple[LoggedDecision, ...]:
    times, fields = clock.times_of("DARKO_DECISION"), clock.reader.columns("DARKO_DECISION", clock.source)
    numbers = ("distance", "climb", "hover_time", "hover_energy", "forward_time", "forward_energy")
    return tuple(
        LoggedDecision(
            time=time,
            seq=None if fields["seq"][k] == NO_ITEM else int(fields["seq"][k]),
            way=name_of(LegMode, int(fields["way"][k])),
            reason=name_of(DecisionReason, int(fields["reason"][k])),
            **{name: float(fields[name][k]) for name in numbers},
        )
        for k, time in enumerate(times.tolist())
    )


def _jumps(clock: FlightClock) -> tuple[LoggedJump, ...]:
    times, fields = clock.times_of("DARKO_JUMP"), clock.reader.columns("DARKO_JUMP", clock.source)
    return tuple(
        LoggedJump(
            time=time,
            number=int(fields["jump"][k]),
            law_from=name_of(Law, int(fields["law_from"][k])),
            law_to=name_of(Law, int(fields["law_to"][k])),
            reason=name_of(Reason, int(fields["reason"][k])),
            v=float(fields["v"][k]),
            name=fields["name"][k].decode("ascii", "replace"),
        )
        for k, time in enumerate(times.tolist())
    )
