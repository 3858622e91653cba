"""The vehicle on MAVLink: the endpoint on one side, the aircraft on the other. No socket, no clock.

Two clocks meet here. Flight, autopilot and telemetry rates run on simulated time. Whatever waits for a person or a
program (heartbeats, transfers, retries) runs on the link's time, which the caller passes as ``now``; so a vehicle at
100 times real time still gives its peers real seconds to answer.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Iterable, Sequence
from contextlib import suppress

from protocol.dialect import mavlink
from protocol.endpoints.endpoint_vehicle import VehicleEndpoint
from protocol.engines.base import drop_oldest
from protocol.engines.file_transfer import NoFiles
from protocol.engines.server.stream_server import STREAM_OFF
from protocol.engines.table_values import Parameter
from protocol.errors import LocalProtocolError
from protocol.events import CommandRequested, Event, MessageReceived, MissionCleared
from protocol.plans.plan import MissionItem, Refusal, Validate
from protocol.wire.signing import Keyring
from sitl.mavlink import commands
from sitl.mavlink.broadcast import Broadcast, FlightReporter
from sitl.mavlink.flight_recorder import FlightRecorder
from sitl.mavlink.ftp_files import VehicleFiles
from sitl.mavlink.handlers import answered_by, handlers_of, on_event
from sitl.mavlink.services.command_service import CommandService, ExitRequest, FailureService, MaintenanceCommands
from sitl.mavlink.services.flight_plan_service import FlightPlanService
from sitl.mavlink.services.home_service import HomeService, StoredHome
from sitl.mavlink.services.operator_service import OperatorService, ParameterService
from sitl.mavlink.services.peer_inputs import (
    ObstacleService,
    PoseService,
    SigningService,
    SteeringService,
    TrafficService,
)
from sitl.mavlink.services.plan_service import PlanService, PredictionService, StoredPlans
from sitl.mavlink.standard_modes import AVAILABLE_MODES
from sitl.mavlink.telemetry.telemetry_service import FAMILIES, PERIOD_US, STREAMS, TelemetryService
from sitl.mavlink.telemetry.vehicle_snapshot import VehicleSnapshot
from sitl.tools.error_guard import place_of, traceback_of
from sitl.tools.persistence import StateFolder
from sitl.vehicle.aircraft import AUTOPILOT_PERIODS, Aircraft

# Errors in the vehicle's own code: told as CRITICAL with their place; the vehicle holds, logs have the traceback.


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


COMPONENT = 1
INTERNAL_ERROR = "an internal error"
OWN_COMMANDS = {
    *answered_by(MaintenanceCommands, int),
    *answered_by(FailureService, int),
    *answered_by(FlightPlanService, int),
}
MIN_PERIODS = 5  # control periods: whatever peers ask for, the link is looked at a hundred times a second at most


class Node:
    """One vehicle on the link: ``peers`` hear it from the start, everyone else from their first message on.

    Call ``receive`` for every datagram, ``advance`` to fly, then send all of ``datagrams``.

    Args:
        aircraft: The vehicle.
        state_folder: Where plans, parameters and home are stored.
        peers: Who hears it from the start.
        keyring: Signs and judges messages; None: nothing is signed and all is believed.
        recorder: Records flights; None: they are not recorded.
        autopilot_type: MAV_AUTOPILOT that it reports.
        exit_refusal: Why no peer may reboot or shut it down; empty if they may.
        stored_plan_first: Load the stored flight plan even if the aircraft has one.
        system: Its system id.
        forwards: Forward messages from peer to peer.
        tell: Tells a person beside the process of an error in the vehicle's own code.

    Raises:
        SitlError: A stored file cannot be read.
    """

    def __init__(
        self,
        aircraft: Aircraft,
        state_folder: StateFolder,
        peers: Sequence[Hashable] = (),
        keyring: Keyring | None = None,
        recorder: FlightRecorder | None = None,
        *,
        autopilot_type: int = mavlink.MAV_AUTOPILOT_PX4,
        exit_refusal: str = "",
        stored_plan_first: bool = False,
        system: int = 1,
        forwards: bool = True,
        tell: Callable[[str], None] = lambda _line: None,
    ) -> None:
        self.aircraft, self.state_folder = aircraft, state_folder
        autopilot, keyring = aircraft.autopilot, keyring or Keyring()
        home = StoredHome(autopilot, state_folder)  # before the plans, which are relative to it
        plans = StoredPlans(autopilot, state_folder)
        self.endpoint = endpoint = self._make_endpoint(
            plans, peers, keyring, recorder, system=system, forwards=forwards
        )
        self._broadcast = broadcast = Broadcast(endpoint, aircraft, recorder)
        _save_keys_through(broadcast, keyring)
        aircraft.guard.report = ErrorReporter(
            aircraft=aircraft, broadcast=broadcast, recorder=recorder, state_folder=state_folder, tell=tell
        ).report
        self._telemetry = telemetry = TelemetryService(aircraft, endpoint, autopilot_type)
        self._reporter = FlightReporter(aircraft, telemetry, broadcast, recorder)
        self._parameters = ParameterService(aircraft, state_folder, endpoint, broadcast)
        self._plans = PlanService(
            autopilot=autopilot,
            state_folder=state_folder,
            fence_and_rally=plans.fence_and_rally,
            broadcast=broadcast,
            telemetry=telemetry,
        )
        self._operators = OperatorService(autopilot, endpoint, broadcast)
        self._signing = SigningService(keyring, broadcast)
        self._maintenance = MaintenanceCommands(autopilot, self._parameters, exit_refusal)
        self._failures = FailureService(aircraft)
        self._flight_plan = FlightPlanService(
            aircraft=aircraft,
            endpoint=endpoint,
            broadcast=broadcast,
            telemetry=telemetry,
            state_folder=state_folder,
        )
        self._home = HomeService(
            autopilot=autopilot, stored=home, plans=self._plans, telemetry=telemetry, broadcast=broadcast
        )
        self._commands = CommandService(
            autopilot=autopilot,
            own=(self._maintenance, self._failures, self._flight_plan),
            endpoint=endpoint,
            broadcast=broadcast,
            telemetry=telemetry,
            reporter=self._reporter,
            operators=self._operators,
            home=self._home,
        )
        services = (
            self,
            self._commands,
            self._parameters,
            self._plans,
            self._operators,
            self._signing,
            self._flight_plan,
            self._reporter,
            telemetry,
            self._home,
            SteeringService(autopilot, broadcast, system),
            PoseService(aircraft, broadcast),
            ObstacleService(autopilot, broadcast),
            PredictionService(autopilot, endpoint),
            TrafficService(autopilot),
        )
        self._event_handlers = handlers_of(services, type)
        self._message_handlers = handlers_of(services, str)
        self._before_sending: tuple[Callable[[float], None], ...] = (
            self._operators.update,
            lambda _now: self._flight_plan.follow_mode(),
            self._telemetry.announce_status,
            endpoint.handle_timer,
            self._handle_events,
            self._commands.handle_timer,
            lambda _now: self._telemetry.announce_control(),
            self._signing.handle_timer,
            broadcast.handle_timer,
        )
        for notice in home.notices:
            broadcast.text(notice.severity, notice.text)
        for text in plans.flaws:
            broadcast.warn(text)
        if stored_plan_first or autopilot.flight_plan.executor is None:
            self._flight_plan.load_stored()

    def _make_endpoint(
        self,
        plans: StoredPlans,
        peers: Sequence[Hashable],
        keyring: Keyring,
        recorder: FlightRecorder | None,
        *,
        system: int,
        forwards: bool,
    ) -> VehicleEndpoint:
        logs = recorder or NoFiles()
        files = VehicleFiles(parameters=lambda: self.endpoint.parameters, plan=self._plan, logs=logs)
        return VehicleEndpoint(
            system=system,
            component=COMPONENT,
            commands=frozenset({*commands.HANDLERS, *OWN_COMMANDS}),
            parameters=self.aircraft.configuration.wire_table(),
            put_in_force=self._put_in_force,
            mission=plans.mission,
            validate=self._guarded(plans.validate),
            plans={kind: (items, self._guarded(check)) for kind, (items, check) in plans.others.items()},
            streams={
                s.message_id: round(1e6 / s.rate) if s.rate else STREAM_OFF
                for s in STREAMS
                if self.aircraft.vehicle.avionics.navigation in s.needs
            },
            on_request=(mavlink.MAVLINK_MSG_ID_AVAILABLE_MODES, mavlink.MAVLINK_MSG_ID_CAMERA_IMAGE_CAPTURED),
            numbered={mavlink.MAVLINK_MSG_ID_AVAILABLE_MODES: len(AVAILABLE_MODES)},
            families=FAMILIES.values(),
            peers=peers,
            keyring=keyring,
            files=files,
            logs=logs,
            forwards=forwards,
        )

    def _put_in_force(self, parameter: Parameter) -> str:
        with self.aircraft.guard:
            return self._parameters.put_in_force(parameter)
        return INTERNAL_ERROR

    def _plan(self, kind: int) -> tuple[MissionItem, ...]:
        return self.endpoint.plan(kind)

    # The link

    @property
    def forwards(self) -> bool:
        """Whether it forwards messages from peer to peer."""
        return self.endpoint.forwards

    @property
    def peers(self) -> tuple[Hashable, ...]:
        """Addresses of the peers that hear it."""
        return tuple(self.endpoint.statistics)

    @property
    def exit_request(self) -> ExitRequest | None:
        """Whether a peer wants the process to reboot the vehicle or to end; its answer is among ``datagrams``."""
        return self._maintenance.exit_request

    @property
    def flight_plan_was_sent(self) -> bool:
        """Whether the flight plan that is loaded was sent by a peer."""
        return self._flight_plan.was_sent

    def know(self, peers: Iterable[Hashable]) -> None:
        """Speak to the peers of before a restart as if they had spoken."""
        for peer in peers:
            self.endpoint.add_peer(peer)

    def receive(self, data: bytes, peer: Hashable, now: float) -> None:
        """Take one datagram.

        Args:
            data: The datagram.
            peer: Where it came from.
            now: The link's time [s].
        """
        if not self._failures.carries(now):
            return
        with self.aircraft.guard:
            self.endpoint.receive_datagram(data, peer, now)
        self._handle_events(now)

    def datagrams(self, now: float) -> list[tuple[Hashable | None, bytes]]:
        """Datagrams to be sent, each with its peer.

        Args:
            now: The link's time [s].
        """
        for step in self._before_sending:
            with self.aircraft.guard:
                step(now)
        datagrams, carried = self.endpoint.datagrams_to_send(), self._failures.carries(now)
        self._failures.sent(now)
        return datagrams if carried else []

    def _handle_events(self, now: float) -> None:
        events = self.endpoint.events()
        with self._broadcast.answering(now):
            with self.aircraft.guard:
                self._plans.prepare_clearing({event.kind for event in events if isinstance(event, MissionCleared)})
            for event in events:
                handler = self._event_handlers.get(type(event))
                if handler is not None:
                    self._handle(event, handler, now)

    def _handle(self, event: Event, handler: Callable[..., None], now: float) -> None:
        """Have an event answered; a command that an error cut short has failed, as far as its sender is told."""
        with self.aircraft.guard:
            handler(event, now)
            return
        if isinstance(event, CommandRequested):
            with suppress(LocalProtocolError):  # it has its answer
                self.endpoint.acknowledge(event.request, mavlink.MAV_RESULT_FAILED, now)

    def _guarded(self, check: Validate) -> Validate:
        """A check of plans that refuses what it cannot check for an error."""

        def guarded(items: Sequence[MissionItem]) -> Refusal | None:
            with self.aircraft.guard:
                return check(items)
            return Refusal(INTERNAL_ERROR, mavlink.MAV_MISSION_ERROR)

        return guarded

    @on_event(MessageReceived)
    def take_message(self, event: MessageReceived, _now: float) -> None:
        """A message arrived that no engine of the endpoint takes."""
        handler = self._message_handlers.get(event.message.get_type())
        if handler is not None:
            handler(event.message)

    # Flying

    def periods_to_fly(self) -> int:
        """Control periods until the autopilot ticks or a message is due; then the link is looked at."""
        flown = self.aircraft.vehicle.periods
        tick = AUTOPILOT_PERIODS - flown % AUTOPILOT_PERIODS
        due = self.endpoint.next_stream_due() - flown * PERIOD_US
        return max(math.ceil(min(tick * PERIOD_US, due) / PERIOD_US), MIN_PERIODS)

    def advance(self, periods: int) -> None:
        """Fly, and queue the telemetry that falls due on simulated time.

        Args:
            periods: Control periods to fly.

        Raises:
            SitlError: If the simulation leaves the finite numbers.
        """
        self.aircraft.advance(periods)
        messages = self._telemetry.messages()
        with self.aircraft.guard:
            self._reporter.report(messages)
        with self.aircraft.guard:
            self._flight_plan.update()
            self._home.follow_mission()
        with self.aircraft.guard:
            self._telemetry.publish_due(messages)
        with self.aircraft.guard:
            self._parameters.show_changes()

    def snapshot(self) -> VehicleSnapshot:
        """The vehicle as telemetry sees it now."""
        return self._telemetry.snapshot()


def _save_keys_through(broadcast: Broadcast, keyring: Keyring) -> None:
    """Have a keyring that cannot be saved reported: a full disk ends no flight."""
    save = keyring.keep
    keyring.keep = lambda record: broadcast.save(lambda: save(record))
