"""Telemetry: the streams, and the service that sends what is due."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Regime
from protocol.endpoints.endpoint_vehicle import VehicleEndpoint
from protocol.events import MessageRequested
from protocol.names import Mode
from protocol.wire.message import Message
from sitl.mavlink.handlers import on_event
from sitl.mavlink.standard_modes import available_modes, available_modes_monitor, current_mode
from sitl.mavlink.telemetry import (
    camera_messages,
    flight_plan_messages,
    hybrid_state,
    navigation,
    sensor_messages,
    vehicle_state,
)
from sitl.mavlink.telemetry.camera_messages import image_captured
from sitl.mavlink.telemetry.streams import Stream
from sitl.mavlink.telemetry.vehicle_snapshot import (
    Control,
    FlightTimes,
    HeartbeatStatus,
    VehicleSnapshot,
    heartbeat_status,
    take_snapshot,
)
from sitl.mavlink.telemetry.vehicle_state import heartbeat
from sitl.sensors.draws import PERIOD
from sitl.vehicle.aircraft import Aircraft

# Sends telemetry: streams at their rates, messages that peers ask for, and changes of mode and control at once.

STREAMS = (
    *vehicle_state.STATE_STREAMS.rows,
    *navigation.NAVIGATION_STREAMS.rows,
    *sensor_messages.SENSOR_STREAMS.rows,
    *hybrid_state.HYBRID_STREAMS.rows,
    *flight_plan_messages.PLAN_STREAMS.rows,
    *camera_messages.CAMERA_STREAMS.rows,
    Stream(mavlink.MAVLINK_MSG_ID_CURRENT_MODE, lambda s: current_mode(s.mode, s.intended), 0.5),
    # MAVLink has it sent when the list of modes changes, which it never does.
    Stream(mavlink.MAVLINK_MSG_ID_AVAILABLE_MODES_MONITOR, lambda _: available_modes_monitor(), 0.0),
)
BUILDERS = {s.message_id: s.build for s in STREAMS} | {
    mavlink.MAVLINK_MSG_ID_HEARTBEAT: lambda s: vehicle_state.heartbeat(s.status, s.autopilot_type)
}
FAMILIES = {
    # Our own dialect, which only a peer that has its definitions can read.
    "DARKO": frozenset(number for number, known in mavlink.mavlink_map.items() if known.msgname.startswith("DARKO_")),
    # Newer than the definitions that MAVProxy comes with.
    "modes": frozenset(
        {
            mavlink.MAVLINK_MSG_ID_AVAILABLE_MODES,
            mavlink.MAVLINK_MSG_ID_CURRENT_MODE,
            mavlink.MAVLINK_MSG_ID_AVAILABLE_MODES_MONITOR,
        }
    ),
    "control": frozenset({mavlink.MAVLINK_MSG_ID_CONTROL_STATUS}),
}
"""Messages that a peer gets once it has asked for one of the family."""


class SnapshotMessages:
    """The messages of one instant: takes the snapshot, and makes each message of it, when first asked and only once.

    Args:
        take: Takes the snapshot.
    """

    def __init__(self, take: Callable[[], VehicleSnapshot]) -> None:
        self._take = take
        self._messages: dict[int, list[Message]] = {}

    @cached_property
    def snapshot(self) -> VehicleSnapshot:
        """The vehicle as it is."""
        return self._take()

    def message(self, message_id: int) -> Message:
        """A message of :data:`BUILDERS`; the first, if there are several of its kind."""
        return self.messages(message_id)[0]

    def messages(self, message_id: int) -> list[Message]:
        """All messages of a kind of :data:`BUILDERS`: NAMED_VALUE_FLOAT has several."""
        if message_id not in self._messages:
            built = BUILDERS[message_id](self.snapshot)
            self._messages[message_id] = built if isinstance(built, list) else [built]
        return self._messages[message_id]


ALL_IMAGES = -1  # param2 of a request for CAMERA_IMAGE_CAPTURED
MAX_IMAGES_TOLD = 50  # in answer to one request
PERIOD_US = round(PERIOD * 1e6)


class TelemetryService:
    """Makes messages from snapshots of the aircraft, and sends them.

    ``intended_mode`` is the mode that a peer asked for last.

    Args:
        aircraft: What the messages are about.
        endpoint: Sends the messages, and knows who is in control.
        autopilot_type: MAV_AUTOPILOT of HEARTBEAT.
    """

    def __init__(self, aircraft: Aircraft, endpoint: VehicleEndpoint, autopilot_type: int) -> None:
        self._aircraft, self._endpoint, self._autopilot_type = aircraft, endpoint, autopilot_type
        self.intended_mode: Mode | None = None
        self._flight_times = FlightTimes(landed=aircraft.vehicle.law.regime is Regime.GROUND)
        self._announced_status: HeartbeatStatus | None = None
        self._announced_mode = aircraft.autopilot.mode
        self._announced_control = Control()

    def snapshot(self) -> VehicleSnapshot:
        """The vehicle as it is now."""
        return take_snapshot(
            self._aircraft,
            intended=self.intended_mode,
            flight=self._flight_times,
            control=self._control(),
            autopilot_type=self._autopilot_type,
        )

    def messages(self) -> SnapshotMessages:
        """The messages of this instant, made when they are asked for."""
        return SnapshotMessages(self.snapshot)

    def update_flight_times(self) -> None:
        """Look whether the vehicle was armed, took off or landed."""
        vehicle = self._aircraft.vehicle
        self._flight_times = self._flight_times.updated(
            vehicle.time, armed=self._aircraft.autopilot.armed, landed=vehicle.law.regime is Regime.GROUND
        )

    def publish_now(self, message_id: int) -> None:
        """Send a message of the telemetry to everyone."""
        for message in self.messages().messages(message_id):
            self._endpoint.publish(message)

    def publish_due(self, messages: SnapshotMessages) -> None:
        """Send the streams that are due.

        Args:
            messages: Of this instant.
        """
        time_us = self._aircraft.vehicle.periods * PERIOD_US
        for message_id, audience in self._endpoint.streams_due(time_us).items():
            with self._aircraft.guard:  # the other streams go on
                for message in messages.messages(message_id):
                    self._endpoint.publish(message, audience)

    def announce_status(self, now: float) -> None:
        """Send HEARTBEAT and CURRENT_MODE at once if they have changed.

        Args:
            now: The link's time [s].
        """
        status = heartbeat_status(self._aircraft)
        if status != self._announced_status:
            self._announced_status = status
            self._endpoint.announce(heartbeat(status, self._autopilot_type), now)
        if status.mode is not self._announced_mode:
            self._announced_mode = status.mode
            self._endpoint.publish(current_mode(status.mode, self.intended_mode))

    def announce_control(self) -> None:
        """Send CONTROL_STATUS at once if it has changed."""
        control = self._control()
        if control != self._announced_control:
            self._announced_control = control
            self.publish_now(mavlink.MAVLINK_MSG_ID_CONTROL_STATUS)

    @on_event(MessageRequested)
    def send_requested(self, event: MessageRequested, _now: float) -> None:
        """A peer asked for a message."""
        if event.message_id == mavlink.MAVLINK_MSG_ID_AVAILABLE_MODES:
            requested = available_modes(int(event.index))
        elif event.message_id == mavlink.MAVLINK_MSG_ID_CAMERA_IMAGE_CAPTURED:
            requested = self._images(int(event.index))
        else:
            requested = self.messages().messages(event.message_id)
        for message in requested:
            self._endpoint.send(message, event.peer)

    def _images(self, number: int) -> list[Message]:
        """An image that was taken, told again; -1: all that can be."""
        autopilot = self._aircraft.autopilot
        world, kept = autopilot.world, autopilot.camera.kept
        told = list(kept.values())[-MAX_IMAGES_TOLD:] if number == ALL_IMAGES else filter(None, [kept.get(number)])
        return [image_captured(capture, world.frame, world.home) for capture in told]

    def _control(self) -> Control:
        operator = self._endpoint.operator
        holder = operator.holder
        return Control(
            station=holder.system if holder else 0,
            takeover=operator.only_one and (holder is None or operator.takeover),
        )
