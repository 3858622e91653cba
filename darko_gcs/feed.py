"""Where the screens' snapshots come from: a vehicle on the link, or a recorded flight."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from darko_gcs.acquaintance import Acquaintance
from darko_gcs.child import Child
from darko_gcs.link import Link
from darko_gcs.snapshot import EMPTY, Snapshot
from darko_gcs.station import Station
from darko_gcs.store import KEPT_TRACK, note, reduce
from darko_gcs.store_darko import KEPT_V, v_point
from protocol.exposure import exposure
from protocol.replay import Timeline
from protocol.tlog import TlogReader

__all__ = ["Feed", "LiveFeed", "ReplayFeed"]

SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0)
NOTICE = 5  # MAV_SEVERITY_NOTICE


class Feed(Protocol):
    """What the app needs of either source."""

    @property
    def snapshot(self) -> Snapshot:
        """The flight as it stands."""

    @property
    def now(self) -> float:
        """The clock that the snapshot's times are on [s]."""

    @property
    def station(self) -> Station | None:
        """Who talks to the vehicle; None when there is none to talk to."""

    async def open(self) -> None:
        """Begin."""

    async def close(self) -> None:
        """End, and leave nothing behind."""

    def advance(self, elapsed: float) -> None:
        """Let the app's time pass [s]."""


class LiveFeed:
    """A vehicle on the link, and the process that flies it if it is ours."""

    def __init__(self, station: Station, host: str, port: int, sitl: Sequence[str] | None, greeting: str = "") -> None:
        self.station: Station = station
        self._link = Link(station)
        self._host, self._port, self._sitl = host, port, sitl
        self._greeting = greeting
        self._child: Child | None = None
        self._acquaintance = Acquaintance(station)
        self._mourned = False

    @property
    def snapshot(self) -> Snapshot:
        """The flight as it stands."""
        return self.station.snapshot

    @property
    def now(self) -> float:
        """The link's clock [s]."""
        return self._link.now

    async def open(self) -> None:
        """Listen, and start the vehicle if asked to.

        Raises:
            LinkError: If the port cannot be had or the vehicle not be started.
        """
        port = await self._link.open(self._host, self._port)
        self._say(f"Listening on {self._host}:{port}")
        if warning := exposure(self._host, signed=self.station.endpoint.keyring.is_on):
            self._say(warning)
        if self._greeting:
            self._say(self._greeting)
        if self._sitl is not None:
            self._child = await Child.start(port, self._sitl, self._say)

    async def close(self) -> None:
        """Stop our vehicle, give the port back, close the recording."""
        if self._child is not None:
            await self._child.stop()
        await self._link.close()

    def advance(self, elapsed: float) -> None:  # noqa: ARG002 - the link has its own clock
        """Become acquainted with a vehicle that appears; notice when our vehicle process ends by itself."""
        self._acquaintance.follow(self.station.events(), self._link.now)
        if self._child is not None and self._child.exit_code is not None and not self._mourned:
            self._mourned = True
            self._say(f"darko-sitl ended with exit code {self._child.exit_code}")

    def _say(self, text: str) -> None:
        self.station.say(self._link.now, text, NOTICE)


class ReplayFeed:
    """A recorded flight with pause, seek and speed."""

    def __init__(self, reader: TlogReader, name: str, *, begin: float = 0.0, speed: float = 1.0) -> None:
        self.timeline, self.name = Timeline(reader), name
        self._places = _history(reader, self.timeline, "LOCAL_POSITION_NED", ("x", "y"))
        self._values = _history(
            reader, self.timeline, "DARKO_HYBRID_STATE", ("time_boot_ms", "law", "v_hover", "v_forward")
        )
        self.snapshot: Snapshot = EMPTY
        self.station: Station | None = None
        self.playing = True
        self.speed = speed
        self._begin = begin

    @property
    def now(self) -> float:
        """Playing time [s]."""
        return self.timeline.position

    async def open(self) -> None:
        """Show where it begins."""
        self.seek(self._begin)

    async def close(self) -> None:
        """Nothing is held."""

    def advance(self, elapsed: float) -> None:
        """Play on."""
        if not self.playing:
            return
        before = self.timeline.position
        for message in self.timeline.advance(elapsed * self.speed):
            self.snapshot = reduce(self.snapshot, message, self.timeline.position)
        for marker in self.timeline.markers:
            if before < marker.time <= self.timeline.position:
                self.snapshot = note(self.snapshot, marker.time, NOTICE, marker.what)
        if self.timeline.position >= self.timeline.duration:
            self.playing = False

    def seek(self, time: float) -> None:
        """Go to a playing time; what was shown is rebuilt from the log."""
        time = min(max(time, 0.0), self.timeline.duration)
        messages = self.timeline.seek(time)
        snapshot = note(EMPTY, 0.0, NOTICE, f"Replay of {self.name}")
        for marker in self.timeline.markers:
            if marker.time <= time:
                snapshot = note(snapshot, marker.time, NOTICE, marker.what)
        for message in messages:
            snapshot = reduce(snapshot, message, time)
        places, values = (table[table[:, 0] <= time, 1:] for table in (self._places, self._values))
        self.snapshot = replace(
            snapshot,
            track=tuple(map(tuple, places[:: max(1, len(places) // KEPT_TRACK)])),
            v_history=tuple(v_point(ms / 1e3, int(law), *v) for ms, law, *v in values[-KEPT_V:].tolist()),
        )

    def toggle(self) -> None:
        """Pause or play; at the end, from the beginning again."""
        if not self.playing and self.timeline.position >= self.timeline.duration:
            self.seek(0.0)
        self.playing = not self.playing

    def change_speed(self, steps: int) -> None:
        """Faster or slower by steps of the table."""
        index = min(range(len(SPEEDS)), key=lambda i: abs(SPEEDS[i] - self.speed))
        self.speed = SPEEDS[min(max(index + steps, 0), len(SPEEDS) - 1)]


def _history(reader: TlogReader, timeline: Timeline, name: str, fields: tuple[str, ...]) -> NDArray[np.float64]:
    """Playing time and some fields of every message of a kind, (n, 1 + fields)."""
    rows = reader.rows(name)
    if not len(rows):
        return np.zeros((0, 1 + len(fields)))
    columns = reader.columns(name)
    return np.column_stack([timeline.times[rows], *(columns[field].astype(float) for field in fields)])
