"""Vehicles that fly in one process: to the loop that serves them they are one node.

Each has its turn when its own next step is due. They begin at different moments: most telemetry is due at whole tenths
of a vehicle's second, and if all had these together, packing it for ten vehicles would take longer than a tick.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Hashable, Iterator, Mapping
from contextlib import contextmanager

from protocol.engines.base import drop_oldest
from protocol.wire.framing import EVERYONE, target_systems
from sitl.errors import SitlError
from sitl.mavlink.node import Node
from sitl.mavlink.services.maintenance_commands import ExitRequest
from sitl.timing import PERIOD
from sitl.tools.error_guard import ErrorGuard, place_of

MAX_KNOWN_PEERS = 64
IDLE_PERIODS = 10  # control periods to the next look, where no vehicle is left
GOLDEN_TURN = 309  # control periods between first turns: 0.618 s, so that they are spread over second and tick alike


class Squadron:
    """Gives each vehicle the datagrams that are for it, and flies each in its turn.

    A vehicle gets what names its system or none. The first datagram of a peer goes to all, so that each speaks to it.
    What names a system that is no vehicle of the fleet goes to the vehicle that forwards (``Node``'s ``forwards``).

    A vehicle that cannot fly on, for an error, is left out: the others fly on.

    Args:
        nodes: The vehicles by system id.
        fleet: System ids of all vehicles on the port, also of those in other processes.
        reboot: Builds a vehicle anew, by its system id.
        tell: Tells a person which vehicle cannot fly on, and why.

    Attributes:
        nodes: The vehicles that fly, by system id.
        lost: How many cannot fly on.
    """

    def __init__(
        self,
        nodes: Mapping[int, Node],
        fleet: Collection[int],
        reboot: Callable[[int], Node],
        tell: Callable[[str], None] = lambda _line: None,
    ) -> None:
        self.nodes, self.lost = dict(nodes), 0
        self._fleet, self._reboot, self._tell = frozenset(fleet), reboot, tell
        self._clock = 0  # common time [control periods]
        self._due = {system: _first_turn(place) for place, system in enumerate(self.nodes)}
        self._turn: dict[int, int] = {}  # who flies now, by how many periods
        self._speaking: set[int] = set()
        self._known: dict[Hashable, None] = {}  # peers that all vehicles have heard

    def receive(self, data: bytes, peer: Hashable, now: float) -> None:
        """Take one datagram (as ``Node.receive``)."""
        targets = target_systems(data)
        if not targets:
            return
        for_all = EVERYONE in targets or peer not in self._known
        self._known[peer] = None
        drop_oldest(self._known, MAX_KNOWN_PEERS)
        for system, node in list(self.nodes.items()):
            if for_all or system in targets or (node.forwards and not targets <= self._fleet):
                with self._losing(system):
                    node.receive(data, peer, now)
                    self._speaking.add(system)

    def periods_to_fly(self) -> int:
        """Control periods until the next vehicle's turn, after those whose turn is now have flown."""
        self._turn = {system: node.periods_to_fly() for system, node in self.nodes.items() if self._is_due(system)}
        due = (self._due[system] + self._turn.get(system, 0) for system in self.nodes)
        return min(due, default=self._clock + IDLE_PERIODS) - self._clock

    def advance(self, periods: int) -> None:
        """Fly those whose turn is now, and let the common time pass."""
        for system, own in self._turn.items():
            if system not in self.nodes:
                continue
            with self._losing(system):
                self.nodes[system].advance(own)
            self._due[system] += own
        self._speaking |= self._turn.keys()
        self._clock += periods

    def _is_due(self, system: int) -> bool:
        return self._due[system] <= self._clock

    def datagrams(self, now: float) -> list[tuple[Hashable | None, bytes]]:
        """Datagrams of the vehicles that have flown or heard something (as ``Node.datagrams``)."""
        speaking, self._speaking = self._speaking & self.nodes.keys(), set()
        said: list[tuple[Hashable | None, bytes]] = []
        for system in sorted(speaking):
            with self._losing(system):
                said += self.nodes[system].datagrams(now)
        return said

    @contextmanager
    def _losing(self, system: int) -> Iterator[None]:
        """Leave a vehicle out after an error; one that is not expected is raised where errors are to be seen."""
        try:
            yield
        except Exception as error:
            if ErrorGuard.raises and not isinstance(error, SitlError):
                raise
            where = "" if isinstance(error, SitlError) else f"internal error in {place_of(error)}: "
            self._tell(f"vehicle {system} cannot fly on: {where}{error}")
            self.nodes.pop(system, None)
            self.lost += 1

    def is_over(self) -> bool:
        """Let vehicles end or boot anew that were asked to; true once none is left."""
        for system, node in list(self.nodes.items()):
            if node.exit_request is ExitRequest.REBOOT:
                with self._losing(system):
                    self.nodes[system] = fresh = self._reboot(system)
                    fresh.know(node.peers)
            elif node.exit_request is not None:
                del self.nodes[system]
        return not self.nodes


def _first_turn(place: int) -> int:
    """First turn of a vehicle [control periods], by its place among those of the process: within the first second."""
    return place * GOLDEN_TURN % round(1.0 / PERIOD)
