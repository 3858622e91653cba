"""The ground station's side of loading a flight plan: sends the pieces of its file until the vehicle has judged it."""

from __future__ import annotations

import math
import zlib

from protocol.dialect import mavlink
from protocol.engines.base import Engine
from protocol.engines.flight_plan_table import PIECE_BYTES
from protocol.engines.retransmission import Remote, RequestWindow
from protocol.errors import LocalProtocolError
from protocol.events import FlightPlanAnswered
from protocol.limits import MAX_PLAN_FILE
from protocol.wire.message import Message, Source, addressed_to, target_fields

__all__ = ["FlightPlanUpload"]

MAX_OPEN_PIECES = 10  # sent and not yet answered


class FlightPlanUpload(Engine[Message]):
    """Sends one file at a time.

    Args:
        system: Own system id.
        component: Own component id.
        remote: The vehicle's timing, shared by all engines of this end.
    """

    def __init__(self, system: int, component: int, remote: Remote | None = None) -> None:
        super().__init__()
        self._system, self._component, self._remote = system, component, remote or Remote()
        self._vehicle: Source = (0, 0)
        self._data, self._crc = b"", 0
        self._window: RequestWindow | None = None  # pieces to send

    @property
    def is_busy(self) -> bool:
        """True while a file is being sent."""
        return self._window is not None

    def send(self, vehicle: Source, data: bytes, now: float) -> None:
        """Send a file; ends in ``FlightPlanAnswered``.

        Raises:
            LocalProtocolError: Another file is being sent, or this one is empty or too large.
        """
        if self._window is not None:
            raise LocalProtocolError("a flight plan is being sent already")
        if not 0 < len(data) <= MAX_PLAN_FILE:
            raise LocalProtocolError(f"the flight plan has {len(data)} bytes; the maximum is {MAX_PLAN_FILE}")
        self._vehicle, self._data, self._crc = vehicle, data, zlib.crc32(data)
        self._open(now)

    def cancel(self, reason: str) -> None:
        """Stop sending."""
        if self._window is not None:
            self._finish(reason)

    def receive(self, message: Message, now: float) -> None:
        """Take a DARKO_PLAN_FILE_ACK; one about another file is ignored."""
        window = self._window
        if message.get_type() != "DARKO_PLAN_FILE_ACK" or window is None or message.crc != self._crc:
            return
        if not addressed_to(message, self._system, self._component):
            return
        if message.result == mavlink.MAV_RESULT_ACCEPTED:
            self._finish("")
        elif message.result != mavlink.MAV_RESULT_IN_PROGRESS:
            self._finish(message.text or "refused")
        else:
            window.take(message.offset // PIECE_BYTES, now)
            if window.missing:
                self._transmit(window, now)
            else:  # all were taken, but not all are there: the vehicle began anew
                self._open(now)

    def next_deadline(self) -> float:
        """Link time at which a piece must be sent again [s]."""
        return math.inf if self._window is None else self._window.deadline

    def handle_timer(self, now: float) -> None:
        """Send pieces again, or give up."""
        if self._window is None or now < self._window.deadline:
            return
        if self._window.is_over(now):
            self._finish("no answer")
        else:
            self._transmit(self._window, now)

    def _open(self, now: float) -> None:
        pieces = range(math.ceil(len(self._data) / PIECE_BYTES))
        self._window = RequestWindow(self._remote, pieces, MAX_OPEN_PIECES, now)
        self._transmit(self._window, now)

    def _transmit(self, window: RequestWindow, now: float) -> None:
        for number in window.ask(now):
            offset = number * PIECE_BYTES
            piece = self._data[offset : offset + PIECE_BYTES]
            self._out.append(
                mavlink.MAVLink_darko_plan_file_message(
                    **target_fields(self._vehicle),
                    size=len(self._data),
                    crc=self._crc,
                    offset=offset,
                    count=len(piece),
                    data=list(piece.ljust(PIECE_BYTES, b"\0")),
                )
            )

    def _finish(self, text: str) -> None:
        self._window = None
        self._events.append(FlightPlanAnswered(text))
