"""The snapshot at any record of a log, equal to that of playing there, in a time that does not grow with the log.

Messages are of two sorts. Each *measurement* replaces the one before: of these only the last one counts, and of what
the screens collect from them (track, chart) the arrays of ``recorded_measurements``. All others, which are rare, are
folded into snapshots once, when the log is opened; every so many of them the snapshot is kept.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from darko_gcs.state.message_log import add_line, is_fix, is_on_map
from darko_gcs.state.parts import Identity
from darko_gcs.state.reduce import (
    CHECKED_FIELDS,
    HANDLERS,
    MAX_NUMBER,
    MAX_TRACK_POINTS,
    MIN_TRACK_STEP,
    RESTART_STEP,
    after_restart,
    reduce,
    restart_messages,
    thinned,
)
from darko_gcs.state.reduce_telemetry import MAX_V_POINTS, is_place_lost, v_point
from darko_gcs.state.snapshot import Snapshot
from darko_gcs.state.values import uses_forward_v
from protocol import units
from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Saturation
from protocol.frames import Geodetic, LocalFrame
from protocol.tlog import TlogReader, message_name
from protocol.tlog.reader import Timeline
from protocol.wire.message import Source

Rows = NDArray[np.int64]  # indices of records, ascending
Columns = Mapping[str, NDArray[np.generic]]
Point = tuple[float, float]  # north, east [m]


class RecordedTrack:
    """Track of the vehicle in a recording.

    After a restart a vehicle tells its places on the globe until, or unless, it tells a position in its local frame.

    Args:
        local_rows: Records of LOCAL_POSITION_NED.
        local: Their fields.
        fix_rows: Records of GLOBAL_POSITION_INT that tell a place.
        fixes: Their fields.
        restarts: Records at which the vehicle is known to have restarted.
        filter_rows: Records of ESTIMATOR_STATUS.
        filters: Their fields.
    """

    def __init__(
        self,
        local_rows: Rows,
        local: Columns,
        fix_rows: Rows,
        fixes: Columns,
        restarts: Rows,
        filter_rows: Rows,
        filters: Columns,
    ) -> None:
        self._local_rows = local_rows
        lost = is_place_lost(filters["flags"].astype(np.int64))
        self._starts: dict[int, Geodetic] = {}  # by record
        positions = list(zip(local["x"].tolist(), local["y"].tolist(), strict=True))
        places = list(zip(*(fixes[name].tolist() for name in ("lat", "lon", "alt")), strict=True))
        found: list[tuple[int, Point]] = []
        longest = 0
        for begin, end in pairwise((0, *restarts.tolist(), math.inf)):
            local_begin, local_end = np.searchsorted(local_rows, (begin, end)).tolist()
            silent_until = local_rows[local_begin] if local_begin < local_end else end
            fix_begin, fix_end = np.searchsorted(fix_rows, (begin, silent_until)).tolist()
            before = len(found)
            on_globe = self._on_globe(fix_rows[fix_begin:fix_end].tolist(), places[fix_begin:fix_end])
            told = zip(local_rows[local_begin:local_end].tolist(), positions[local_begin:local_end], strict=True)
            filters_begin, filters_end = np.searchsorted(filter_rows, (begin, end)).tolist()
            known = _Known(filter_rows[filters_begin:filters_end], lost[filters_begin:filters_end])
            found += _apart(on_globe, known)
            found += _apart(told, known)
            longest = max(longest, len(found) - before)
        self._rows = np.array([row for row, _ in found], dtype=np.int64)
        self._points = np.array([point for _, point in found]).reshape(-1, 2)
        self._start_rows = np.array(list(self._starts), dtype=np.int64)
        self._thinnings = _thinnings(longest)

    def start(self, first: int, played: int) -> Geodetic | None:
        """The first place on the globe since a record, if nothing else is told of the position; else None."""
        at = int(np.searchsorted(self._start_rows, first))
        if at == len(self._start_rows) or self._start_rows[at] >= played or self._local_row(first) < played:
            return None
        return self._starts[int(self._start_rows[at])]

    def points(self, first: int, played: int) -> tuple[Point, ...]:
        """The track from a record on after so many records, north and east [m]."""
        local = self._local_row(first)
        begin, end = np.searchsorted(self._rows, (local if local < played else first, played)).tolist()
        return tuple(map(tuple, self._points[begin + _kept(self._thinnings, end - begin)].tolist()))

    def _local_row(self, first: int) -> float:
        """The first record of a local position from a record on."""
        at = int(np.searchsorted(self._local_rows, first))
        return self._local_rows[at] if at < len(self._local_rows) else math.inf

    def _on_globe(self, rows: list[int], places: list[tuple[int, int, int]]) -> Iterator[tuple[int, Point]]:
        if not rows:
            return iter(())
        geodetic = [Geodetic(units.from_e7(n), units.from_e7(e), units.from_millimetres(up)) for n, e, up in places]
        self._starts[rows[0]] = geodetic[0]
        frame = LocalFrame(geodetic[0])
        return zip(rows, [frame.to_ned(place)[:2] for place in geodetic], strict=True)


class _Known(NamedTuple):
    """Whether the vehicle knows its place, as it said last."""

    rows: Rows  # that say so
    lost: NDArray[np.bool_]

    def at(self, row: int) -> bool:
        """Whether it does at a record; until it says anything, it does."""
        at = int(np.searchsorted(self.rows, row))
        return at == 0 or not self.lost[at - 1]


def _apart(track: Iterable[tuple[int, Point]], known: _Known) -> Iterator[tuple[int, Point]]:
    """The points that the vehicle knew, far enough from the one before."""
    last = None
    for row, point in track:
        if known.at(row) and (last is None or math.dist(last, point) >= MIN_TRACK_STEP):
            last = point
            yield row, point


def _thinnings(points: int) -> list[tuple[int, Rows]]:
    """Thinnings of a growing track: the number of points before each, and the indices of those left."""
    thinnings: list[tuple[int, Rows]] = []
    track, before = tuple(range(min(points, MAX_TRACK_POINTS))), MAX_TRACK_POINTS
    while before < points:
        left = thinned(track)
        thinnings.append((before, np.array(left)))
        after = before + MAX_TRACK_POINTS - len(left)
        track, before = (*left, *range(before, after)), after
    return thinnings


def _kept(thinnings: list[tuple[int, Rows]], points: int) -> Rows:
    """Indices of the points that are left of so many in a track."""
    before, left = next(
        ((before, left) for before, left in reversed(thinnings) if before < points), (0, np.zeros(0, dtype=np.int64))
    )
    return np.concatenate((left, np.arange(before, points)))


CLEAR_HEIGHT = 1.0  # above where it stood: it has taken off [m]
FLYING = (mavlink.MAV_LANDED_STATE_TAKEOFF, mavlink.MAV_LANDED_STATE_IN_AIR)


class Series(NamedTuple):
    """One quantity over the records that tell it, shape (n,) each."""

    rows: NDArray[np.int64]
    values: NDArray[np.float64]


def height_series(reader: TlogReader, source: Source) -> Series:
    """Height in the local frame, or above home where there is none [m]."""
    rows = reader.rows("LOCAL_POSITION_NED", source)
    if len(rows):
        return Series(rows, -reader.columns("LOCAL_POSITION_NED", source)["z"].astype(np.float64))
    rows = reader.rows("GLOBAL_POSITION_INT", source)
    return Series(rows, reader.columns("GLOBAL_POSITION_INT", source)["relative_alt"] / 1e3)


def v_series(reader: TlogReader, source: Source) -> Series:
    """V of the hover law or of the forward law, whichever the law in force goes by."""
    columns = reader.columns("DARKO_HYBRID_STATE", source)
    forward = np.array([uses_forward_v(law) for law in columns["law"].tolist()], dtype=bool)
    values = np.where(forward, columns["v_forward"], columns["v_hover"]).astype(np.float64)
    return Series(reader.rows("DARKO_HYBRID_STATE", source), values)


def take_off_row(reader: TlogReader, source: Source) -> int:
    """The record at which the vehicle has taken off: it says so, or it is clear of where it stood; else the first."""
    rows = reader.rows("EXTENDED_SYS_STATE", source)
    states = reader.columns("EXTENDED_SYS_STATE", source)["landed_state"]
    stood = np.flatnonzero(states == mavlink.MAV_LANDED_STATE_ON_GROUND)
    if len(stood):
        flying = rows[np.isin(states, FLYING) & (np.arange(len(states)) > stood[0])]
        return int(flying[0]) if len(flying) else 0
    height = height_series(reader, source)
    clear = height.rows[height.values > height.values[0] + CLEAR_HEIGHT] if len(height.rows) else height.rows
    return int(clear[0]) if len(clear) else 0


# Messages that replace the one of their kind before, whatever was before: their handlers read nothing of the snapshot
# but the kind of vehicle and where its map begins.
MEASUREMENTS = (
    "DARKO_TRUTH", "ESTIMATOR_STATUS", "ODOMETRY",
    "ATTITUDE", "ATTITUDE_QUATERNION", "BATTERY_STATUS", "DARKO_ACTUATORS", "DARKO_AIR", "DARKO_ENERGY",
    "DARKO_HYBRID_STATE", "EXTENDED_SYS_STATE", "GLOBAL_POSITION_INT", "LOCAL_POSITION_NED",
    "NAV_CONTROLLER_OUTPUT", "POSITION_TARGET_GLOBAL_INT", "POSITION_TARGET_LOCAL_NED", "SERVO_OUTPUT_RAW",
    "SYS_STATUS", "VFR_HUD", "WIND", "WIND_COV",
)  # fmt: skip


TIMED_EVENTS = ("DARKO_DECISION",)  # they tell the time since boot, as measurements do
METERED = frozenset({*TIMED_EVENTS, "MISSION_CURRENT", "MISSION_ITEM_REACHED"})  # they read time and energy


class RecordedMeasurements:
    """The measurements that a player of the log would take.

    Args:
        reader: The log.
        vehicle_row: Record from which on only its vehicle counts.

    Attributes:
        restarts: Records at which the vehicle is known to have restarted.
        late_rows: Records of messages that came too late to count.
    """

    def __init__(self, reader: TlogReader, vehicle_row: int) -> None:
        kinds = {name: _sane(reader, name, vehicle_row) for name in (*MEASUREMENTS, *TIMED_EVENTS)}
        rows = np.concatenate([rows for rows, columns in kinds.values() if "time_boot_ms" in columns])
        boot = np.concatenate([c["time_boot_ms"].astype(float) for _, c in kinds.values() if "time_boot_ms" in c])
        order = np.argsort(rows)
        self._timed_rows, self._boot = rows[order], boot[order] / 1e3
        self._lateness, is_restart = _lateness(self._boot)
        self.restarts = self._timed_rows[is_restart]
        self.late_rows = self._timed_rows[self._lateness > 0]
        taken = {name: _without(*kinds[name], self.late_rows) for name in MEASUREMENTS}
        self._rows = {name: rows for name, (rows, _) in taken.items()}
        taken["GLOBAL_POSITION_INT"] = _places(*taken["GLOBAL_POSITION_INT"], is_on_map)
        fixes = _places(*taken["GLOBAL_POSITION_INT"], is_fix)
        self._rows |= {"GLOBAL_POSITION_INT": taken["GLOBAL_POSITION_INT"][0], "of them fixes": fixes[0]}
        self._track = RecordedTrack(*taken["LOCAL_POSITION_NED"], *fixes, self.restarts, *taken["ESTIMATOR_STATUS"])
        self._hybrid_rows, hybrid = taken["DARKO_HYBRID_STATE"]
        self._hybrid_time = hybrid["time_boot_ms"].astype(float) / 1e3
        self._v_rows, self._v_points = self._v(hybrid)
        law = hybrid["law"]
        is_first = np.searchsorted(self._hybrid_rows, self.restarts)
        changed = np.ones(len(law), dtype=bool)
        changed[1:] = law[1:] != law[:-1]
        changed[is_first[is_first < len(law)]] = True
        self._law_rows = self._hybrid_rows[changed]
        self._law_times = self._hybrid_time[changed]
        rows, actuators = taken["DARKO_ACTUATORS"]
        saturation = actuators["saturation"].astype(np.int64)
        self._saturated = {
            axis: (rows[on], actuators["time_boot_ms"][on].astype(float) / 1e3)
            for axis in Saturation
            if len(on := np.flatnonzero(saturation & int(axis)))
        }

    def segment(self, played: int) -> int:
        """The first record of the flight since the last restart, as known after so many records."""
        past = self.restarts[: np.searchsorted(self.restarts, played)]
        return int(past[-1]) if len(past) else 0

    def start(self, played: int) -> Geodetic | None:
        """Zero of the map after so many records; None if it is that of the vehicle's local frame."""
        return self._track.start(self.segment(played), played)

    def last_rows(self, played: int) -> list[int]:
        """The last record of each kind since the last restart, ascending."""
        first = self.segment(played)
        last = (rows[at - 1] for rows in self._rows.values() if (at := np.searchsorted(rows, played)))
        return sorted({int(row) for row in last if row >= first})

    def with_collected(self, s: Snapshot, played: int) -> Snapshot:
        """The snapshot with what comes from more than the last measurements."""
        first = self.segment(played)
        v_begin, v_end = np.searchsorted(self._v_rows, (first, played)).tolist()
        saturated = {
            axis: float(times[at - 1])
            for axis, (rows, times) in self._saturated.items()
            if (at := np.searchsorted(rows, played)) and rows[at - 1] >= first
        }
        timed = int(np.searchsorted(self._timed_rows, played))
        late = int(self._lateness[timed - 1]) if timed else 0
        history = tuple(
            v_point(time, int(law), hover, forward)
            for time, law, hover, forward in self._v_points[max(v_begin, v_end - MAX_V_POINTS) : v_end].tolist()
        )
        return s._replace(
            link=s.link._replace(late_messages=late, boot=self.boot(played)),
            position=s.position._replace(track=self._track.points(first, played)),
            hybrid=s.hybrid._replace(v_history=history),
            actuation=s.actuation._replace(saturated_at=saturated),
        )

    def boot(self, played: int) -> float | None:
        """The newest time since boot after so many records [s]."""
        timed = int(np.searchsorted(self._timed_rows, played))
        return float(self._boot[timed - 1 - int(self._lateness[timed - 1])]) if timed else None

    def energy_row(self, played: int) -> int | None:
        """The last record of DARKO_ENERGY since the last restart."""
        rows = self._rows["DARKO_ENERGY"]
        at = int(np.searchsorted(rows, played))
        return int(rows[at - 1]) if at and rows[at - 1] >= self.segment(played) else None

    def law_since(self, played: int, jump_row: int, of_jump: float | None) -> float | None:
        """The vehicle's time of the last change of law [s], told by a jump or by the state of the controller."""
        at = int(np.searchsorted(self._law_rows, played))
        if not at or self._law_rows[at - 1] < max(jump_row, self.segment(played)):
            return of_jump
        return float(self._law_times[at - 1])

    def _v(self, hybrid: Columns) -> tuple[Rows, NDArray[np.float64]]:
        """Records and values of the chart of V: those with a later time than all before."""
        chosen = [np.zeros(0, dtype=bool)]
        for times in np.split(self._hybrid_time, np.searchsorted(self._hybrid_rows, self.restarts)):
            newest = np.maximum.accumulate(np.concatenate(([-np.inf], times)))
            chosen.append(times > newest[:-1])
        mask = np.concatenate(chosen)
        fields = (self._hybrid_time, *(hybrid[name].astype(float) for name in ("law", "v_hover", "v_forward")))
        return self._hybrid_rows[mask], np.column_stack(fields)[mask]


def _sane(reader: TlogReader, name: str, vehicle_row: int) -> tuple[Rows, Columns]:
    """Records of a kind that a player takes, and their fields: of the vehicle, and with possible numbers."""
    rows, columns = reader.rows(name), reader.columns(name)
    is_vehicle = rows < vehicle_row
    if vehicle_row < len(reader):
        same = reader.systems[rows] == reader.systems[vehicle_row]
        is_vehicle |= same & (reader.components[rows] == reader.components[vehicle_row])
    with np.errstate(invalid="ignore"):
        for field in CHECKED_FIELDS.get(name, ()):
            possible = np.abs(columns[field].astype(float)) < MAX_NUMBER
            is_vehicle &= possible.reshape(len(rows), -1).all(axis=1) if len(rows) else possible.reshape(0)
    return rows[is_vehicle], {field: values[is_vehicle] for field, values in columns.items()}


def _lateness(boot: NDArray[np.float64]) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """For each time since boot how many in a row, with it, were long before the newest, and at which it restarted."""
    lateness, is_restart = np.zeros(len(boot), dtype=np.int64), np.zeros(len(boot), dtype=np.bool_)
    if not len(boot) or (boot >= np.maximum.accumulate(boot) - RESTART_STEP).all():
        return lateness, is_restart
    newest, late = -math.inf, 0
    for index, time in enumerate(boot.tolist()):
        late = late + 1 if time < newest - RESTART_STEP else 0
        is_restart[index] = bool(late) and late >= restart_messages(time, newest)
        if is_restart[index]:
            late = 0
        if not late:
            newest = time
        lateness[index] = late
    return lateness, is_restart


def _without(rows: Rows, columns: Columns, late: Rows) -> tuple[Rows, Columns]:
    if not len(late):
        return rows, columns
    keep = ~np.isin(rows, late)
    return rows[keep], {field: values[keep] for field, values in columns.items()}


def _places(rows: Rows, columns: Columns, is_wanted: Callable[[int, int], bool]) -> tuple[Rows, Columns]:
    """Records of GLOBAL_POSITION_INT whose place is wanted, and their fields."""
    places = zip(columns["lat"].tolist(), columns["lon"].tolist(), strict=True)
    wanted = np.array([is_wanted(*place) for place in places], dtype=bool)
    return rows[wanted], {field: values[wanted] for field, values in columns.items()}


KEPT_EVERY = 32  # steps between two snapshots that are kept
Change = Callable[[Snapshot], Snapshot]


class _Step(NamedTuple):
    """One change of the snapshot by anything but a measurement."""

    played: int  # records that must have been played
    order: int  # among steps of one record: its message, then remarks about the recording
    change: Change


class RecordedStates:
    """Snapshots of a log.

    Args:
        reader: The log.
        timeline: Of the same log.
        first: The snapshot before the first record.
    """

    def __init__(self, reader: TlogReader, timeline: Timeline, first: Snapshot) -> None:
        self._timeline = timeline
        self._vehicle_row = _first_vehicle(reader)
        self._measured = RecordedMeasurements(reader, self._vehicle_row)
        remarks = self._remarks()
        self._remarked = {step.played for step in remarks}
        steps = [*self._messages(reader), *self._restarts(), *remarks]
        self._steps = sorted(steps, key=lambda step: step[:2])
        self._played = np.array([step.played for step in self._steps])
        self._jump_rows: list[int] = []
        self._kept = [first]
        s = first
        for number, step in enumerate(self._steps, 1):
            before, s = s.hybrid.jumps, step.change(s)
            if s.hybrid.jumps and s.hybrid.jumps is not before:
                self._jump_rows.append(step.played - 1)
            if number % KEPT_EVERY == 0:
                self._kept.append(s)
        self.last = s  # without measurements

    def at(self, played: int) -> Snapshot:
        """The snapshot after so many records."""
        count = int(np.searchsorted(self._played, played, side="right")) if self._steps else 0
        s = self._kept[count // KEPT_EVERY]
        for step in self._steps[count // KEPT_EVERY * KEPT_EVERY : count]:
            s = step.change(s)
        law_since = self._measured.law_since(played, self._jump_row(played), s.hybrid.law_since)
        s = self._with_measurements(s, played)
        return s._replace(hybrid=s.hybrid._replace(law_since=law_since))

    def has_remark(self, rows: range) -> bool:
        """Whether there is a remark about the recording behind one of these records."""
        return any(rows.start < played <= rows.stop for played in self._remarked)

    def _remarks(self) -> Sequence[_Step]:
        """Remarks about the recording, as lines of the message log."""
        times = np.array([marker.time for marker in self._timeline.markers])
        played = np.searchsorted(self._timeline.times, times, side="right").tolist()
        return [
            _Step(count, 1, _line(marker.time, marker.what))
            for count, marker in zip(played, self._timeline.markers, strict=True)
        ]

    def _messages(self, reader: TlogReader) -> Sequence[_Step]:
        numbers = [n for n in np.unique(reader.ids[reader.known]).tolist() if _is_rare(message_name(n))]
        metered = {n for n in numbers if message_name(n) in METERED}
        rows = np.setdiff1d(np.flatnonzero(np.isin(reader.ids, numbers)), self._measured.late_rows)
        return [
            _Step(row + 1, 0, self._fold_metered(row) if number in metered else self._fold(row))
            for row, number in zip(rows.tolist(), reader.ids[rows].tolist(), strict=True)
        ]

    def _restarts(self) -> Sequence[_Step]:
        return [_Step(row + 1, 0, self._restart(row)) for row in self._measured.restarts.tolist()]

    def _fold(self, row: int) -> Change:
        def fold(s: Snapshot) -> Snapshot:
            message = self._timeline.message(row)
            return s if message is None else reduce(s, message, float(self._timeline.times[row]))

        return fold

    def _fold_metered(self, row: int) -> Change:
        """A message after the time and the energy that were told before it."""
        fold, energy_row = self._fold(row), self._measured.energy_row(row)
        energy = None if energy_row is None else self._fold(energy_row)

        def fold_metered(s: Snapshot) -> Snapshot:
            s = s if energy is None else energy(s)
            return fold(s._replace(link=s.link._replace(boot=self._measured.boot(row + 1))))

        return fold_metered

    def _restart(self, row: int) -> Change:
        return lambda s: after_restart(s, float(self._timeline.times[row]))

    def _with_measurements(self, s: Snapshot, played: int) -> Snapshot:
        """The snapshot with the last measurement of each kind, in the order of the log."""
        rows = self._measured.last_rows(played)
        known = s.identity
        unknown = Identity(capabilities=known.capabilities)  # as it was before the vehicle was known
        link = s.link._replace(boot=None)  # a decision tells a later time than a slow measurement before it
        s = s._replace(identity=unknown, link=link, position=s.position._replace(start=self._measured.start(played)))
        is_known = False
        for row in rows:
            if row >= self._vehicle_row and not is_known:
                s, is_known = s._replace(identity=known), True
            s = self._fold(row)(s)
        return self._measured.with_collected(s._replace(identity=known), played)

    def _jump_row(self, played: int) -> int:
        """The record of the last jump; -1 if there was none since the last restart."""
        first = self._measured.segment(played)
        before = bisect_left(self._jump_rows, played) - 1
        return self._jump_rows[before] if before >= 0 and self._jump_rows[before] >= first else -1


def _line(time: float, text: str) -> Change:
    return lambda s: add_line(s, time, mavlink.MAV_SEVERITY_NOTICE, text)


def _is_rare(name: str) -> bool:
    return name == "HEARTBEAT" or (HANDLERS.get(name) is not None and name not in MEASUREMENTS)


def _first_vehicle(reader: TlogReader) -> int:
    """The record from which on only one vehicle counts: the first heartbeat of an autopilot."""
    rows = reader.rows("HEARTBEAT")
    told = reader.columns("HEARTBEAT")["autopilot"] != mavlink.MAV_AUTOPILOT_INVALID
    rows = rows[told & (reader.components[rows] == mavlink.MAV_COMP_ID_AUTOPILOT1)]
    return int(rows[0]) if len(rows) else len(reader)
