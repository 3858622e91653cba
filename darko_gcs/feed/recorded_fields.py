"""A recording's fields for charts: the whole flight is known, whatever was played of it."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from darko_gcs.feed.player import Mark, MarkKind
from darko_gcs.state.field_history import ChartMark, ascending
from protocol.errors import FileError
from protocol.flight_log.field_expressions import Curve, LoggedFields, curve
from protocol.flight_log.flight_clock import FlightClock, flight_clock
from protocol.tlog import TlogReader
from protocol.tlog.reader import Timeline
from protocol.wire.message import Source

SHOWN_MARKS = {MarkKind.JUMP: "jump to ", MarkKind.MODE: "mode "}  # with what their texts begin with


class RecordedFields:
    """A source of charts.

    Args:
        reader: The log.
        timeline: Where it is.
        source: The vehicle; None if the log has none.
        marks: Of its flight, at playing times.
    """

    def __init__(self, reader: TlogReader, timeline: Timeline, source: Source | None, marks: Sequence[Mark]) -> None:
        self._reader, self._timeline, self._source, self._marks = reader, timeline, source, marks
        self._known: dict[str, Curve] = {}

    @cached_property
    def _clock(self) -> FlightClock | None:
        return None if self._source is None else flight_clock(self._reader, self._source)

    @cached_property
    def _times(self) -> NDArray[np.float64]:
        return self._timeline.times if self._clock is None else self._clock.times

    def _at(self, playing: float) -> float:
        """The vehicle's time of a playing time [s]."""
        return playing if self._clock is None else self._clock.at(playing)

    @property
    def now(self) -> float:
        """The vehicle's time that is played [s]."""
        return self._at(self._timeline.position)

    @property
    def begin(self) -> float:
        """The vehicle's time of the first record [s]."""
        return self._at(0.0)

    @cached_property
    def names(self) -> Collection[str]:
        """Messages that the vehicle sent."""
        return LoggedFields(self._reader, self._source, self._times).names

    @cached_property
    def marks(self) -> Sequence[ChartMark]:
        """Jumps and modes of the whole flight, by time."""
        found = [
            ChartMark(self._at(mark.time), mark.text.removeprefix(SHOWN_MARKS[mark.kind]))
            for mark in self._marks
            if mark.kind in SHOWN_MARKS
        ]
        return sorted(found)

    def curve(self, text: str, since: float = 0.0) -> Curve:  # noqa: ARG002 - all is known and kept
        """The values of an expression in the whole flight, by ascending time.

        Raises:
            FileError: It is none, or the log has no such messages.
        """
        if self._source is None:
            raise FileError("the log has no vehicle")
        if text not in self._known:
            self._known[text] = ascending(curve(LoggedFields(self._reader, self._source, self._times), text))
        return self._known[text]
