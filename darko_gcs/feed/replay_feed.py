"""Snapshots of a recorded flight: played, forwards or backwards, sought, and stepped through."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from darko_gcs.errors import LinkError
from darko_gcs.feed.links import OutwardAddress
from darko_gcs.feed.player import Player, recorded_marks
from darko_gcs.feed.recorded_fields import RecordedFields
from darko_gcs.feed.recorded_states import RecordedStates
from darko_gcs.feed.recorded_traffic import RecordedTraffic
from darko_gcs.feed.replay_output import ReplayOutput
from darko_gcs.state.message_log import add_line
from darko_gcs.state.parameters import ParameterMetadata
from darko_gcs.state.parts import ParameterTable, SessionStatus
from darko_gcs.state.reduce import reduce
from darko_gcs.state.snapshot import Snapshot
from protocol.dialect import mavlink
from protocol.flight_log.flight_clock import flight_clock
from protocol.flight_log.flight_summary import vehicles
from protocol.tlog import TlogReader
from protocol.tlog.reader import Timeline
from protocol.wire.message import Source

MAX_PLAYED = 500  # records that are played one by one; beyond, the state is looked up


class ReplayFeed(Player):
    """A recorded flight.

    Args:
        reader: The log.
        name: Its name, for the message log.
        begin: Where to begin, in times that are shown [s].
        speed: Playing speed, times real time.
        send_to: Another station, which may be sent what is played.
        parameters: What the parameters of this project's vehicle mean, for a recording of one.

    Attributes:
        timeline: Where it is.
        source: The vehicle; None if there is none in the log.
        flight_times: The vehicle's time of each record [s], shape (n,).
    """

    def __init__(
        self,
        reader: TlogReader,
        name: str,
        *,
        begin: float = 0.0,
        speed: float = 1.0,
        send_to: OutwardAddress | None = None,
        parameters: Mapping[str, ParameterMetadata] | None = None,
    ) -> None:
        super().__init__(speed)
        self.reader, self.timeline, self.name = reader, Timeline(reader), name
        meanings = parameters or {} if len(reader.rows("DARKO_HYBRID_STATE")) else {}
        empty = Snapshot(session=SessionStatus(is_replay=True), parameters=ParameterTable(metadata=meanings))
        first = add_line(empty, 0.0, mavlink.MAV_SEVERITY_NOTICE, f"Replay of {name}")
        if len(found := vehicles(reader)) > 1:
            named = ", ".join(f"{system}/{component}" for system, component in found)
            said = f"The log has vehicles {named}: this is the first one heard; --vehicle ID chooses"
            first = add_line(first, 0.0, mavlink.MAV_SEVERITY_NOTICE, said)
        self._states = RecordedStates(reader, self.timeline, first)
        self.source: Source | None = self._states.last.identity.source
        self._clock = None if self.source is None else flight_clock(reader, self.source)
        self.flight_times: NDArray[np.float64] = self.timeline.times if self._clock is None else self._clock.arrivals
        self.marks = recorded_marks(reader, self.timeline, self.source)
        self.snapshot = first
        self.traffic = RecordedTraffic(reader, self.timeline)
        self.history = RecordedFields(reader, self.timeline, self.source, self.marks)
        self._begin = begin
        self.output = None if send_to is None else ReplayOutput(reader, send_to)

    @property
    def now(self) -> float:
        """Playing time [s]."""
        return self.timeline.position

    @property
    def duration(self) -> float:
        """Playing time of the last record [s]."""
        return self.timeline.duration

    def log_time(self, playing: float) -> float:
        """Time in the log, as its summary and its tables tell it [s]."""
        return playing if self._clock is None else self._clock.at(playing)

    def playing_at(self, shown: float) -> float:
        """Playing time of a time in the log [s]."""
        return shown if self._clock is None else self._clock.playing_at(shown)

    @property
    def flight_time(self) -> float:
        """The vehicle's own clock [s]: it begins anew when the vehicle restarts."""
        if not len(self.flight_times):
            return 0.0
        return self.now if self._clock is None else self._clock.since_boot(self.now)

    async def open(self) -> None:
        """Show the place where it begins."""
        self.seek(max(self.playing_at(self._begin), *self.timeline.times[:1].tolist(), 0.0))

    def seek(self, time: float) -> None:
        """Go to a playing time [s]."""
        self.timeline.seek(time)
        self._look_up()

    def step(self, records: int) -> None:
        """Go on, or back, by some records, and stand still there."""
        self.playing = False
        self.timeline.go_to(self.timeline.played + records)
        self._look_up()

    def play(self, elapsed: float) -> None:
        """Play on by some playing time [s], message by message if they are few."""
        rows = self.timeline.advance(elapsed)
        if self.output is not None:
            self.output.send(rows)
        if len(rows) > MAX_PLAYED or self._states.has_remark(rows):
            self._look_up()
            return
        for row in rows:
            message = self.timeline.message(row)
            if message is not None:
                self.snapshot = reduce(self.snapshot, message, float(self.timeline.times[row]))

    def _look_up(self) -> None:
        """The snapshot of the present place."""
        s = self._states.at(self.timeline.played)
        self.snapshot = s._replace(session=s.session._replace(sends_to=self.snapshot.session.sends_to))

    async def toggle_output(self) -> None:
        """Send what is played, or send it no more.

        Raises:
            LinkError: There is nothing to send, nowhere to send it to, or no way there.
        """
        if self.output is None:
            raise LinkError("there is no address to send to")
        if self.output.words:
            self.output.stop()
        else:
            await self.output.start()
        self.snapshot = self.snapshot._replace(session=self.snapshot.session._replace(sends_to=self.output.words))

    async def close(self) -> None:
        """Send no more."""
        if self.output is not None:
            self.output.stop()
