"""The ground station's end of the link: one vehicle, one operator.

It composes the client engines, decides which messages are accepted, and encodes what the engines send.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from protocol.dialect import mavlink
from protocol.engines.base import Remote
from protocol.engines.client.command_client import CommandClient
from protocol.engines.client.flight_plan_client import FlightPlanClient, FlightPlanUpload
from protocol.engines.client.ftp_client import FtpClient
from protocol.engines.client.log_client import LogClient
from protocol.engines.client.mission_client import MissionClient
from protocol.engines.client.parameter_client import ParameterClient
from protocol.engines.heartbeat import HeartbeatSource, TimeResponder, VehicleMonitor
from protocol.engines.server.command_server import CommandServer
from protocol.errors import LocalProtocolError
from protocol.events import CommandRequested, ControlRequested, Event, RemoteLog, VehicleLost
from protocol.plans.plan import MissionItem
from protocol.tools.option_values import GROUND_SYSTEM
from protocol.wire.codec import Codec
from protocol.wire.message import Message, Peer, Source, source_of, target_fields
from protocol.wire.other_dialects import OtherDialect
from protocol.wire.signing import Keyring, Verdict

GROUND_HEARTBEAT = mavlink.MAVLink_heartbeat_message(
    type=mavlink.MAV_TYPE_GCS,
    autopilot=mavlink.MAV_AUTOPILOT_INVALID,
    base_mode=0,
    custom_mode=0,
    system_status=mavlink.MAV_STATE_ACTIVE,
    mavlink_version=3,
)


class GroundEndpoint:
    """Hand in datagrams and time, then drain ``datagrams_to_send()`` and ``events()``.

    The first autopilot heard becomes the vehicle, or the first one with the system id ``vehicle``. After 3 s without
    its HEARTBEAT, commands fail: a vehicle that returns later must not execute them. Transfers continue until their
    own timeouts end them.

    With a key in the keyring, only messages signed with it are accepted: an unsigned HEARTBEAT does not make a vehicle,
    it only appears in ``unsigned_vehicle``.

    Args:
        system: Own system id.
        component: Own component id.
        keyring: Signs, and decides which frames are accepted.
        vehicle: System id of the vehicle.
        beside: An endpoint of the same ground station for another vehicle: it shares that one's link, whose frames are
            decoded and whose heartbeats are sent there. Call ``take`` instead of ``receive_datagram``.
        other: Decodes messages that our dialect has not.
    """

    def __init__(
        self,
        *,
        system: int = GROUND_SYSTEM,
        component: int = 190,
        keyring: Keyring | None = None,
        vehicle: int | None = None,
        beside: GroundEndpoint | None = None,
        other: OtherDialect | None = None,
    ) -> None:
        if beside is not None:
            system, component = beside.codec.system, beside.codec.component
        # The last datagram was of an autopilot that does not sign, or signs with an old time.
        self.heard_refused = False
        self.unsigned_vehicle: Source | None = None  # an autopilot whose last HEARTBEAT was not correctly signed
        self.keyring: Keyring = beside.keyring if beside else keyring or Keyring()
        self.codec: Codec = beside.codec if beside else Codec(system, component, self.keyring.link(None), other)
        self._speaks = beside is None
        self._source, self._monitor = HeartbeatSource(), VehicleMonitor(system=vehicle)
        self._commands = CommandClient(system, component)
        self._remote = Remote()
        self._parameters = ParameterClient(system, component, self._remote)
        self._mission = MissionClient(system, component, self._remote)
        self._times = TimeResponder(system, component)
        self._commands_from_vehicle = CommandServer(system, component, {mavlink.MAV_CMD_REQUEST_OPERATOR_CONTROL})
        self._files, self._logs = FtpClient(system, component, self._remote), LogClient(self._remote)
        self._flight_plan = FlightPlanClient(self._remote)
        self._flight_plan_upload = FlightPlanUpload(system, component, self._remote)
        self._waiting = (
            self._commands,
            self._parameters,
            self._mission,
            self._files,
            self._logs,
            self._flight_plan,
            self._flight_plan_upload,
        )
        self._datagrams: list[bytes] = []
        self._events: list[Event] = []

    @property
    def vehicle(self) -> Source | None:
        """(system, component) of the vehicle, None before its first HEARTBEAT."""
        return self._monitor.vehicle

    @property
    def is_present(self) -> bool:
        """True while the vehicle's HEARTBEATs arrive."""
        return self._monitor.is_present

    @property
    def is_busy(self) -> bool:
        """True while a command, a transfer or a parameter is not finished."""
        return any(engine.is_busy for engine in self._waiting)

    # The link

    def receive_datagram(self, data: bytes, now: float) -> list[Message]:
        """The accepted messages of one datagram, after the engines have taken them. Never raises an error."""
        self.keyring.advance_time(now)
        self.heard_refused, replayed = False, self.keyring.count(Verdict.REPLAYED)
        messages = [message for message in self.codec.decode(data) if self._accepts(message)]
        self.heard_refused |= self.keyring.count(Verdict.REPLAYED) > replayed
        self.take(messages, now)
        return messages

    def take(self, messages: Sequence[Message], now: float) -> None:
        """Take messages that were accepted."""
        for message in messages:
            self._monitor.receive(message, now)
            if source_of(message) == self.vehicle:
                self._remote.hear(message, now)
                for engine in self._waiting:
                    engine.receive(message, now)
                self._times.receive(message, now, Peer.of(message))
                self._commands_from_vehicle.receive(message, now, Peer.of(message))
        self._answer_commands(now)
        self._collect()

    def handle_timer(self, now: float) -> None:
        """Let time pass: heartbeats, repetitions, loss of the vehicle."""
        self.keyring.advance_time(now)
        if self._speaks:
            self._source.announce(GROUND_HEARTBEAT, now)
            self._source.handle_timer(now)
        self._monitor.handle_timer(now)
        self._collect()
        for engine in self._waiting:
            engine.handle_timer(now)
        self._collect()

    def next_deadline(self) -> float:
        """Link time at which ``handle_timer`` must be called next [s]; the first time, at once."""
        started = self._source.next_deadline() < math.inf
        deadlines = [engine.next_deadline() for engine in (self._monitor, *self._waiting)]
        return min([self._source.next_deadline(), *deadlines]) if started else -math.inf

    def datagrams_to_send(self) -> list[bytes]:
        """Datagrams to send now, one frame each."""
        datagrams, self._datagrams = self._datagrams, []
        return datagrams

    def events(self) -> list[Event]:
        """Events since the last call, in order."""
        events, self._events = self._events, []
        return events

    def give_up_requests(self, reason: str) -> None:
        """End all requests that wait for an answer: the vehicle that was asked will not answer."""
        for engine in self._waiting:
            engine.cancel(reason)
        self._collect()

    # Requests of the operator. All raise LocalProtocolError while no vehicle has been found.

    def command(
        self,
        command: int,
        p1: float = math.nan,
        p2: float = math.nan,
        p3: float = math.nan,
        p4: float = math.nan,
        p5: float = math.nan,
        p6: float = math.nan,
        p7: float = math.nan,
        *,
        now: float,
        timeout: float | None = None,
    ) -> int:
        """Send COMMAND_LONG (MAV_CMD) until it is answered; NaN leaves a parameter to the vehicle.

        ``timeout`` [s] is the time between repetitions. Returns the request's number in ``CommandProgress`` and
        ``CommandDone``.
        """
        message = mavlink.MAVLink_command_long_message(
            **target_fields(self._target()),
            command=command,
            confirmation=0,
            param1=p1,
            param2=p2,
            param3=p3,
            param4=p4,
            param5=p5,
            param6=p6,
            param7=p7,
        )
        return self._command(message, now, timeout)

    def command_int(
        self,
        command: int,
        frame: int,
        p1: float,
        p2: float,
        p3: float,
        p4: float,
        x: int,
        y: int,
        z: float,
        *,
        now: float,
        timeout: float | None = None,
    ) -> int:
        """Send COMMAND_INT until it is answered; x and y are wire integers (``units.to_e7``, ``units.local_e4``)."""
        message = mavlink.MAVLink_command_int_message(
            **target_fields(self._target()),
            frame=frame,
            command=command,
            current=0,
            autocontinue=0,
            param1=p1,
            param2=p2,
            param3=p3,
            param4=p4,
            x=x,
            y=y,
            z=z,
        )
        return self._command(message, now, timeout)

    def cancel_command(self, request: int, now: float) -> None:
        """Send COMMAND_CANCEL for the command with this number (of ``command`` or ``command_int``) until it is over."""
        self._commands.request_cancel(request, now)
        self._collect()

    def upload_mission(self, items: Sequence[MissionItem], *, now: float, kind: int = 0) -> None:
        """Replace the vehicle's plan of a MAV_MISSION_TYPE; ends in ``MissionUploaded`` or ``MissionFailed``."""
        self._mission.upload(self._target(), items, now, kind)
        self._collect()

    def write_mission_items(self, items: Sequence[MissionItem], changed: range, now: float) -> None:
        """Replace some items of the mission; ends in ``MissionUploaded`` or ``MissionFailed``."""
        self._mission.write_items(self._target(), items, changed, now)
        self._collect()

    def download_mission(self, now: float, kind: int = 0) -> None:
        """Download the vehicle's plan of a MAV_MISSION_TYPE; ends in ``MissionDownloaded`` or ``MissionFailed``."""
        self._mission.download(self._target(), now, kind)
        self._collect()

    def clear_mission(self, now: float, kind: int = 0) -> None:
        """Delete the plan of a MAV_MISSION_TYPE, 255 for all; ends in ``MissionCleared`` or ``MissionFailed``."""
        self._mission.clear(self._target(), now, kind)
        self._collect()

    def set_current_mission_item(self, seq: int, now: float) -> None:
        """Let the mission continue at item ``seq``; ends in ``CurrentItemSet`` or ``MissionFailed``."""
        self._mission.set_current(self._target(), seq, now)
        self._collect()

    def request_parameters(self, now: float) -> None:
        """Download the whole parameter table; ends in ``ParametersComplete`` or ``ParameterFailed``."""
        self._parameters.request_all(self._target(), now)
        self._collect()

    def set_parameter(self, name: str, value: float, now: float) -> None:
        """Set one parameter; ends in ``ParameterConfirmed`` or ``ParameterFailed``."""
        self._parameters.set(self._target(), name, value, now)
        self._collect()

    def request_flight_plan(self) -> None:
        """Download the vehicle's flight plan anew; it is downloaded by itself whenever it has changed."""
        self._flight_plan.request_again()

    def send_flight_plan(self, data: bytes, now: float) -> None:
        """Have the vehicle load a flight plan; ends in ``FlightPlanAnswered``."""
        self._flight_plan_upload.send(self._target(), data, now)
        self._collect()

    def send_key(self, key: bytes, timestamp: int, target: Source) -> None:
        """Send a signing key to a vehicle once (SETUP_SIGNING); the vehicle confirms it by signing with it.

        The key is readable on the wire, signed or not: the caller must make sure that nobody else listens.
        """
        self.send(mavlink.MAVLink_setup_signing_message(*target, list(key), timestamp))

    def read_file(self, path: str, now: float) -> None:
        """Download a file of the vehicle; ends in ``FileReceived`` or ``FileFailed``."""
        self._files.read(self._target(), path, now)
        self._collect()

    def list_logs(self, now: float) -> None:
        """Download the list of the vehicle's recorded flights; ends in ``LogsListed`` or ``LogFailed``."""
        self._logs.request_list(self._target(), now)
        self._collect()

    def fetch_log(self, log: RemoteLog, now: float) -> None:
        """Download a log of the list; ends in ``LogReceived`` or ``LogFailed``."""
        self._logs.fetch(self._target(), log, now)
        self._collect()

    def send(self, message: Message) -> None:
        """Send a message once, without waiting for an answer."""
        self._datagrams.append(self.codec.encode(message))

    def send_to_vehicle(self, message: Callable[[Source], Message]) -> None:
        """Send the vehicle a message once, which is made for its system and component."""
        self.send(message(self._target()))

    def send_frame(self, frame: bytes) -> None:
        """Send an encoded frame, such as one signed with a key that is not in force yet."""
        self._datagrams.append(frame)

    # Inside

    def _target(self) -> Source:
        if self.vehicle is None:
            raise LocalProtocolError("no vehicle has been found yet")
        return self.vehicle

    def _accepts(self, message: Message) -> bool:
        accepted = bool(message.get_signed()) or not self.keyring.is_on
        is_autopilot = message.get_type() == "HEARTBEAT" and message.autopilot != mavlink.MAV_AUTOPILOT_INVALID
        if is_autopilot and self._monitor.may_be(source_of(message)):
            self.heard_refused = not accepted
            self.unsigned_vehicle = None if accepted else source_of(message)
        return accepted

    def _command(self, message: Message, now: float, timeout: float | None) -> int:
        self.codec.check(message)
        request = self._commands.send(message, now, timeout=timeout)
        self._collect()
        return request

    def _answer_commands(self, now: float) -> None:
        for event in self._commands_from_vehicle.events():
            if isinstance(event, CommandRequested):
                asker = event.params[3]
                is_known = asker in range(1, 256)
                result = mavlink.MAV_RESULT_ACCEPTED if is_known else mavlink.MAV_RESULT_DENIED
                self._commands_from_vehicle.acknowledge(event.request, result, now)
                self._events += [ControlRequested(int(asker))] if is_known else []

    def _collect(self) -> None:
        for event in self._monitor.events():
            self._events.append(event)
            if isinstance(event, VehicleLost):
                self._commands.cancel("vehicle lost")
        for engine in self._waiting:
            self._events += engine.events()
        messages = [m for engine in (self._source, *self._waiting) for m in engine.messages_to_send()]
        messages += [
            o.message for server in (self._times, self._commands_from_vehicle) for o in server.messages_to_send()
        ]
        self._datagrams += [self.codec.encode(message) for message in messages]
