"""Reports of the flight, sent to every peer and recorded: jumps, reached items, decisions and notices."""

from __future__ import annotations

from protocol.dialect import mavlink
from protocol.events import LogEraseRequested
from protocol.names import Mode
from sitl.mavlink.broadcast import Broadcast
from sitl.mavlink.flight_recorder import FlightRecorder
from sitl.mavlink.handlers import on_event
from sitl.mavlink.telemetry import hybrid_state
from sitl.mavlink.telemetry.camera_messages import image_captured
from sitl.mavlink.telemetry.streams import SnapshotMessages
from sitl.mavlink.telemetry.telemetry_service import TelemetryService
from sitl.mavlink.telemetry.vehicle_snapshot import mission_state
from sitl.vehicle.aircraft import Aircraft


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
