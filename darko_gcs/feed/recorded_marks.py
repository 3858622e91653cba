"""Events of a recorded flight with their times: jumps, mode changes, warnings, waypoints, gaps of the recording."""

from __future__ import annotations

from collections.abc import Iterator
from enum import Enum
from typing import NamedTuple

import numpy as np

from darko_gcs.state.text import printable
from protocol.dialect import mavlink
from protocol.names import law_label, mode_name
from protocol.tlog import TlogReader
from protocol.tlog.reader import Timeline
from protocol.wire.message import Source

GAP = 2.0  # without a message of the vehicle [s]


class MarkKind(Enum):
    """Kinds of marks; a later one hides an earlier one at the same place of a drawing."""

    WAYPOINT = "waypoint"
    MODE = "mode"
    JUMP = "jump"
    WARNING = "warning"
    GAP = "gap"


class Mark(NamedTuple):
    """One event."""

    time: float  # playing time [s]
    kind: MarkKind
    text: str
    owner: str = ""  # letter of its flight, if there are several


def recorded_marks(reader: TlogReader, timeline: Timeline, source: Source | None) -> tuple[Mark, ...]:
    """The marks of a vehicle's flight, by time; of a log without a vehicle only damage and steps of its clock."""
    marks = [Mark(marker.time, MarkKind.GAP, marker.what) for marker in timeline.markers]
    if source is not None:
        for find in (_jumps, _modes, _warnings, _waypoints, _gaps):
            marks += find(reader, timeline, source)
    return tuple(sorted(marks, key=lambda mark: mark.time))


def _jumps(reader: TlogReader, timeline: Timeline, source: Source) -> Iterator[Mark]:
    columns = reader.columns("DARKO_JUMP", source)
    for row, law in zip(reader.rows("DARKO_JUMP", source), columns["law_to"].tolist(), strict=True):
        yield Mark(float(timeline.times[row]), MarkKind.JUMP, f"jump to {law_label(law)}")


def _modes(reader: TlogReader, timeline: Timeline, source: Source) -> Iterator[Mark]:
    columns = reader.columns("HEARTBEAT", source)
    modes = columns["custom_mode"].astype(np.int64)
    rows = reader.rows("HEARTBEAT", source)
    for index in (np.flatnonzero(np.diff(modes)) + 1).tolist():
        mode = int(modes[index])
        name = mode_name(int(columns["autopilot"][index]), int(columns["type"][index]), mode) or f"MODE {mode}"
        yield Mark(float(timeline.times[rows[index]]), MarkKind.MODE, f"mode {name}")


def _warnings(reader: TlogReader, timeline: Timeline, source: Source) -> Iterator[Mark]:
    columns = reader.columns("STATUSTEXT", source)
    rows = reader.rows("STATUSTEXT", source)
    first = columns["chunk_seq"] == 0  # of a text in several messages
    severe = columns["severity"].astype(np.int64) <= mavlink.MAV_SEVERITY_WARNING
    for index in np.flatnonzero(severe & first).tolist():
        text = bytes(columns["text"][index]).decode(errors="replace")
        yield Mark(float(timeline.times[rows[index]]), MarkKind.WARNING, printable(text))


def _waypoints(reader: TlogReader, timeline: Timeline, source: Source) -> Iterator[Mark]:
    items = reader.columns("MISSION_ITEM_REACHED", source)["seq"].tolist()
    for row, item in zip(reader.rows("MISSION_ITEM_REACHED", source), items, strict=True):
        yield Mark(float(timeline.times[row]), MarkKind.WAYPOINT, f"item {item} reached")


def _gaps(reader: TlogReader, timeline: Timeline, source: Source) -> Iterator[Mark]:
    own = np.flatnonzero((reader.systems == source[0]) & (reader.components == source[1]))
    silence = np.diff(timeline.times[own])
    for index in np.flatnonzero(silence > GAP).tolist():
        what = f"no message for {silence[index]:.1f} s"
        yield Mark(float(timeline.times[own[index]]), MarkKind.GAP, what)
