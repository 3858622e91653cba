"""HEARTBEAT of both sides (https://mavlink.io/en/services/heartbeat.html), and answers to TIMESYNC and PING.

A HEARTBEAT of MAV_TYPE_GCS comes from a ground station, whatever its ids. One of MAV_TYPE_ONBOARD_CONTROLLER comes
from the companion computer if it is of the vehicle's own system; that of another vehicle does not count. PX4 has the
same rules.

https://mavlink.io/en/services/heartbeat.html
"""

from __future__ import annotations

import math

from protocol.dialect import mavlink
from protocol.engines.base import Engine, Server, TransitionTable, fire
from protocol.events import VehicleFound, VehicleLost, VehicleReturned
from protocol.wire.message import Message, Peer, Source, addressed_to, source_of

HEARTBEAT_PERIOD = 1.0  # [s]


class HeartbeatSource(Engine[Message]):
    """Sends HEARTBEAT every second, and at once when its content changes."""

    def __init__(self, period: float = HEARTBEAT_PERIOD) -> None:
        super().__init__()
        self._period = period
        self._message: Message | None = None
        self._deadline = math.inf

    def announce(self, message: Message, now: float) -> None:
        """Set the HEARTBEAT to send from now on. After this call: drain ``messages_to_send()``."""
        if self._message is None or message.to_dict() != self._message.to_dict():
            self._message = message
            self._send()
            self._deadline = now + self._period

    def next_deadline(self) -> float:
        """Link time at which the next HEARTBEAT is due [s]."""
        return self._deadline

    def handle_timer(self, now: float) -> None:
        """Send if due; beats that a late caller missed are not sent later."""
        if now >= self._deadline:
            self._send()
            self._deadline += self._period * (1 + math.floor((now - self._deadline) / self._period))

    def _send(self) -> None:
        self._out.append(self._message)


HEARTBEAT_TIMEOUT = 3.0  # [s] of silence after which a vehicle counts as lost

VEHICLE_MONITOR_TRANSITIONS: TransitionTable = {
    ("searching", "heartbeat"): "present",
    ("present", "heartbeat"): "present",
    ("present", "silence"): "lost",
    ("lost", "heartbeat"): "present",
}


class VehicleMonitor(Engine[Message]):
    """Finds the autopilot (component 1), notices its silence and its return.

    The first autopilot heard stays the vehicle, also while it is lost. Otherwise another one that appears during the
    silence would receive the messages meant for it, and stay the vehicle after its return.

    Args:
        timeout: Silence after which it is lost [s].
        system: The system id it must have; None accepts any.
    """

    def __init__(self, timeout: float = HEARTBEAT_TIMEOUT, system: int | None = None) -> None:
        super().__init__()
        self._system = system
        self.state = "searching"
        self.vehicle: Source | None = None
        self._timeout, self._heard = timeout, -math.inf

    @property
    def is_present(self) -> bool:
        """True while HEARTBEATs arrive."""
        return self.state == "present"

    def receive(self, message: Message, now: float) -> None:
        """Take a HEARTBEAT; those of ground stations, other components and further vehicles are ignored."""
        if message.get_type() != "HEARTBEAT" or not _is_autopilot(message):
            return
        source = source_of(message)
        if not self.may_be(source):
            return
        if self.vehicle is None:
            self._events.append(VehicleFound(*source))
        elif self.state == "lost":
            self._events.append(VehicleReturned(now - self._heard))
        self.state = fire(VEHICLE_MONITOR_TRANSITIONS, self.state, "heartbeat")
        self.vehicle, self._heard = source, now

    def may_be(self, source: Source) -> bool:
        """Whether a sender is the vehicle, or could become it."""
        return self.vehicle in {None, source} and self._system in {None, source[0]}

    def next_deadline(self) -> float:
        """Link time at which a silent vehicle is declared lost [s]."""
        return self._heard + self._timeout if self.is_present else math.inf

    def handle_timer(self, now: float) -> None:
        """Declare the vehicle lost if it has been silent for too long."""
        if now >= self.next_deadline():
            self.state = fire(VEHICLE_MONITOR_TRANSITIONS, self.state, "silence")
            self._events.append(VehicleLost(now - self._heard))


def _is_autopilot(message: Message) -> bool:
    return bool(
        message.get_srcComponent() == mavlink.MAV_COMP_ID_AUTOPILOT1
        and message.type != mavlink.MAV_TYPE_GCS
        and message.autopilot != mavlink.MAV_AUTOPILOT_INVALID
    )


class Presence:
    """Times at which each was last heard, in link time [s]. It must only get messages that are accepted.

    Args:
        system: Own system id.
    """

    def __init__(self, system: int) -> None:
        self._system = system
        self._stations: dict[int, float] = {}  # by system id: at most 256 entries
        self._companion: float | None = None

    def hear(self, heartbeat: Message, now: float, peer: Peer) -> None:
        """Take a HEARTBEAT."""
        if heartbeat.type == mavlink.MAV_TYPE_GCS:
            self._stations[peer.system] = now
        elif heartbeat.type == mavlink.MAV_TYPE_ONBOARD_CONTROLLER and peer.system == self._system:
            self._companion = now

    def ground(self, now: float, system: int | None = None) -> float | None:
        """Time since a ground station was heard [s], None if it was never heard.

        Args:
            now: The link's time [s].
            system: Its system id; None: the station heard last.
        """
        heard = max(self._stations.values(), default=None) if system is None else self._stations.get(system)
        return None if heard is None else now - heard

    def companion(self, now: float) -> float | None:
        """Time since the companion was heard [s], None if it was never heard."""
        return None if self._companion is None else now - self._companion


_ALL = (0, 0)  # target of a PING request; a peer with these ids is not answered, or the answers would never end


class TimeResponder(Server):
    """Answers requests to this component or to all; it has no state."""

    handles = frozenset({"TIMESYNC", "PING"})

    def __init__(self, system: int, component: int) -> None:
        super().__init__()
        self._system, self._component = system, component

    def receive(self, message: Message, now: float, peer: Peer) -> None:
        """Take a TIMESYNC or a PING."""
        if not addressed_to(message, self._system, self._component):
            return
        if message.get_type() == "TIMESYNC" and message.tc1 == 0:
            own = max(round(now * 1e9), 1)  # [ns]; with 0 the answer would be a request
            self._reply(peer, mavlink.MAVLink_timesync_message(tc1=own, ts1=message.ts1))
        elif message.get_type() == "PING" and (message.target_system, message.target_component) == _ALL != peer[:2]:
            answer = mavlink.MAVLink_ping_message(message.time_usec, message.seq, peer.system, peer.component)
            self._reply(peer, answer)  # a PING with a target is an answer
