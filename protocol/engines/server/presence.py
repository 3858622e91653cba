"""Presence of ground stations and of the vehicle's own companion computer, by their HEARTBEATs.

A HEARTBEAT of MAV_TYPE_GCS comes from a ground station, whatever its ids. One of MAV_TYPE_ONBOARD_CONTROLLER comes
from the companion computer if it is of the vehicle's own system; that of another vehicle does not count. PX4 has the
same rules.

https://mavlink.io/en/services/heartbeat.html
"""

from protocol.dialect import mavlink
from protocol.wire.message import Message, Peer

__all__ = ["Presence"]


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
