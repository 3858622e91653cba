"""Snapshots of a recorded flight, with pause, seek and speed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from darko_gcs.state.message_log import add_line
from darko_gcs.state.reduce import MAX_TRACK_POINTS, reduce
from darko_gcs.state.reduce_darko import MAX_V_POINTS, v_point
from darko_gcs.state.snapshot import EMPTY_SNAPSHOT, Snapshot
from darko_gcs.station.station import Station
from protocol.dialect import mavlink
from protocol.tlog import TlogReader
from protocol.tlog.replay import Timeline

__all__ = ["ReplayFeed"]

SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0)


class ReplayFeed:
    """A recorded flight.

    Args:
        reader: The log.
        name: Its name, for the message log.
        begin: Where to begin [s].
        speed: Playing speed, times real time.
    """

    def __init__(self, reader: TlogReader, name: str, *, begin: float = 0.0, speed: float = 1.0) -> None:
        self.timeline, self.name = Timeline(reader), name
        self._positions = _columns(reader, self.timeline, "LOCAL_POSITION_NED", ("x", "y"))
        self._v_values = _columns(
            reader, self.timeline, "DARKO_HYBRID_STATE", ("time_boot_ms", "law", "v_hover", "v_forward")
        )
        self.snapshot: Snapshot = EMPTY_SNAPSHOT
        self.station: Station | None = None
        self.playing = True
        self.speed = speed
        self._begin = begin

    @property
    def now(self) -> float:
        """Playing time [s]."""
        return self.timeline.position

    async def open(self) -> None:
        """Show the place where it begins."""
        self.seek(self._begin)

    async def close(self) -> None:
        """Nothing to release."""

    def advance(self, elapsed: float) -> None:
        """Play for some time [s]."""
        if not self.playing:
            return
        before = self.timeline.position
        for message in self.timeline.advance(elapsed * self.speed):
            self.snapshot = reduce(self.snapshot, message, self.timeline.position)
        for marker in self.timeline.markers:
            if before < marker.time <= self.timeline.position:
                self.snapshot = add_line(self.snapshot, marker.time, mavlink.MAV_SEVERITY_NOTICE, marker.what)
        if self.timeline.position >= self.timeline.duration:
            self.playing = False

    def seek(self, time: float) -> None:
        """Go to a playing time [s]; the snapshot is rebuilt from the log."""
        time = min(max(time, 0.0), self.timeline.duration)
        messages = self.timeline.seek(time)
        snapshot = add_line(EMPTY_SNAPSHOT, 0.0, mavlink.MAV_SEVERITY_NOTICE, f"Replay of {self.name}")
        for marker in self.timeline.markers:
            if marker.time <= time:
                snapshot = add_line(snapshot, marker.time, mavlink.MAV_SEVERITY_NOTICE, marker.what)
        for message in messages:
            snapshot = reduce(snapshot, message, time)
        positions, v_values = (table[table[:, 0] <= time, 1:] for table in (self._positions, self._v_values))
        self.snapshot = replace(
            snapshot,
            track=tuple(map(tuple, positions[:: max(1, len(positions) // MAX_TRACK_POINTS)])),
            v_history=tuple(v_point(ms / 1e3, int(law), *v) for ms, law, *v in v_values[-MAX_V_POINTS:].tolist()),
        )

    def toggle(self) -> None:
        """Pause or play; at the end, play again from the beginning."""
        if not self.playing and self.timeline.position >= self.timeline.duration:
            self.seek(0.0)
        self.playing = not self.playing

    def change_speed(self, steps: int) -> None:
        """Play faster or slower by some steps of the table of speeds."""
        index = min(range(len(SPEEDS)), key=lambda i: abs(SPEEDS[i] - self.speed))
        self.speed = SPEEDS[min(max(index + steps, 0), len(SPEEDS) - 1)]


def _columns(reader: TlogReader, timeline: Timeline, name: str, fields: tuple[str, ...]) -> NDArray[np.float64]:
    """Playing time [s] and some fields of every message of a kind, shape (messages, 1 + fields)."""
    rows = reader.rows(name)
    if not len(rows):
        return np.zeros((0, 1 + len(fields)))
    columns = reader.columns(name)
    return np.column_stack([timeline.times[rows], *(columns[field].astype(float) for field in fields)])
