"""Vehicles that fly in step in one process: to the loop that serves them they are one node."""

from __future__ import annotations

from collections.abc import Callable, Collection, Hashable, Mapping
from itertools import chain

from protocol.engines.base import drop_oldest
from protocol.frame_targets import EVERYONE, target_systems
from sitl.errors import SitlError
from sitl.mavlink.node import Node
from sitl.mavlink.services.maintenance_commands import ExitRequest

MAX_KNOWN_PEERS = 64


class Squadron:
    """Gives each vehicle the datagrams that are for it, and flies all of them by the same number of periods.

    A vehicle gets what names its system or none. The first datagram of a peer goes to all, so that each speaks to it.
    What names a system that is no vehicle of the fleet goes to the vehicle that forwards (``Node``'s ``forwards``).

    Args:
        nodes: The vehicles by system id.
        fleet: System ids of all vehicles on the port, also of those in other processes.
        reboot: Builds a vehicle anew, by its system id.
    """

    def __init__(self, nodes: Mapping[int, Node], fleet: Collection[int], reboot: Callable[[int], Node]) -> None:
        self.nodes = dict(nodes)
        self._fleet, self._reboot = frozenset(fleet), reboot
        self._known: dict[Hashable, None] = {}  # peers that all vehicles have heard

    def receive(self, data: bytes, peer: Hashable, now: float) -> None:
        """Take one datagram (as ``Node.receive``)."""
        targets = target_systems(data)
        if not targets:
            return
        for_all = EVERYONE in targets or peer not in self._known
        self._known[peer] = None
        drop_oldest(self._known, MAX_KNOWN_PEERS)
        for system, node in self.nodes.items():
            if for_all or system in targets or (node.forwards and not targets <= self._fleet):
                node.receive(data, peer, now)

    def periods_to_fly(self) -> int:
        """Control periods until one of the vehicles has something to do on the link (as ``Node.periods_to_fly``)."""
        return min(node.periods_to_fly() for node in self.nodes.values())

    def advance(self, periods: int) -> None:
        """Fly all.

        Raises:
            SitlError: One of them leaves the finite numbers; the message names it.
        """
        for system, node in self.nodes.items():
            try:
                node.advance(periods)
            except SitlError as error:
                raise SitlError(f"vehicle {system}: {error}") from error

    def datagrams(self, now: float) -> list[tuple[Hashable | None, bytes]]:
        """What is to be sent (as ``Node.datagrams``)."""
        return list(chain.from_iterable(node.datagrams(now) for node in self.nodes.values()))

    def is_over(self) -> bool:
        """Let vehicles end or boot anew that were asked to; true once none is left."""
        for system, node in list(self.nodes.items()):
            if node.exit_request is ExitRequest.REBOOT:
                self.nodes[system] = fresh = self._reboot(system)
                fresh.know(node.peers)
            elif node.exit_request is not None:
                del self.nodes[system]
        return not self.nodes
