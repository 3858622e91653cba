"""Texts and reports that go to every peer and into the flight's record."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from protocol.dialect import mavlink
from protocol.endpoints.endpoint_vehicle import VehicleEndpoint
from protocol.events import LogEraseRequested
from protocol.names import Mode
from protocol.tools.timing import TokenBucket
from protocol.wire.message import Message, Peer
from sitl.mavlink.flight_recorder import FlightRecorder
from sitl.mavlink.handlers import on_event
from sitl.mavlink.telemetry import hybrid_state
from sitl.mavlink.telemetry.camera_messages import image_captured
from sitl.mavlink.telemetry.telemetry_service import SnapshotMessages, TelemetryService
from sitl.mavlink.telemetry.vehicle_snapshot import mission_state
from sitl.tools.persistence import StateFolderError
from sitl.vehicle.aircraft import Aircraft

# Messages to every peer that are sent unasked: texts and events. The flight recorder gets them too.

# Limits the texts that peers make the vehicle send: a flood of requests must not become a flood of texts.


MAX_BURST = 20  # texts in a row
TEXTS_PER_SECOND = 1.0  # after a burst
MIN_REPEAT_INTERVAL = 1.0  # between two texts that read the same [s]
MAX_REMEMBERED = 64  # texts that a new one is compared with


class StatustextLimiter:
    """Decides which texts in answer to peers are sent (STATUSTEXT), on the link's time, and counts the others."""

    def __init__(self) -> None:
        self._budget = TokenBucket(capacity=MAX_BURST, rate=TEXTS_PER_SECOND)
        self._sent_at: dict[str, float] = {}  # when each of the last texts was sent [s], oldest first
        self._withheld = 0

    @property
    def remembered(self) -> int:
        """Number of texts that a new one is compared with."""
        return len(self._sent_at)

    def admits(self, text: str, now: float, *, repeat_after: float = MIN_REPEAT_INTERVAL) -> bool:
        """True if ``text`` may be sent now.

        Args:
            text: The text.
            now: The link's time [s].
            repeat_after: The same text is dropped for this long [s]; such a repetition does not count as withheld.
        """
        if now - self._sent_at.get(text, float("-inf")) < repeat_after:
            return False
        if not self._budget.take(now):
            self._withheld += 1
            return False
        self._sent_at.pop(text, None)
        self._sent_at[text] = now
        if len(self._sent_at) > MAX_REMEMBERED:
            del self._sent_at[next(iter(self._sent_at))]
        return True

    def summary(self, now: float) -> str:
        """Text with the number of withheld texts, once half a burst may be sent again; else empty."""
        if not self._withheld or self._budget.level(now) < MAX_BURST / 2:
            return ""
        count, self._withheld = self._withheld, 0
        return f"{count} further answers were not sent"


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

    def others(self, peer: Peer, text: str) -> None:
        """Tell all but a peer what it has had the vehicle do, with severity NOTICE."""
        now = self._answering_at
        if now is None or self._limiter.admits(text, now):
            self._endpoint.status_text(mavlink.MAV_SEVERITY_NOTICE, text, but=peer)

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


# Reports of the flight, sent to every peer and recorded: jumps, reached items, decisions and notices.


class FlightReporter:
    """Reports what has happened since the last report.

    Args:
        aircraft: What is reported.
        telemetry: Makes messages of it.
        broadcast: Tells everyone.
        recorder: Records flights.
    """

    def __init__(
        self, aircraft: Aircraft, telemetry: TelemetryService, broadcast: Broadcast, recorder: FlightRecorder | None
    ) -> None:
        self._aircraft, self._telemetry = aircraft, telemetry
        self._broadcast, self._recorder = broadcast, recorder
        self._state, self._mission = self._told_state(), self._told_mission()

    def report(self, messages: SnapshotMessages | None = None) -> set[str]:
        """Report what has happened; gives the texts for the pilot.

        Args:
            messages: Of this instant, if there are any already.
        """
        autopilot = self._aircraft.autopilot
        messages = messages or self._telemetry.messages()
        self._telemetry.update_flight_times()
        with self._aircraft.guard:
            self._record(messages)  # first, so that a flight's log begins with its arming
        jumps = self._aircraft.new_jumps()
        for jump in jumps:
            self._broadcast.event(hybrid_state.jump(jump))
        for seq in autopilot.reached():
            self._broadcast.event(mavlink.MAVLink_mission_item_reached_message(seq))
            self._telemetry.publish_now(mavlink.MAVLINK_MSG_ID_MISSION_CURRENT)
        self._report_states(messages, jumped=bool(jumps))
        self._report_images()
        for seq, made in autopilot.decisions():
            self._broadcast.event(hybrid_state.decision(messages.snapshot.ms, seq, made))
        notices = autopilot.notices()
        for notice in notices:
            self._broadcast.text(notice.severity, notice.text)
        return {notice.text for notice in notices}

    def _report_states(self, messages: SnapshotMessages, *, jumped: bool) -> None:
        """Tell changes of what the vehicle does at once: an answer to a command may follow that they bear out."""
        state, mission = self._told_state(), self._told_mission()
        if jumped or state != self._state:
            self._broadcast.event(messages.message(mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE))
        if mission != self._mission:
            self._telemetry.publish_now(mavlink.MAVLINK_MSG_ID_MISSION_CURRENT)
        self._state, self._mission = state, mission

    def _told_state(self) -> tuple[object, ...]:
        autopilot = self._aircraft.autopilot
        return self._aircraft.way_of_flying, autopilot.landing, autopilot.mode is Mode.TAKEOFF

    def _told_mission(self) -> tuple[object, ...]:
        autopilot = self._aircraft.autopilot
        return autopilot.mode is Mode.MISSION, mission_state(autopilot)

    def _report_images(self) -> None:
        autopilot = self._aircraft.autopilot
        world = autopilot.world
        for capture in autopilot.camera.captures:
            self._broadcast.event(image_captured(capture, world.frame, world.home))
        autopilot.camera.captures.clear()

    @on_event(LogEraseRequested)
    def erase_logs(self, _event: LogEraseRequested, _now: float) -> None:
        """A peer wants the logs deleted."""
        if self._recorder is not None:
            erased = self._recorder.erase()
            self._broadcast.info(f"{erased} log{'s' * (erased != 1)} erased")

    def _record(self, messages: SnapshotMessages) -> None:
        if self._recorder is None:
            return
        self._recorder.follow(self._aircraft.vehicle.time, messages.messages, armed=self._aircraft.autopilot.armed)
        for text in self._recorder.complaints():
            self._broadcast.warn(text)
