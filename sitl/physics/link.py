"""The common part of the links to autopilots: bytes and time in, bytes out; no socket and no clock."""

from __future__ import annotations

import math
from collections.abc import Hashable

from sitl.physics.rig import Rig

Datagram = tuple[bytes, Hashable]  # with its destination


class Link:
    """One autopilot and its vehicle.

    The socket loop hands over what arrives, asks :meth:`wants` how far to fly, and when pause and speed allow it has
    :meth:`step` fly so far.

    Args:
        rig: The vehicle.
    """

    default_port, port_step = 0, 10  # of the first instance; from one to the next
    is_stream = False  # whether its socket is a TCP server

    def __init__(self, rig: Rig) -> None:
        self.rig, self.journal = rig, rig.journal

    def opened(self, now: float) -> None:
        """A connection was made; only of a stream."""

    def closed(self, now: float) -> None:
        """The connection is gone; only of a stream."""

    def receive(self, data: bytes, peer: Hashable, now: float) -> list[Datagram]:
        """Take a datagram, or some bytes of a stream; gives what is to be sent at once."""
        raise NotImplementedError

    def poll(self, now: float) -> list[Datagram]:  # noqa: ARG002 - of those who repeat something
        """Datagrams to be sent without having been asked for."""
        return []

    def wants(self, now: float) -> int:
        """Control periods to fly now; 0: the autopilot's answer is awaited."""
        raise NotImplementedError

    def step(self, now: float) -> list[Datagram]:
        """Fly them; gives what is to be sent."""
        raise NotImplementedError

    def wakes(self) -> float:
        """Time to be looked at again although nothing arrives, on the clock of ``now`` [s]."""
        return math.inf
