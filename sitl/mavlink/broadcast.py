"""Messages to every peer that are sent unasked: texts and events. The flight recorder gets them too."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from protocol.dialect import mavlink
from protocol.endpoints.endpoint_vehicle import VehicleEndpoint
from protocol.wire.message import Message
from sitl.mavlink.flight_recorder import FlightRecorder
from sitl.mavlink.statustext_limiter import MIN_REPEAT_INTERVAL, StatustextLimiter
from sitl.tools.persistence import StateFolderError
from sitl.vehicle.aircraft import Aircraft

COMPLAINT_INTERVAL = 5.0  # between two equal complaints about a stream of messages [s]


class Broadcast:
    """Sends texts and events to all peers.

    Texts in answer to peers are limited, texts about the flight are not: see :meth:`answering`.

    Args:
        endpoint: Sends them.
        aircraft: Its time stamps them in the recorder.
        recorder: Records them.
    """

    def __init__(self, endpoint: VehicleEndpoint, aircraft: Aircraft, recorder: FlightRecorder | None) -> None:
        self._endpoint, self._aircraft, self._recorder = endpoint, aircraft, recorder
        self._limiter = StatustextLimiter()
        self._answering_at: float | None = None  # the link's time while a peer is answered [s]

    @contextmanager
    def answering(self, now: float) -> Iterator[None]:
        """Within this block, texts answer peers.

        Args:
            now: The link's time [s].
        """
        self._answering_at = now
        try:
            yield
        finally:
            self._answering_at = None

    def event(self, message: Message) -> None:
        """Tell everyone that something happened."""
        self._endpoint.publish(message)
        if self._recorder is not None:
            self._recorder.record(message, self._aircraft.vehicle.time)

    def text(
        self, severity: int, text: str, *, repeat_after: float = MIN_REPEAT_INTERVAL, always: bool = False
    ) -> None:
        """Tell everyone a text.

        Args:
            severity: MAV_SEVERITY.
            text: The text.
            repeat_after: If it answers a peer, the same text is dropped for this long [s].
            always: Send it whatever was sent before.
        """
        now = None if always else self._answering_at
        if now is not None and not self._limiter.admits(text, now, repeat_after=repeat_after):
            return
        self._endpoint.status_text(severity, text)
        if self._recorder is not None:
            self._recorder.record_text(severity, text, self._aircraft.vehicle.time)

    def info(self, text: str) -> None:
        """Tell everyone a text with severity INFO."""
        self.text(mavlink.MAV_SEVERITY_INFO, text)

    def warn(self, text: str) -> None:
        """Tell everyone a text with severity WARNING."""
        self.text(mavlink.MAV_SEVERITY_WARNING, text)

    def complain(self, text: str) -> None:
        """Warn about a message that comes again and again, but not as often as it comes."""
        self.text(mavlink.MAV_SEVERITY_WARNING, text, repeat_after=COMPLAINT_INTERVAL)

    def save(self, write: Callable[[], None]) -> None:
        """Call what writes to the state folder. If it fails, everyone is told, and the flight goes on."""
        try:
            write()
        except StateFolderError as error:
            self.text(mavlink.MAV_SEVERITY_ERROR, str(error))

    def handle_timer(self, now: float) -> None:
        """Tell how many texts were withheld, once there is room for texts again."""
        if summary := self._limiter.summary(now):
            self.warn(summary)

    @property
    def remembered_texts(self) -> int:
        """Number of texts that the limiter remembers."""
        return self._limiter.remembered
