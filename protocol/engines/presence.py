"""Who says that it is there: ground stations, and the vehicle's own companion computer.

A HEARTBEAT of MAV_TYPE_GCS is a ground station's, whatever its ids. One of MAV_TYPE_ONBOARD_CONTROLLER is the
companion's, if it comes from another component of the vehicle's own system: that of another vehicle is no link of
this one. So counts PX4.

https://mavlink.io/en/services/heartbeat.html
"""

from protocol.codec import Message
from protocol.dialect import mavlink
from protocol.engines.base import Peer

__all__ = ["Presence"]


class Presence:
    """When each was last heard, on the link's time [s]. It must be given only what is believed.

    Args:
        system: Own system id.
    """

    def __init__(self, system: int) -> None:
        self._system = system
        self._stations: dict[int, float] = {}  # by system id: no flood makes it longer than there are ids
        self._companion: float | None = None

    def hear(self, heartbeat: Message, now: float, peer: Peer) -> None:
        """Take a HEARTBEAT."""
        if heartbeat.type == mavlink.MAV_TYPE_GCS:
            self._stations[peer.system] = now
        elif heartbeat.type == mavlink.MAV_TYPE_ONBOARD_CONTROLLER and peer.system == self._system:
            self._companion = now

    def ground(self, now: float, system: int | None = None) -> float | None:
        """How long a ground station has been silent [s], None if it never spoke.

        Args:
            now: The link's time [s].
            system: Its system id; None: whichever spoke last.
        """
        heard = max(self._stations.values(), default=None) if system is None else self._stations.get(system)
        return None if heard is None else now - heard

    def companion(self, now: float) -> float | None:
        """How long the companion has been silent [s], None if it never spoke."""
        return None if self._companion is None else now - self._companion
