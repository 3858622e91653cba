"""What a telemetry log tells about the flight in it: pure functions from a reader to numbers and names."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from darko_gcs import words
from darko_gcs.mode_names import mode_name
from protocol.codec import Source, source_of
from protocol.dialect import mavlink
from protocol.dialect.vocabulary import DecisionReason, Law, Reason, Way
from protocol.replay import playing_times
from protocol.tlog import Damage, TlogReader, message_name

__all__ = ["Decision", "Flight", "Jump", "MessageCount", "Period", "Summary", "Text", "enum_name", "summarise"]

Floats = NDArray[np.float64]
Columns = dict[str, NDArray[Any]]

_NO_ITEM = 0xFFFF
_GAP = 5.0  # [s]: what happened in a longer silence is not guessed


@dataclass(frozen=True, slots=True)
class MessageCount:
    """One message of one source."""

    name: str
    count: int
    rate: float  # mean over the log [Hz]
    system: int
    component: int


@dataclass(frozen=True, slots=True)
class Period:
    """Something that held from one playing time to another [s]."""

    name: str
    start: float
    end: float


@dataclass(frozen=True, slots=True)
class Jump:
    """One jump of the hybrid controller."""

    time: float  # playing time [s]
    number: int
    law_from: str
    law_to: str
    reason: str
    v: float  # value of the guard's function, NaN when it has none
    name: str


@dataclass(frozen=True, slots=True)
class Decision:
    """How one leg was to be flown; an impossible way takes infinite time."""

    time: float  # playing time [s]
    seq: int | None  # mission item at the end of the leg
    way: str
    reason: str
    distance: float  # [m]
    climb: float  # [m]
    hover_time: float  # [s]
    hover_energy: float  # [J]
    forward_time: float
    forward_energy: float


@dataclass(frozen=True, slots=True)
class Text:
    """One STATUSTEXT, its chunks put together."""

    time: float  # playing time [s]
    severity: str
    text: str
    system: int
    component: int


@dataclass(frozen=True, slots=True)
class Flight:
    """What one vehicle did."""

    system: int
    component: int
    type: str
    autopilot: str
    modes: tuple[Period, ...]
    armed: tuple[Period, ...]
    distance: float | None  # flown while armed [m]
    height: float | None  # highest above the local frame's origin [m]
    speed: float | None  # fastest over ground [m/s]
    cross_track_rms: float | None  # off the path while armed [m]
    cross_track_max: float | None
    laws: dict[str, float]  # vehicle's time in each control law [s]
    energy: dict[str, float]  # taken in each control law [J]
    vtol: tuple[Period, ...]  # hover, forward flight and the transitions between them
    decisions: tuple[Decision, ...]
    jumps: tuple[Jump, ...]


@dataclass(frozen=True, slots=True)
class Summary:
    """What is in a log."""

    size: int  # [byte]
    records: int
    start_usec: int  # since 1970
    duration: float  # [s]
    version_1: int
    version_2: int
    signed: int
    unknown: int  # records outside the dialect, whose checksum cannot be verified
    clock_steps: int  # times the recording clock went back,
    clock_back: float  # and by how much at the most [s]
    flights: tuple[Flight, ...]
    stations: tuple[Source, ...]  # other sources that sent a HEARTBEAT
    messages: tuple[MessageCount, ...]
    texts: tuple[Text, ...]
    damage: tuple[Damage, ...]


@np.errstate(invalid="ignore", over="ignore")  # a log may hold any bits: what comes of them is shown, or is none
def summarise(reader: TlogReader) -> Summary:
    """Everything there is to say about a log of at least one record."""
    times = playing_times(reader.times)
    beats = _sources(reader, reader.rows("HEARTBEAT"))
    flights = tuple(_flight(reader, times, source) for source in beats if _is_vehicle(reader, source))
    vehicles = {(flight.system, flight.component) for flight in flights}
    return Summary(
        size=reader.size,
        records=len(reader),
        start_usec=int(reader.times[0]),
        duration=float(times[-1]),
        version_1=int((reader.versions == 1).sum()),
        version_2=int((reader.versions == 2).sum()),
        signed=int(reader.signed.sum()),
        unknown=int((~reader.known).sum()),
        clock_steps=len(reader.backward),
        clock_back=float(-np.diff(reader.times).min(initial=0)) / 1e6,
        flights=flights,
        stations=tuple(source for source in beats if source not in vehicles),
        messages=_counts(reader, float(times[-1])),
        texts=_texts(reader, times),
        damage=reader.damage,
    )


def enum_name(enum: str, value: int) -> str:
    """Entry of a dialect's enum without the enum's own name, or the number."""
    entry = mavlink.enums[enum].get(value)
    return str(value) if entry is None else str(entry.name).removeprefix(f"{enum}_")


def _sources(reader: TlogReader, rows: NDArray[np.int64]) -> list[Source]:
    pairs = np.stack((reader.systems[rows], reader.components[rows]), axis=1)
    return [(int(system), int(component)) for system, component in np.unique(pairs, axis=0)]


def _is_vehicle(reader: TlogReader, source: Source) -> bool:
    kinds = reader.columns("HEARTBEAT", source)["autopilot"]
    return bool(np.any(kinds != mavlink.MAV_AUTOPILOT_INVALID))


def _counts(reader: TlogReader, duration: float) -> tuple[MessageCount, ...]:
    kinds = np.stack((reader.ids, reader.systems, reader.components), axis=1)
    kinds, counts = np.unique(kinds, axis=0, return_counts=True)
    found = [
        MessageCount(message_name(number), count, count / duration if duration else 0.0, system, component)
        for (number, system, component), count in zip(kinds.tolist(), counts.tolist(), strict=True)
    ]
    return tuple(sorted(found, key=lambda message: (message.system, message.component, message.name)))


def _texts(reader: TlogReader, times: Floats) -> tuple[Text, ...]:
    texts: list[Text] = []
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
        texts.append(Text(float(times[row]), enum_name("MAV_SEVERITY", message.severity), message.text, *source))
    return tuple(texts)


def _flight(reader: TlogReader, times: Floats, source: Source) -> Flight:
    rows, beats = reader.rows("HEARTBEAT", source), reader.columns("HEARTBEAT", source)
    end = float(times[-1])
    modes = _mode_names(beats)
    armed = (beats["base_mode"].astype(np.int64) & int(mavlink.MAV_MODE_FLAG_SAFETY_ARMED)) != 0
    distance, height, speed = _path(reader, times, source, rows, armed)
    cross_track = _cross_track(reader, source, rows, armed)
    return Flight(
        system=source[0],
        component=source[1],
        type=enum_name("MAV_TYPE", int(beats["type"][-1])),
        autopilot=enum_name("MAV_AUTOPILOT", int(beats["autopilot"][-1])),
        modes=tuple(_periods(times[rows], modes, end)),
        armed=tuple(p for p in _periods(times[rows], ["armed" if a else "" for a in armed], end) if p.name),
        distance=distance,
        height=height,
        speed=speed,
        cross_track_rms=None if cross_track is None else float(np.sqrt(np.mean(cross_track**2))),
        cross_track_max=None if cross_track is None else float(np.max(np.abs(cross_track))),
        laws=_laws(reader, source),
        energy=_energy(reader, source),
        vtol=_vtol(reader, times, source),
        decisions=_decisions(reader, times, source),
        jumps=_jumps(reader, times, source),
    )


def _mode_names(beats: Columns) -> list[str]:
    told = zip(*(beats[field].tolist() for field in ("autopilot", "type", "custom_mode")), strict=True)
    return [mode_name(autopilot, kind, number) or f"mode {number}" for autopilot, kind, number in told]


def _periods(times: Floats, names: list[str], end: float) -> list[Period]:
    """Runs of equal names; each lasts until the next begins, the last until the end of the log."""
    begins = [k for k, name in enumerate(names) if k == 0 or name != names[k - 1]]
    return [
        Period(names[k], float(times[k]), end if following is None else float(times[following]))
        for k, following in pairwise([*begins, None])
        if k is not None
    ]


def _path(
    reader: TlogReader, times: Floats, source: Source, beat_rows: NDArray[np.int64], armed: NDArray[np.bool_]
) -> tuple[float | None, float | None, float | None]:
    """Distance flown while armed [m], greatest height [m] and speed [m/s]; None where no message tells."""
    name = "LOCAL_POSITION_NED" if len(reader.rows("LOCAL_POSITION_NED", source)) else "GLOBAL_POSITION_INT"
    rows, fields = reader.rows(name, source), reader.columns(name, source)
    if not len(rows):
        return None, None, None
    position, velocity = (_local if name == "LOCAL_POSITION_NED" else _geodetic)(fields)
    steps = np.linalg.norm(np.diff(position, axis=0), axis=1)
    flying = _armed_at(rows, beat_rows, armed)
    counted = flying[1:] & flying[:-1] & (np.diff(times[rows]) < _GAP)
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
    """Every distance from the path while armed [m]; None where none is told."""
    off = reader.columns("NAV_CONTROLLER_OUTPUT", source)["xtrack_error"].astype(np.float64)
    off = off[_armed_at(reader.rows("NAV_CONTROLLER_OUTPUT", source), beat_rows, armed) & np.isfinite(off)]
    return off if len(off) else None


def _local(fields: Columns) -> tuple[Floats, Floats]:
    """Positions NED [m] and velocities NED [m/s], shape (n, 3)."""
    return (
        np.stack([fields[axis].astype(np.float64) for axis in ("x", "y", "z")], axis=1),
        np.stack([fields[axis].astype(np.float64) for axis in ("vx", "vy", "vz")], axis=1),
    )


def _geodetic(fields: Columns) -> tuple[Floats, Floats]:
    """The same from GLOBAL_POSITION_INT, on a plane at the first fix; without a fix (0, 0) it is NaN.

    Lengths are good to half a percent (the earth is a sphere here) within some tens of kilometres.
    """
    lat, lon = (np.radians(fields[angle] * 1e-7) for angle in ("lat", "lon"))
    fixed = (lat != 0.0) | (lon != 0.0)
    radius = np.where(fixed, 6_371_000.0, np.nan)
    north, east = lat * radius, lon * radius * np.cos(lat[np.argmax(fixed)])
    down = fields["relative_alt"] * -1e-3
    velocity = np.stack([fields[axis] * 1e-2 for axis in ("vx", "vy", "vz")], axis=1)
    return np.stack((north, east, down), axis=1), velocity


def _laws(reader: TlogReader, source: Source) -> dict[str, float]:
    """Time in each control law [s], on the vehicle's clock: a simulation may have run faster than its recorder."""
    states = reader.columns("DARKO_HYBRID_STATE", source)
    laws = states["law"][:-1]
    steps = np.diff(states["time_boot_ms"].astype(np.float64) / 1e3)
    steps = np.where((steps > 0.0) & (steps < _GAP), steps, 0.0)
    return {words.name(Law, number): float(steps[laws == number].sum()) for number in np.unique(laws).tolist()}


def _energy(reader: TlogReader, source: Source) -> dict[str, float]:
    """Energy taken in each control law [J]; a vehicle that restarts counts from nought again."""
    totals = reader.columns("DARKO_ENERGY", source)["energy_by_law"].astype(np.float64)
    taken = np.nansum(np.clip(np.diff(totals, axis=0), 0.0, None), axis=0)
    return {words.name(Law, law): joules for law, joules in enumerate(taken.tolist()) if joules > 0.0}


def _vtol(reader: TlogReader, times: Floats, source: Source) -> tuple[Period, ...]:
    rows = reader.rows("EXTENDED_SYS_STATE", source)
    states = reader.columns("EXTENDED_SYS_STATE", source)["vtol_state"]
    if not np.any(states):  # MAV_VTOL_STATE_UNDEFINED: no VTOL vehicle
        return ()
    return tuple(_periods(times[rows], [enum_name("MAV_VTOL_STATE", int(v)) for v in states], float(times[-1])))


def _decisions(reader: TlogReader, times: Floats, source: Source) -> tuple[Decision, ...]:
    rows, fields = reader.rows("DARKO_DECISION", source), reader.columns("DARKO_DECISION", source)
    numbers = ("distance", "climb", "hover_time", "hover_energy", "forward_time", "forward_energy")
    return tuple(
        Decision(
            time=float(times[row]),
            seq=None if fields["seq"][k] == _NO_ITEM else int(fields["seq"][k]),
            way=words.name(Way, int(fields["way"][k])),
            reason=words.name(DecisionReason, int(fields["reason"][k])),
            **{name: float(fields[name][k]) for name in numbers},
        )
        for k, row in enumerate(rows.tolist())
    )


def _jumps(reader: TlogReader, times: Floats, source: Source) -> tuple[Jump, ...]:
    rows, fields = reader.rows("DARKO_JUMP", source), reader.columns("DARKO_JUMP", source)
    return tuple(
        Jump(
            time=float(times[row]),
            number=int(fields["jump"][k]),
            law_from=words.name(Law, int(fields["law_from"][k])),
            law_to=words.name(Law, int(fields["law_to"][k])),
            reason=words.name(Reason, int(fields["reason"][k])),
            v=float(fields["v"][k]),
            name=fields["name"][k].decode("ascii", "replace"),
        )
        for k, row in enumerate(rows.tolist())
    )
