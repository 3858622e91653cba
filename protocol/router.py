"""Forwarding between a vehicle's peers, as an autopilot does (https://mavlink.io/en/guide/routing.html).

A camera or a companion computer on one link and ground stations on others reach each other through the vehicle:

1. What is for nobody in particular (no target system, or 0) goes to every other peer.
2. What is for a component goes where that component was heard; component 0, or one of another system that was never
   heard, where its system was. What is for the vehicle alone stays here.
3. Nothing goes back where it came from, nor to a peer at which its sender was heard as well; and no frame goes on
   twice within ``REPEATED`` seconds. So two links to one partner, or a loop of routers, multiply nothing.

Bytes go on as they came: never encoded, numbered or signed anew. Frames are given here decoded, so what failed its
checksum, or is of no known message and therefore has none that can be checked, cannot go on.
"""

from collections import Counter
from collections.abc import Callable, Collection, Hashable, Mapping
from dataclasses import dataclass
from enum import Enum
from hashlib import blake2b
from types import MappingProxyType
from typing import NamedTuple

from protocol.codec import Message, Source, source_of
from protocol.dialect import mavlink
from protocol.engines.base import bound
from protocol.engines.budget import Budget

__all__ = ["Router", "RoutingStatistics", "Withheld", "target_of"]

COPIES_PER_SECOND = 1000.0  # datagrams that the frames of one peer may become
MOST_AT_ONCE = 250  # of these after a pause: what one datagram full of frames can set off
RESERVE_PER_SECOND = 200.0  # further copies, shared by all peers whose own budget is spent or only beginning
MOST_SOURCES = 16  # (system, component) pairs remembered per peer; one more replaces the one that said least
FORGOTTEN = 60.0  # a component that was silent for so long [s] is nowhere
REPEATED = 0.5  # [s] in which the same bytes are the same frame; sequence numbers wrap too soon to look further
MOST_RECENT = 1024  # frames remembered to know them again

SECRET = frozenset(  # messages that carry a key or a password
    {
        mavlink.MAVLINK_MSG_ID_SETUP_SIGNING,
        mavlink.MAVLINK_MSG_ID_AUTH_KEY,
        mavlink.MAVLINK_MSG_ID_CHANGE_OPERATOR_CONTROL,
        mavlink.MAVLINK_MSG_ID_WIFI_CONFIG_AP,
    }
)
LINK_LOCAL = frozenset({mavlink.MAVLINK_MSG_ID_RADIO_STATUS})  # a radio speaks of its own link


class Withheld(Enum):
    """Why a frame did not go on."""

    STRANGER = "its port has said nothing to the vehicle"
    SECRET = "a key or a password"  # noqa: S105 - not one itself
    LINK_LOCAL = "about its own link"
    NO_SENDER = "system 0 is nobody"
    NOBODY_THERE = "its target was never heard elsewhere"
    REPEATED = "went on already"
    TOO_MANY = "more than its peer may send on"


class RoutingStatistics(NamedTuple):
    """Counters of the router, as they were."""

    forwarded: int = 0  # frames that went on
    copies: int = 0  # datagrams they became
    withheld: Mapping[Withheld, int] = MappingProxyType({})  # frames by why they did not go on


@dataclass(slots=True)
class _Heard:
    frames: int = 0
    last: float = 0.0  # [s]


class _Neighbour:
    """A peer: who was heard at it, and how much it may still send on."""

    def __init__(self, now: float) -> None:
        # Empty at first: ports that change with every frame must not bring a full budget each.
        self.budget = Budget(COPIES_PER_SECOND, MOST_AT_ONCE, now)
        self.sources: dict[Source, _Heard] = {}

    def hear(self, source: Source, now: float) -> None:
        if source not in self.sources and len(self.sources) >= MOST_SOURCES:
            del self.sources[min(self.sources, key=lambda s: self.sources[s].frames)]
        heard = self.sources.setdefault(source, _Heard())
        heard.frames, heard.last = heard.frames + 1, now

    def forget(self, now: float) -> None:
        for source in [s for s, heard in self.sources.items() if now - heard.last > FORGOTTEN]:
            del self.sources[source]


class Router:
    """Decides where a frame goes on to, and remembers who was heard where.

    Args:
        system: Own system id.
        component: Own component id.
        peers: All peers there are now.
        readers: Of these, the ones that may hear what comes from a given one, which is not among them.
    """

    def __init__(
        self,
        system: int,
        component: int,
        peers: Callable[[], Collection[Hashable]],
        readers: Callable[[Hashable], Collection[Hashable]],
    ) -> None:
        self._ids = (system, component)
        self._peers, self._readers = peers, readers
        self._neighbours: dict[Hashable, _Neighbour] = {}
        self._reserve = Budget(RESERVE_PER_SECOND, RESERVE_PER_SECOND, 0.0, RESERVE_PER_SECOND)
        self._recent: dict[bytes, float] = {}  # digest of a frame that went on, and when
        self._forget_at = 0.0
        self._forwarded = self._copies = 0
        self._withheld: Counter[Withheld] = Counter()

    @property
    def statistics(self) -> RoutingStatistics:
        """What went on and what did not, since the start."""
        return RoutingStatistics(self._forwarded, self._copies, MappingProxyType(dict(self._withheld)))

    def forward(self, message: Message, origin: Hashable, now: float) -> list[tuple[Hashable, bytes]]:
        """The copies of a frame that are to be sent on, each with its peer; often none.

        Args:
            message: As it was decoded; its sender is believed and is not this vehicle.
            origin: The peer it came from; what comes from none of the peers goes nowhere.
            now: The link's time [s].
        """
        if origin not in self._peers():
            return self._withhold(Withheld.STRANGER) if self._peers() else []
        self._forget(now)
        source, target = source_of(message), target_of(message)
        neighbour = self._neighbour(origin, now)
        neighbour.hear(source, now)
        if target == self._ids:
            return []
        frame = bytes(message.get_msgbuf())
        digest = blake2b(frame, digest_size=16).digest()
        destinations = self._destinations(source, target, origin)
        reason = self._objection(message, target, destinations, digest)
        if reason is None and destinations and not self._is_paid(neighbour, len(destinations), now):
            reason = Withheld.TOO_MANY
        if reason is not None:
            return self._withhold(reason)
        if not destinations:
            return []
        self._recent[digest] = now
        bound(self._recent, MOST_RECENT)
        self._forwarded += 1
        self._copies += len(destinations)
        return [(peer, frame) for peer in destinations]

    def _withhold(self, reason: Withheld) -> list[tuple[Hashable, bytes]]:
        self._withheld[reason] += 1
        return []

    def _destinations(self, source: Source, target: Source, origin: Hashable) -> list[Hashable]:
        others = [peer for peer in self._readers(origin) if source not in self._heard_at(peer)]
        system, component = target
        if system == 0:
            return others
        is_known = any(target in neighbour.sources for neighbour in self._neighbours.values())
        if component and (is_known or system == self._ids[0]):
            return [peer for peer in others if target in self._heard_at(peer)]
        return [peer for peer in others if any(heard == system for heard, _ in self._heard_at(peer))]

    def _objection(
        self, message: Message, target: Source, destinations: list[Hashable], digest: bytes
    ) -> Withheld | None:
        if message.get_msgId() in SECRET:
            return Withheld.SECRET
        if message.get_msgId() in LINK_LOCAL:
            return Withheld.LINK_LOCAL
        if message.get_srcSystem() == 0:
            return Withheld.NO_SENDER
        if not destinations:
            is_ours = target[0] in {0, self._ids[0]} and target[1] in {0, self._ids[1]}
            return None if is_ours else Withheld.NOBODY_THERE
        return Withheld.REPEATED if digest in self._recent else None

    def _is_paid(self, neighbour: _Neighbour, copies: int, now: float) -> bool:
        return neighbour.budget.take(copies, now) or self._reserve.take(copies, now)

    def _heard_at(self, peer: Hashable) -> Collection[Source]:
        neighbour = self._neighbours.get(peer)
        return neighbour.sources if neighbour else ()

    def _neighbour(self, peer: Hashable, now: float) -> _Neighbour:
        if peer not in self._neighbours:
            present = self._peers()
            self._neighbours = {key: kept for key, kept in self._neighbours.items() if key in present}
            self._neighbours[peer] = _Neighbour(now)
        return self._neighbours[peer]

    def _forget(self, now: float) -> None:
        while self._recent and now - next(iter(self._recent.values())) > REPEATED:
            del self._recent[next(iter(self._recent))]
        if now >= self._forget_at:
            self._forget_at = now + 1.0
            for neighbour in self._neighbours.values():
                neighbour.forget(now)


def target_of(message: Message) -> Source:
    """(system, component) a message is for; 0 is everyone."""
    system = getattr(message, "target_system", 0)
    if message.get_msgId() == mavlink.MAVLINK_MSG_ID_MANUAL_CONTROL:
        system = message.target
    return system, getattr(message, "target_component", 0)
