"""Answers TIMESYNC and PING (https://mavlink.io/en/services/timesync.html, ping.html)."""

from protocol.dialect import mavlink
from protocol.engines.base import Server
from protocol.wire.message import Message, Peer, addressed_to

__all__ = ["TimeResponder"]

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
