"""Measurements of a log as arrays: which one is the last at any record, and what the screens collect from them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from darko_gcs.feed.recorded_track import RecordedTrack
from darko_gcs.state.message_handlers import is_fix, is_on_map
from darko_gcs.state.reduce import CHECKED_FIELDS, MAX_NUMBER, RESTART_STEP, restart_messages
from darko_gcs.state.reduce_telemetry import MAX_V_POINTS, v_point
from protocol.dialect.vocabulary import Saturation
from protocol.frames import Geodetic
from protocol.tlog import TlogReader

# Messages that replace the one of their kind before, whatever was before: their handlers read nothing of the snapshot
# but the kind of vehicle and where its map begins.
MEASUREMENTS = (
    "DARKO_TRUTH", "ESTIMATOR_STATUS", "ODOMETRY",
    "ATTITUDE", "ATTITUDE_QUATERNION", "BATTERY_STATUS", "DARKO_ACTUATORS", "DARKO_AIR", "DARKO_DECISION",
    "DARKO_ENERGY", "DARKO_HYBRID_STATE", "EXTENDED_SYS_STATE", "GLOBAL_POSITION_INT", "LOCAL_POSITION_NED",
    "NAV_CONTROLLER_OUTPUT", "POSITION_TARGET_GLOBAL_INT", "POSITION_TARGET_LOCAL_NED", "SERVO_OUTPUT_RAW",
    "SYS_STATUS", "VFR_HUD", "WIND", "WIND_COV",
)  # fmt: skip
Rows = NDArray[np.int64]  # indices of records, ascending
Columns = Mapping[str, NDArray[np.generic]]


class RecordedMeasurements:
    """The measurements that a player of the log would take.

    Args:
        reader: The log.
        vehicle_row: Record from which on only its vehicle counts.

    Attributes:
        restarts: Records at which the vehicle is known to have restarted.
    """

    def __init__(self, reader: TlogReader, vehicle_row: int) -> None:
        kinds = {name: _sane(reader, name, vehicle_row) for name in MEASUREMENTS}
        rows = np.concatenate([rows for rows, columns in kinds.values() if "time_boot_ms" in columns])
        boot = np.concatenate([c["time_boot_ms"].astype(float) for _, c in kinds.values() if "time_boot_ms" in c])
        order = np.argsort(rows)
        self._timed_rows, self._boot = rows[order], boot[order] / 1e3
        self._lateness, is_restart = _lateness(self._boot)
        self.restarts = self._timed_rows[is_restart]
        late_rows = self._timed_rows[self._lateness > 0]
        taken = {name: _without(rows, columns, late_rows) for name, (rows, columns) in kinds.items()}
        self._rows = {name: rows for name, (rows, _) in taken.items()}
        taken["GLOBAL_POSITION_INT"] = _places(*taken["GLOBAL_POSITION_INT"], is_on_map)
        fixes = _places(*taken["GLOBAL_POSITION_INT"], is_fix)
        self._rows |= {"GLOBAL_POSITION_INT": taken["GLOBAL_POSITION_INT"][0], "of them fixes": fixes[0]}
        self._track = RecordedTrack(*taken["LOCAL_POSITION_NED"], *fixes, self.restarts)
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

    def collected(self, played: int) -> dict[str, Any]:
        """The fields of the snapshot that come from more than the last measurements."""
        first = self.segment(played)
        v_begin, v_end = np.searchsorted(self._v_rows, (first, played)).tolist()
        saturated = {
            axis: float(times[at - 1])
            for axis, (rows, times) in self._saturated.items()
            if (at := np.searchsorted(rows, played)) and rows[at - 1] >= first
        }
        timed = int(np.searchsorted(self._timed_rows, played))
        late = int(self._lateness[timed - 1]) if timed else 0
        return {
            "track": self._track.points(first, played),
            "v_history": tuple(
                v_point(time, int(law), hover, forward)
                for time, law, hover, forward in self._v_points[max(v_begin, v_end - MAX_V_POINTS) : v_end].tolist()
            ),
            "saturated_at": saturated,
            "late_messages": late,
            "boot": float(self._boot[timed - 1 - late]) if timed else None,
        }

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
