"""The snapshot at any record of a log, equal to that of playing there, in a time that does not grow with the log.

Messages are of two sorts. Each *measurement* replaces the one before: of these only the last one counts, and of what
the screens collect from them (track, chart) the arrays of ``recorded_measurements``. All others, which are rare, are
folded into snapshots once, when the log is opened; every so many of them the snapshot is kept.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from darko_gcs.feed.recorded_measurements import MEASUREMENTS, RecordedMeasurements
from darko_gcs.state.message_log import add_line
from darko_gcs.state.reduce import HANDLERS, after_restart, reduce
from darko_gcs.state.snapshot import Snapshot, updated
from protocol.dialect import mavlink
from protocol.tlog import TlogReader, message_name
from protocol.tlog.reader import Timeline

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
            before, s = s.jumps, step.change(s)
            if s.jumps and s.jumps is not before:
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
        law_since = self._measured.law_since(played, self._jump_row(played), s.law_since)
        return updated(self._with_measurements(s, played), law_since=law_since)

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
        return [_Step(row + 1, 0, self._fold(row)) for row in np.flatnonzero(np.isin(reader.ids, numbers)).tolist()]

    def _restarts(self) -> Sequence[_Step]:
        return [_Step(row + 1, 0, self._restart(row)) for row in self._measured.restarts.tolist()]

    def _fold(self, row: int) -> Change:
        def fold(s: Snapshot) -> Snapshot:
            message = self._timeline.message(row)
            return s if message is None else reduce(s, message, float(self._timeline.times[row]))

        return fold

    def _restart(self, row: int) -> Change:
        return lambda s: after_restart(s, float(self._timeline.times[row]))

    def _with_measurements(self, s: Snapshot, played: int) -> Snapshot:
        """The snapshot with the last measurement of each kind, in the order of the log."""
        rows = self._measured.last_rows(played)
        known: dict[str, Any] = {"source": s.source, "autopilot": s.autopilot, "kind": s.kind}
        start = self._measured.start(played)
        s = updated(s, source=None, autopilot=0, kind=0, start=start)  # as it was before the vehicle was known
        is_known = False
        for row in rows:
            if row >= self._vehicle_row and not is_known:
                s, is_known = updated(s, **known), True
            s = self._fold(row)(s)
        return updated(s, **known, **self._measured.collected(played))

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
