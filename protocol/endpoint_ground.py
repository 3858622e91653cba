"""The ground station's end of the link: one vehicle, one operator."""

import math
from collections.abc import Sequence

from protocol.codec import Codec, Message, Source, source_of
from protocol.dialect import mavlink
from protocol.engines.base import Peer
from protocol.engines.command_client import CommandClient
from protocol.engines.command_server import CommandServer
from protocol.engines.ftp_client import FtpClient
from protocol.engines.heartbeat import HeartbeatMonitor, HeartbeatSource
from protocol.engines.log_client import LogClient
from protocol.engines.mission_client import MissionClient
from protocol.engines.parameter_client import ParameterClient
from protocol.engines.responders import TimeResponder
from protocol.engines.retransmission import Partner
from protocol.errors import LocalProtocolError
from protocol.events import CommandRequested, ControlRequested, Event, RemoteLog, VehicleLost
from protocol.keyring import Keyring, Verdict
from protocol.plans.mission import MissionItem

__all__ = ["GROUND_SYSTEM", "GroundEndpoint"]

GROUND_SYSTEM = 255
_HEARTBEAT = mavlink.MAVLink_heartbeat_message(
    type=mavlink.MAV_TYPE_GCS,
    autopilot=mavlink.MAV_AUTOPILOT_INVALID,
    base_mode=0,
    custom_mode=0,
    system_status=mavlink.MAV_STATE_ACTIVE,
    mavlink_version=3,
)


class GroundEndpoint:
    """Hand in datagrams and time, then drain ``datagrams_to_send()`` and ``events()``.

    The first autopilot that is heard becomes the vehicle, or the first whose system id is ``vehicle``. When its
    HEARTBEAT stays away for 3 s, commands are given up: nobody wants them executed by a vehicle that comes back later.
    Transfers go on until their own patience ends.

    With a key in the keyring, only what is signed with it is believed: an unsigned HEARTBEAT makes no vehicle, it only
    shows in ``unsigned_vehicle``.
    """

    def __init__(
        self,
        *,
        system: int = GROUND_SYSTEM,
        component: int = 190,
        keyring: Keyring | None = None,
        vehicle: int | None = None,
    ) -> None:
        self.heard_unbelieved = (
            False  # the last datagram was of an autopilot that does not sign, or signs with old time
        )
        self.unsigned_vehicle: Source | None = None  # an autopilot whose last HEARTBEAT was not signed as it should be
        self.keyring = keyring or Keyring()
        self.codec = Codec(system, component, self.keyring.link(None))
        self._source, self._monitor = HeartbeatSource(), HeartbeatMonitor(system=vehicle)
        self._commands = CommandClient(system, component)
        self._partner = Partner()
        self._parameters = ParameterClient(system, component, self._partner)
        self._mission = MissionClient(system, component, self._partner)
        self._times = TimeResponder(system, component)
        self._orders = CommandServer(system, component, {mavlink.MAV_CMD_REQUEST_OPERATOR_CONTROL})
        self._files, self._logs = FtpClient(system, component, self._partner), LogClient(self._partner)
        self._waiting = (self._commands, self._parameters, self._mission, self._files, self._logs)
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
        """True while a command, a transfer or a parameter waits for its end."""
        return any(engine.is_busy for engine in self._waiting)

    # The link

    def receive_datagram(self, data: bytes, now: float) -> list[Message]:
        """All messages of one datagram that are believed, already known to the engines. Never raises."""
        self.keyring.tell_time(now)
        self.heard_unbelieved, replayed = False, self.keyring.counts.get(Verdict.REPLAYED, 0)
        messages = [message for message in self.codec.decode(data) if self._believes(message)]
        self.heard_unbelieved |= self.keyring.counts.get(Verdict.REPLAYED, 0) > replayed
        for message in messages:
            self._monitor.receive(message, now)
            if source_of(message) == self.vehicle:
                self._partner.hear(message, now)
                for engine in self._waiting:
                    engine.receive(message, now)
                self._times.receive(message, now, Peer.of(message))
                self._orders.receive(message, now, Peer.of(message))
        self._take_orders(now)
        self._collect()
        return messages

    def handle_timer(self, now: float) -> None:
        """Let time pass: heartbeats, resends, loss of the vehicle."""
        self.keyring.tell_time(now)
        self._source.announce(_HEARTBEAT, now)
        self._source.handle_timer(now)
        self._monitor.handle_timer(now)
        self._collect()
        for engine in self._waiting:
            engine.handle_timer(now)
        self._collect()

    def next_deadline(self) -> float:
        """When ``handle_timer`` has something to do; the first time, at once."""
        started = self._source.next_deadline() < math.inf
        deadlines = [engine.next_deadline() for engine in (self._monitor, *self._waiting)]
        return min([self._source.next_deadline(), *deadlines]) if started else -math.inf

    def datagrams_to_send(self) -> list[bytes]:
        """What is to be sent, one frame each."""
        datagrams, self._datagrams = self._datagrams, []
        return datagrams

    def events(self) -> list[Event]:
        """What happened since the last call, in order."""
        events, self._events = self._events, []
        return events

    def give_up_requests(self, reason: str) -> None:
        """End all that waits for an answer: the vehicle that was asked will give none."""
        for engine in self._waiting:
            engine.cancel(reason)
        self._collect()

    # What the operator wants. All of it raises LocalProtocolError while no vehicle has been found.

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
        """COMMAND_LONG (MAV_CMD) until it is answered; NaN leaves a parameter to the vehicle.

        ``timeout`` [s] is the time between repetitions. Returns the number that ``CommandProgress`` and
        ``CommandDone`` will carry.
        """
        message = mavlink.MAVLink_command_long_message(*self._target(), command, 0, p1, p2, p3, p4, p5, p6, p7)
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
        """COMMAND_INT in a MAV_FRAME; x and y as wire integers (``units.to_e7``, ``units.local_e4``)."""
        message = mavlink.MAVLink_command_int_message(*self._target(), frame, command, 0, 0, p1, p2, p3, p4, x, y, z)
        return self._command(message, now, timeout)

    def cancel_command(self, request: int, now: float) -> None:
        """COMMAND_CANCEL for a command that ``command`` or ``command_int`` gave this number, until it is over."""
        self._commands.request_cancel(request, now)
        self._collect()

    def upload_mission(self, items: Sequence[MissionItem], *, now: float, kind: int = 0) -> None:
        """Replace the vehicle's plan of a MAV_MISSION_TYPE; ends in ``MissionUploaded`` or ``MissionFailed``."""
        self._mission.upload(self._target(), items, now, kind)
        self._collect()

    def download_mission(self, now: float, kind: int = 0) -> None:
        """Fetch the vehicle's plan of a MAV_MISSION_TYPE; ends in ``MissionDownloaded`` or ``MissionFailed``."""
        self._mission.download(self._target(), now, kind)
        self._collect()

    def clear_mission(self, now: float, kind: int = 0) -> None:
        """Delete the plan of a MAV_MISSION_TYPE, 255: all; ends in ``MissionCleared`` or ``MissionFailed``."""
        self._mission.clear(self._target(), now, kind)
        self._collect()

    def set_current_mission_item(self, seq: int, now: float) -> None:
        """Let the mission go on at item ``seq``; ends in ``CurrentItemSet`` or ``MissionFailed``."""
        self._mission.set_current(self._target(), seq, now)
        self._collect()

    def cancel_mission_transfer(self) -> None:
        """Stop what ``upload_mission`` and its sisters began; the vehicle keeps its old plan."""
        self._mission.cancel("cancelled")
        self._collect()

    def request_parameters(self, now: float) -> None:
        """Fetch the whole parameter table; ends in ``ParametersComplete`` or ``ParameterFailed``."""
        self._parameters.request_all(self._target(), now)
        self._collect()

    def set_parameter(self, name: str, value: float, now: float) -> None:
        """Set one parameter; ends in ``ParameterConfirmed`` or ``ParameterFailed``."""
        self._parameters.set(self._target(), name, value, now)
        self._collect()

    def send_key(self, key: bytes, timestamp: int, target: Source) -> None:
        """Ask a vehicle once to take a signing key (SETUP_SIGNING); it shows that it did by signing with it.

        The key is readable on the wire, signed or not: the caller must know that nobody else listens.
        """
        self.send(mavlink.MAVLink_setup_signing_message(*target, list(key), timestamp))

    def list_files(self, path: str, now: float) -> None:
        """See what a folder of the vehicle holds; ends in ``FileListed`` or ``FileFailed``."""
        self._files.request_list(self._target(), path, now)
        self._collect()

    def read_file(self, path: str, now: float) -> None:
        """Download a file of the vehicle; ends in ``FileReceived`` or ``FileFailed``."""
        self._files.read(self._target(), path, now)
        self._collect()

    def sum_file(self, path: str, now: float) -> None:
        """Have the vehicle tell a file's checksum; ends in ``FileSummed`` or ``FileFailed``."""
        self._files.checksum(self._target(), path, now)
        self._collect()

    def list_logs(self, now: float) -> None:
        """See what flights the vehicle has recorded; ends in ``LogsListed`` or ``LogFailed``."""
        self._logs.request_list(self._target(), now)
        self._collect()

    def fetch_log(self, log: RemoteLog, now: float) -> None:
        """Download a log that was listed; ends in ``LogReceived`` or ``LogFailed``."""
        self._logs.fetch(self._target(), log, now)
        self._collect()

    def send(self, message: Message) -> None:
        """Send a message once, without waiting for an answer: set-points."""
        self._datagrams.append(self.codec.encode(message))

    def send_frame(self, frame: bytes) -> None:
        """Send a frame that is encoded already: one signed with a key that is not in force yet."""
        self._datagrams.append(frame)

    # Inside

    def _target(self) -> Source:
        if self.vehicle is None:
            raise LocalProtocolError("no vehicle has been found yet")
        return self.vehicle

    def _believes(self, message: Message) -> bool:
        believed = bool(message.get_signed()) or not self.keyring.is_on
        is_autopilot = message.get_type() == "HEARTBEAT" and message.autopilot != mavlink.MAV_AUTOPILOT_INVALID
        if is_autopilot and self._monitor.may_be(source_of(message)):
            self.heard_unbelieved = not believed
            self.unsigned_vehicle = None if believed else source_of(message)
        return believed

    def _command(self, message: Message, now: float, timeout: float | None) -> int:
        self.codec.check(message)
        request = self._commands.send(message, now, timeout=timeout)
        self._collect()
        return request

    def _take_orders(self, now: float) -> None:
        for event in self._orders.events():
            if isinstance(event, CommandRequested):
                asker = event.params[3]
                known = asker in range(1, 256)
                result = mavlink.MAV_RESULT_ACCEPTED if known else mavlink.MAV_RESULT_DENIED
                self._orders.acknowledge(event.request, result, now)
                self._events += [ControlRequested(int(asker))] if known else []

    def _collect(self) -> None:
        for event in self._monitor.events():
            self._events.append(event)
            if isinstance(event, VehicleLost):
                self._commands.cancel("vehicle lost")
        for engine in self._waiting:
            self._events += engine.events()
        messages = [m for engine in (self._source, *self._waiting) for m in engine.messages_to_send()]
        messages += [o.message for server in (self._times, self._orders) for o in server.messages_to_send()]
        self._datagrams += [self.codec.encode(message) for message in messages]
