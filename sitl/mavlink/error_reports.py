"""Errors in the vehicle's own code: told as CRITICAL with their place; the vehicle holds, logs have the traceback."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress

from protocol.dialect import mavlink
from protocol.engines.base import drop_oldest
from sitl.mavlink.broadcast import Broadcast
from sitl.mavlink.flight_recorder import FlightRecorder
from sitl.tools.error_guard import place_of, traceback_of
from sitl.tools.persistence import StateFolder
from sitl.vehicle.aircraft import Aircraft

ERROR_INTERVAL = 5.0  # between two reports of errors at one place, on the vehicle's clock [s]
MAX_PLACES = 64  # that are remembered
MAX_MESSAGE = 150  # of what an error says [characters]


class ErrorReporter:
    """Reports errors, each place now and then only.

    Args:
        aircraft: Holds after an error.
        broadcast: Tells everyone.
        recorder: Has the traceback in the log of the flight.
        state_folder: Has it in the log of errors.
        tell: Tells a person beside the process a line.
    """

    def __init__(
        self,
        *,
        aircraft: Aircraft,
        broadcast: Broadcast,
        recorder: FlightRecorder | None,
        state_folder: StateFolder,
        tell: Callable[[str], None],
    ) -> None:
        self._aircraft, self._broadcast, self._recorder = aircraft, broadcast, recorder
        self._state_folder, self._tell = state_folder, tell
        self._told_at: dict[str, float] = {}  # when each place was last told, on the vehicle's clock [s]

    def report(self, error: Exception) -> None:
        """Tell, hold and log, each even where another fails: the error may be in any of them."""
        place, now = place_of(error), self._aircraft.vehicle.time
        if now - self._told_at.get(place, -math.inf) < ERROR_INTERVAL:
            return
        self._told_at.pop(place, None)
        self._told_at[place] = now
        drop_oldest(self._told_at, MAX_PLACES)
        text = f"Internal error in {place}: {type(error).__name__}: {str(error)[:MAX_MESSAGE]}"
        for step in (self._announce, self._hold, self._log):
            with suppress(Exception):
                step(text, error)

    def _announce(self, text: str, _error: Exception) -> None:
        self._tell(f"{text} (see {self._state_folder.errors})")
        self._broadcast.text(mavlink.MAV_SEVERITY_CRITICAL, text, always=True)

    def _hold(self, _text: str, _error: Exception) -> None:
        self._aircraft.autopilot.hold_after_error()

    def _log(self, text: str, error: Exception) -> None:
        time, trace = self._aircraft.vehicle.time, traceback_of(error)
        self._broadcast.save(lambda: self._state_folder.add_error(f"{time:.2f} s: {text}\n{trace}\n"))
        if self._recorder is not None:
            for line in trace.splitlines():
                self._recorder.record_text(mavlink.MAV_SEVERITY_DEBUG, line, time)
