"""One recorded flight as time series, from whatever messages its vehicle sends, and the obstacles around it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from protocol.dialect.vocabulary import Law
from protocol.flight_log.flight_clock import FlightClock, flight_clock
from protocol.flight_log.flight_summary import LoggedFlight, LogSummary, chosen_vehicle, summarise
from protocol.frames import Geodetic, LocalFrame
from protocol.names import law_words, name_of
from protocol.tlog import TlogReader
from protocol.units import from_e7, from_millimetres
from protocol.wire.message import Source


@dataclass(frozen=True, slots=True)
class Prism:
    """A solid, or a room of which only the edges are drawn."""

    name: str
    corners: tuple[tuple[float, float], ...]  # north, east [m], in order
    bottom: float  # above the origin [m]
    top: float  # [m]
    hollow: bool = False  # only its edges are drawn: an arena, a net


Floats = NDArray[np.float64]
ALARMING = frozenset({"EMERGENCY", "ALERT", "CRITICAL", "ERROR", "WARNING"})  # severities of texts
ALARMING_LAWS = frozenset({Law.FAILSAFE.name, Law.CRASHED.name})


@dataclass(frozen=True, slots=True)
class Series:
    """Samples of one message.

    Attributes:
        times: Since the vehicle was switched on, by its own clock [s], shape (n,).
        fields: By the message's field names, in wire units, each of shape (n,) or (n, count).
    """

    times: Floats
    fields: dict[str, Floats]

    def __len__(self) -> int:
        return len(self.times)


NOTHING = Series(np.zeros(0), {})


@dataclass(frozen=True, slots=True)
class FlightEvent:
    """Something that happened once."""

    time: float  # on the vehicle's clock [s]
    kind: str  # jump, mode, armed, text, or alarm: a text of a warning or worse, a crash
    text: str
    label: str = ""  # a word or two that stand beside its mark in a chart


@dataclass(frozen=True, slots=True)
class FlightSeries:
    """Time series of one vehicle's flight for a page; a series is empty where the vehicle sent no such message."""

    name: str
    summary: LoggedFlight
    duration: float  # on the vehicle's clock [s]
    position: Series  # LOCAL_POSITION_NED, or in its fields and units GLOBAL_POSITION_INT, from its first place
    truth: Series  # DARKO_TRUTH, in the frame of LOCAL_POSITION_NED
    target: Series  # POSITION_TARGET_LOCAL_NED, in the same frame
    hybrid: Series  # DARKO_HYBRID_STATE
    actuators: Series  # DARKO_ACTUATORS
    servos: Series  # SERVO_OUTPUT_RAW
    energy: Series  # DARKO_ENERGY
    battery: Series  # SYS_STATUS
    air: Series  # DARKO_AIR
    attitude: Series  # ATTITUDE
    events: tuple[FlightEvent, ...] = field(default=())
    start_usec: int = 0  # when the recording began, since 1970 [us]; 0: not known

    def with_events(self, events: Sequence[FlightEvent]) -> FlightSeries:
        """The same flight with other events."""
        return replace(self, events=tuple(events))

    def laws(self) -> NDArray[np.str_]:
        """The law in force at each sample of ``position``; empty names without DARKO_HYBRID_STATE."""
        if not len(self.hybrid):
            return np.full(len(self.position), "")
        at = np.clip(np.searchsorted(self.hybrid.times, self.position.times, side="right") - 1, 0, None)
        numbers = self.hybrid.fields["law"][at].astype(int)
        return np.array([name_of(Law, number) for number in numbers.tolist()])


def flight_series(reader: TlogReader, name: str, vehicle: int | None = None) -> FlightSeries:
    """A vehicle's flight in a log.

    Args:
        reader: The log.
        name: What to call it.
        vehicle: System id; None: the first vehicle.

    Raises:
        FileError: The log has no vehicle, or none with this id.
    """
    source = chosen_vehicle(reader, name, vehicle)
    summary = summarise(reader, source[0])
    flight = next(each for each in summary.flights if (each.system, each.component) == source)
    clock = flight_clock(reader, source)

    def series(message: str) -> Series:
        return _series(reader, message, source, clock.times)

    position = series("LOCAL_POSITION_NED")
    is_local = len(position) > 0
    return FlightSeries(
        name=name,
        summary=flight,
        duration=float(clock.arrivals[-1] - clock.arrivals[0]),
        position=position if is_local else _from_first_place(series("GLOBAL_POSITION_INT")),
        truth=series("DARKO_TRUTH") if is_local else NOTHING,
        target=series("POSITION_TARGET_LOCAL_NED") if is_local else NOTHING,
        hybrid=series("DARKO_HYBRID_STATE"),
        actuators=series("DARKO_ACTUATORS"),
        servos=series("SERVO_OUTPUT_RAW"),
        energy=series("DARKO_ENERGY"),
        battery=series("SYS_STATUS"),
        air=series("DARKO_AIR"),
        attitude=series("ATTITUDE"),
        events=_events(summary, flight, clock),
        start_usec=summary.start_usec,
    )


def _series(reader: TlogReader, message: str, source: Source, times: Floats) -> Series:
    rows, columns = reader.rows(message, source), reader.columns(message, source)
    order = np.argsort(times[rows], kind="stable")  # a late message stands where it was made
    numbers = {name: column.astype(np.float64)[order] for name, column in columns.items() if column.dtype.kind in "fiu"}
    return Series(times[rows][order], numbers)


def _from_first_place(globe: Series) -> Series:
    """Positions on the globe as LOCAL_POSITION_NED would tell them, from the first one and the height of home."""
    fields = globe.fields
    fixed = (fields["lat"] != 0.0) | (fields["lon"] != 0.0)  # until then it does not know its place
    if not fixed.any():
        return NOTHING
    places = [
        Geodetic(from_e7(lat), from_e7(lon), from_millimetres(alt))
        for lat, lon, alt in zip(*(fields[name][fixed].tolist() for name in ("lat", "lon", "alt")), strict=True)
    ]
    frame = LocalFrame(places[0])
    north, east, _ = np.array([frame.to_ned(place) for place in places]).T
    down = -fields["relative_alt"][fixed] / 1e3
    speeds = {name: fields[name][fixed] / 100.0 for name in ("vx", "vy", "vz")}
    return Series(globe.times[fixed], {"x": north, "y": east, "z": down, **speeds})


def _events(summary: LogSummary, flight: LoggedFlight, clock: FlightClock) -> tuple[FlightEvent, ...]:
    """Jumps, changes of mode, arming and texts, by time."""
    source = (flight.system, flight.component)
    found = []
    for jump in flight.jumps:
        left, entered = law_words(jump.law_from), law_words(jump.law_to)
        kind = "alarm" if jump.law_to in ALARMING_LAWS else "jump"
        found.append((jump.time, kind, f"{left} to {entered} ({_words(jump.name)})", entered))
    found += [(mode.start, "mode", f"mode {mode.name}", mode.name) for mode in flight.modes]
    for period in flight.armed:
        found.append((period.start, "armed", "motors armed", "armed"))
        found.append((period.end, "armed", "motors disarmed", "disarmed"))
    found += [
        (text.time, "alarm" if text.severity in ALARMING else "text", text.text, "")
        for text in summary.texts
        if (text.system, text.component) == source
    ]
    times = clock.at(np.array([event[0] for event in found])).tolist()
    events = [FlightEvent(at, *event[1:]) for at, event in zip(times, found, strict=True)]
    return tuple(sorted(events, key=lambda event: event.time))


def _words(name: str) -> str:
    return name.replace("_", " ").lower()
