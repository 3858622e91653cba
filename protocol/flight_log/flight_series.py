"""One recorded flight as time series, from whatever messages its vehicle sends, and the obstacles around it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from protocol.dialect.vocabulary import Law
from protocol.errors import LocalProtocolError
from protocol.flight_log.flight_clock import flight_clock
from protocol.flight_log.flight_summary import LoggedFlight, LogSummary, chosen_vehicle, summarise
from protocol.frames import (
    SHOW_PITCHED_DOWN,
    Geodetic,
    LocalFrame,
    Vector,
    flying_attitudes,
    quaternion_from_euler,
)
from protocol.names import GLOBAL_FRAMES, RELATIVE_ALTITUDE_FRAMES, cause_words, law_words, name_of
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
TAIL_SITTERS = frozenset({"VTOL_DUOROTOR", "VTOL_QUADROTOR", "VTOL_RESERVED3"})  # MAV_TYPEs
MAX_OFFSET_ERROR = 0.01  # of a repr_offset_q
ALARMING_LAWS = frozenset({Law.FAILSAFE.name, Law.CRASHED.name})


@dataclass(frozen=True, slots=True)
class Series:
    """Samples of one message.

    Attributes:
        times: Since the log's first record, by the vehicle's clock [s], shape (n,).
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
    attitude: Series  # ``q`` (w, x, y, z), FRD with x along the nose -> NED, of ATTITUDE_QUATERNION, else of ATTITUDE
    events: tuple[FlightEvent, ...] = field(default=())
    start_usec: int = 0  # when the recording began, since 1970 [us]; 0: not known
    home: Vector | None = None  # in the frame of ``position``, NED [m]; None: it was not told
    waypoints: tuple[tuple[int, Vector], ...] = ()  # number and place of the last mission's items, NED [m]

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
    home = _home(reader, source) if is_local else None
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
        attitude=_attitude(series("ATTITUDE_QUATERNION"), series("ATTITUDE"), flight),
        events=_events(summary, flight),
        start_usec=summary.start_usec,
        home=None if home is None else home[1],
        waypoints=() if home is None else _waypoints(reader, source, *home),
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


@np.errstate(invalid="ignore", over="ignore")  # a log may hold any bits, also NaN and infinite numbers
def _attitude(quaternions: Series, angles: Series, flight: LoggedFlight) -> Series:
    """The attitude with x along the nose, from quaternions or else from angles; tail-sitters tell the hover frame's."""
    tells_hover_frame = flight.type in TAIL_SITTERS and flight.autopilot != "ARDUPILOTMEGA"
    if not len(quaternions):
        told = np.array([angles.fields[name] for name in ("roll", "pitch", "yaw")]).T if angles else np.zeros((0, 3))
        told[~np.isfinite(told)] = np.nan
        q = np.array([quaternion_from_euler(*each) for each in told.tolist()]).reshape(-1, 4)
        return Series(angles.times, {"q": flying_attitudes(q) if tells_hover_frame else q})
    q = np.stack([quaternions.fields[name] for name in ("q1", "q2", "q3", "q4")], axis=1)
    if tells_hover_frame:  # not of DarkO's logs up to 0.1, which only have it shown so
        offsets = quaternions.fields.get("repr_offset_q", np.zeros((len(q), 4)))
        is_flying = np.linalg.norm(offsets - SHOW_PITCHED_DOWN, axis=1, keepdims=True) < MAX_OFFSET_ERROR
        q = np.where(is_flying, q, flying_attitudes(q))
    return Series(quaternions.times, {"q": q})


def _home(reader: TlogReader, source: Source) -> tuple[LocalFrame, Vector] | None:
    """Home as it was told last: a frame there, and its own place in the vehicle's local frame, NED [m]."""
    told = reader.columns("HOME_POSITION", source)
    if not len(reader.rows("HOME_POSITION", source)):
        return None
    lat, lon, alt = (int(told[name][-1]) for name in ("latitude", "longitude", "altitude"))
    x, y, z = (float(told[name][-1]) for name in "xyz")
    try:
        frame = LocalFrame(Geodetic(from_e7(lat), from_e7(lon), from_millimetres(alt)))
    except LocalProtocolError:  # a log may hold anything
        return None
    return frame, ((x, y, z) if np.isfinite((x, y, z)).all() else (0.0, 0.0, 0.0))


def _waypoints(reader: TlogReader, source: Source, frame: LocalFrame, home: Vector) -> tuple[tuple[int, Vector], ...]:
    """Number and place of each item of the last mission that was sent to or by a vehicle, NED [m]."""
    told, sent_by = reader.columns("MISSION_ITEM_INT"), reader.systems[reader.rows("MISSION_ITEM_INT")]
    names = ("mission_type", "target_system", "seq", "frame", "x", "y", "z")
    items: dict[int, Vector | None] = {}
    for sender, kind, target, seq, kind_of_frame, lat, lon, alt in zip(
        sent_by.tolist(), *(told[name].tolist() for name in names), strict=True
    ):
        if kind or source[0] not in {sender, target}:
            continue
        if seq == 0:  # another plan begins
            items.clear()
        items[seq] = None
        if kind_of_frame in GLOBAL_FRAMES and (lat or lon) and np.isfinite(alt):
            height = alt + (frame.origin.alt if kind_of_frame in RELATIVE_ALTITUDE_FRAMES else 0.0)
            north, east, down = frame.to_ned(Geodetic(from_e7(lat), from_e7(lon), height))
            items[seq] = north + home[0], east + home[1], down + home[2]
    return tuple((seq, place) for seq, place in items.items() if place is not None)


def _events(summary: LogSummary, flight: LoggedFlight) -> tuple[FlightEvent, ...]:
    """Jumps, changes of mode, arming and texts, by time."""
    source = (flight.system, flight.component)
    found = []
    for jump in flight.jumps:
        left, entered = law_words(jump.law_from), law_words(jump.law_to)
        kind = "alarm" if jump.law_to in ALARMING_LAWS else "jump"
        cause = cause_words(jump.law_from, jump.law_to, jump.reason)
        found.append((jump.time, kind, f"{left} to {entered}: {cause}", entered))
    found += [(mode.start, "mode", f"mode {mode.name}", mode.name) for mode in flight.modes]
    for period in flight.armed:
        found.append((period.start, "armed", "motors armed", "armed"))
        found.append((period.end, "armed", "motors disarmed", "disarmed"))
    found += [
        (text.time, "alarm" if text.severity in ALARMING else "text", text.text, "")
        for text in summary.texts
        if (text.system, text.component) == source
    ]
    return tuple(sorted((FlightEvent(*event) for event in found), key=lambda event: event.time))
