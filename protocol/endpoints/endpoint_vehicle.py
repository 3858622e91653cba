"""The vehicle's end of the link: one vehicle, many peers.

It composes the server engines, the links and the router. The autopilot decides; the endpoint does the communication.
"""

from __future__ import annotations

from collections.abc import Collection, Hashable, Iterable, Mapping, Sequence
from types import MappingProxyType

from protocol.dialect import mavlink
from protocol.endpoints.router import Links, Router, RoutingStatistics
from protocol.engines.base import Outgoing, Server
from protocol.engines.file_transfer import FileTree, LogStore, NoFiles
from protocol.engines.heartbeat import HEARTBEAT_PERIOD, HeartbeatSource, Presence, TimeResponder
from protocol.engines.server.command_server import UNKNOWN_PROGRESS, CommandServer
from protocol.engines.server.flight_plan_server import FlightPlanFileServer, FlightPlanServer
from protocol.engines.server.ftp_server import FtpServer
from protocol.engines.server.log_server import LogServer
from protocol.engines.server.mission_server import MissionInstead, MissionServer
from protocol.engines.server.operator_control import SETPOINT_MESSAGES, OperatorControl
from protocol.engines.server.parameter_server import ParameterServer, PutInForce
from protocol.engines.server.replies import split_text
from protocol.engines.server.stream_server import STREAM_COMMANDS, Audience, StreamServer
from protocol.engines.table_values import Parameter
from protocol.events import (
    CommandRequested,
    Event,
    MessageReceived,
    PoseReceived,
    PredictionRequested,
    SetpointReceived,
    SigningChanged,
)
from protocol.plans.plan import MissionItem, Validate
from protocol.ranges import refuse_command
from protocol.wire.codec import Statistics
from protocol.wire.message import Message, Peer, addressed_to
from protocol.wire.signing import Keyring

POSE_MESSAGES = frozenset({"ODOMETRY", "VISION_POSITION_ESTIMATE", "ATT_POS_MOCAP"})
"""Messages in which a peer tells where it has measured the vehicle to be."""
FIXED_STREAMS = {mavlink.MAVLINK_MSG_ID_HEARTBEAT: round(1e6 * HEARTBEAT_PERIOD)}  # interval [us] by id
_EVENTS = {
    **dict.fromkeys(SETPOINT_MESSAGES, SetpointReceived),
    **dict.fromkeys(POSE_MESSAGES, PoseReceived),
    "DARKO_LEGS_REQUEST": PredictionRequested,
}


class VehicleEndpoint:
    """Hand in datagrams, take events, acknowledge, publish, then drain ``datagrams_to_send()``.

    ``now`` is the link's time [s]; only ``streams_due`` uses the vehicle's own, simulated time [us].

    Args:
        system: Own system id.
        component: Own component id.
        commands: MAV_CMD numbers the vehicle supports; requests for messages and intervals are answered here.
        parameters: The parameter table with its current values.
        put_in_force: Has the last word about a parameter's new value.
        mission: The plan in force.
        validate: Checks a complete new plan; a refusal keeps the old one.
        plans: Fence and rally points in force by MAV_MISSION_TYPE, each with its own ``validate``.
        streams: Interval [us] per id of the messages the vehicle streams, -1 for off.
        on_request: Ids of further messages it sends on request.
        numbered: Number of instances per id, for messages that are requested by number.
        families: Groups of ids that a peer gets only once it has asked for one of the group.
        peers: Destinations that get all messages from the start; each sender of a valid frame is added. None leaves
            that to the transport.
        keyring: Signs and judges frames; without it no frame is signed and all are accepted.
        files: The files that peers may list and read over MAVLink FTP.
        logs: Recorded flights they may list and download.
        forwards: Forward frames from peer to peer; of several vehicles on one port, one does.
    """

    def __init__(
        self,
        *,
        system: int = 1,
        component: int = 1,
        commands: Iterable[int] = (),
        parameters: Sequence[Parameter] = (),
        put_in_force: PutInForce = lambda _parameter: "",
        mission: Sequence[MissionItem] = (),
        validate: Validate,
        plans: Mapping[int, tuple[Sequence[MissionItem], Validate]] = MappingProxyType({}),
        streams: Mapping[int, int] = MappingProxyType({}),
        on_request: Iterable[int] = (),
        numbered: Mapping[int, int] = MappingProxyType({}),
        families: Iterable[Collection[int]] = (),
        peers: Iterable[Hashable] | None = None,
        keyring: Keyring | None = None,
        files: FileTree | None = None,
        logs: LogStore | None = None,
        forwards: bool = True,
    ) -> None:
        self.forwards, self.presence = forwards, Presence(system)
        self._ids, self._keyring = (system, component), keyring or Keyring()
        self._links = Links(system, component, peers, self._keyring)
        self._router = Router(system, component, self._links.peers, self._links.readers)
        self._commands = CommandServer(
            *self._ids, frozenset(commands) | STREAM_COMMANDS, STREAM_COMMANDS, refuse_command
        )
        self._parameters = ParameterServer(*self._ids, parameters, put_in_force)
        self._mission = MissionServer(*self._ids, mission, validate=validate, others=plans)
        self._files, self._logs = FtpServer(*self._ids, files or NoFiles()), LogServer(*self._ids, logs or NoFiles())
        self.flight_plan, self.flight_plan_files = FlightPlanServer(*self._ids), FlightPlanFileServer(*self._ids)
        links = None if peers is None else self._links.codecs.keys()
        self._streams = StreamServer(
            *self._ids, streams, on_request, numbered=numbered, families=families, fixed=FIXED_STREAMS, links=links
        )
        self.operator, self._heartbeat = OperatorControl(*self._ids), HeartbeatSource()
        self._timed = (self._heartbeat, self.operator, self._parameters, self._mission, self._files, self._logs)
        self._servers = self._in_order()
        self._server_of = {name: server for server in self._servers for name in server.handles}
        self._datagrams: list[tuple[Hashable | None, bytes]] = []
        self._events: list[Event] = []
        self._texts = 0

    def _in_order(self) -> tuple[Server, ...]:
        """The servers, in the order in which what they leave is sent."""
        return (
            *(self.operator, self._commands, self._parameters, self._mission, TimeResponder(*self._ids)),
            *(self._files, self._logs, self.flight_plan, self.flight_plan_files, self._streams),
        )

    @property
    def statistics(self) -> dict[Hashable, Statistics]:
        """Counters per peer; under None when the peers share one codec."""
        return {key: codec.statistics for key, codec in self._links.codecs.items()}

    @property
    def routing(self) -> RoutingStatistics:
        """Counters of frames forwarded from peer to peer."""
        return self._router.statistics

    @property
    def mission(self) -> tuple[MissionItem, ...]:
        """The plan in force."""
        return self._mission.items

    def show_instead_of_mission(self, shown: MissionInstead | None) -> None:
        """Let peers see something else than the mission, which they cannot change meanwhile; None: the mission."""
        self._mission.show_instead(shown)
        self._drain(self._mission)

    def plan(self, kind: int) -> tuple[MissionItem, ...]:
        """The plan, fence or rally points (MAV_MISSION_TYPE) in force."""
        return self._mission.plan(kind)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The parameter table with its current values."""
        return self._parameters.table

    # The link

    def add_peer(self, key: Hashable) -> None:
        """Add a peer that has not sent anything yet, such as one from before a restart."""
        self._links.codec(key)

    def receive_datagram(self, data: bytes, key: Hashable, now: float) -> None:
        """Take one datagram; answers go to ``key``. After this call: take ``events()``."""
        self._keyring.advance_time(now)
        for message in self._links.decode(data, key, now):
            peer = Peer.of(message, key)
            if peer[:2] != self._ids and self._links.accepts(message):
                if self.forwards:
                    self._datagrams += self._router.forward(message, key, now)
                self._receive(message, now, peer)
                self._collect(now)

    def handle_timer(self, now: float) -> None:
        """Let time pass: heartbeats, repetitions, long answers."""
        self._keyring.advance_time(now)
        try:
            for engine in self._timed:
                engine.handle_timer(now)
        finally:  # an error of one engine must not withhold what the others have to send
            self._collect(now)

    def next_deadline(self) -> float:
        """Link time at which ``handle_timer`` must be called next [s]."""
        return min(engine.next_deadline() for engine in (self._keyring, *self._timed))

    def datagrams_to_send(self) -> list[tuple[Hashable | None, bytes]]:
        """Datagrams to send now, each to one peer or (None) to all."""
        datagrams, self._datagrams = self._datagrams, []
        return datagrams

    def events(self) -> list[Event]:
        """Events since the last call, in order."""
        events, self._events = self._events, []
        return events

    # Messages of the vehicle

    def announce(self, heartbeat: Message, now: float) -> None:
        """Set the HEARTBEAT to send every second from now on, and at once if it changed."""
        self._heartbeat.announce(heartbeat, now)
        self._collect(now)

    def publish(self, message: Message, to: Audience = None) -> None:
        """Send a message to some links; None means all that get messages of its family.

        Raises:
            LocalProtocolError: A field does not fit the wire.
        """
        to = self._streams.audience(message.get_msgId()) if to is None else to
        for peer in (None,) if to is None else (Peer(0, 0, key) for key in to):  # 0: every system on that link
            self._send(message, peer)

    def send(self, message: Message, peer: Peer | None) -> None:
        """Send a message to one peer; None means all that get messages of its family.

        Raises:
            LocalProtocolError: A field does not fit the wire.
        """
        if peer is None:
            self.publish(message)
        else:
            self._send(message, peer)

    def _send(self, message: Message, peer: Peer | None) -> None:
        if message.get_type() == "MISSION_CURRENT":
            self._mission.mark(message)
        elif message.get_type() == "DARKO_PLAN_STATUS":
            self.flight_plan.mark(message)
        self._put(Outgoing(peer, message))

    def status_text(self, severity: int, text: str, *, but: Peer | None = None) -> None:
        """Send STATUSTEXT (MAV_SEVERITY) to everyone, or to all but the link of a peer; in several if it is long."""
        self._texts = self._texts % 0xFFFF + 1
        to = None if but is None else tuple(key for key in self._links.peers() if key != but.key)
        for message in split_text(severity, text, self._texts):
            self.publish(message, to)

    def acknowledge(
        self, request: int, result: int, now: float, *, progress: int = UNKNOWN_PROGRESS, detail: int = 0
    ) -> None:
        """Answer a ``CommandRequested`` with a MAV_RESULT; after IN_PROGRESS the final one must follow.

        Raises:
            LocalProtocolError: There is no such request, or it has its final answer already.
        """
        self._commands.acknowledge(request, result, now, progress=progress, detail=detail)
        self._collect(now)

    def set_parameter(self, name: str, value: float) -> None:
        """Change a parameter from the vehicle's side; the new value is broadcast.

        Raises:
            LocalProtocolError: There is no such parameter, or the value is outside its range.
        """
        self._parameters.set(name, value)
        self._drain(self._parameters)

    def streams_due(self, time_us: int) -> dict[int, Audience]:
        """Ids of the messages to publish at this time of the vehicle [us], ascending, with the links that get them."""
        return self._streams.due(time_us)

    def next_stream_due(self) -> float:
        """Time of the next stream message that is due, on the vehicle's clock [us]; infinity if all are off."""
        return self._streams.next_due()

    # Inside

    def _receive(self, message: Message, now: float, peer: Peer) -> None:
        kind = message.get_type()
        server = self._server_of.get(kind)
        if self.operator.is_asked(message):  # whoever asks for control knows its status, and wants it
            self._streams.ask_for(mavlink.MAVLINK_MSG_ID_CONTROL_STATUS, peer)
        if not self.operator.admits(message, now, peer):
            return
        if server is not None:
            server.receive(message, now, peer)
        elif kind == "HEARTBEAT":
            self.presence.hear(message, now, peer)
        elif kind == "SETUP_SIGNING":
            if addressed_to(message, *self._ids):  # no event carries the key: nobody else may see it
                key, initial = bytes(message.secret_key), message.initial_timestamp
                self._keyring.propose(peer.key, key, initial, signed=message.get_signed())
        elif addressed_to(message, *self._ids):
            self._events.append(_EVENTS.get(kind, MessageReceived)(message, peer))

    def _collect(self, now: float) -> None:
        self._events += [SigningChanged(*change) for change in self._keyring.changes()]
        for outgoing in self._heartbeat.messages_to_send():
            self._put(Outgoing(None, outgoing))
        for server in self._servers:
            for event in server.events():
                if isinstance(event, CommandRequested) and event.command in STREAM_COMMANDS:
                    self._serve_stream(event, now)
                else:
                    self._events.append(event)
            self._drain(server)

    def _drain(self, server: Server) -> None:
        for outgoing in server.messages_to_send():
            self._put(outgoing)

    def _put(self, outgoing: Outgoing) -> None:
        self._datagrams.extend(self._links.encode(outgoing))

    def _serve_stream(self, event: CommandRequested, now: float) -> None:
        result = self._streams.serve(event, now)
        self._drain(self._streams)
        self._commands.acknowledge(event.request, result, now)
