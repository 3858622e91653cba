"""Links of a vehicle to its peers, and the router between them (https://mavlink.io/en/guide/routing.html).

A camera or a companion computer on one link and ground stations on others reach each other through the vehicle:

1. A message without a target system, or with target system 0, goes to every other peer.
2. A message for a component goes to the peers at which that component was heard. For component 0, or an unknown
   component of another system, it goes to the peers at which the system was heard. A message for the vehicle alone is
   not forwarded.
3. A message never goes back to the peer it came from, nor to a peer at which its sender was heard as well. The same
   frame is not forwarded twice within ``DUPLICATE_WINDOW`` seconds. So two links to the same system, or a loop of
   routers, multiply nothing.

Bytes are forwarded unchanged: never encoded, numbered or signed anew. Only decoded frames get here, so a frame with a
wrong checksum, or of an unknown message whose checksum cannot be verified, is not forwarded.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Hashable, Iterable, Mapping
from dataclasses import dataclass
from enum import Enum
from hashlib import blake2b
from types import MappingProxyType
from typing import NamedTuple

from protocol.dialect import mavlink
from protocol.engines.base import DUPLICATE_WINDOW, Outgoing, drop_oldest
from protocol.tools.timing import TokenBucket
from protocol.wire.codec import Codec
from protocol.wire.message import Message, Source, addressed_to, source_of, target_of
from protocol.wire.signing import Keyring

# One more replaces one that is gone, or else the one heard in the fewest seconds: a flood displaces no peer.
MAX_LEARNED_PEERS = 16
PEER_TIMEOUT = 60.0  # [s] of silence after which a peer counts as gone


@dataclass(slots=True)
class _LearnedPeer:
    """A peer that was not configured, but sent a valid frame."""

    heard: float  # when it was heard last [s]
    seconds: int = 1  # in how many seconds it was heard: many frames within one second count once

    def hear(self, now: float) -> None:
        self.seconds += int(now) != int(self.heard)
        self.heard = now


class Links:
    """Decides which peer gets which frame, with its own sequence numbers.

    Sequence numbers count per link, and clients take every gap for a loss: an answer to one peer must not leave a gap
    in the numbers of the others. So each peer has its own codec. Without a list of peers the transport itself sends to
    everyone, and all peers share one codec.
    """

    def __init__(self, system: int, component: int, peers: Iterable[Hashable] | None, keyring: Keyring) -> None:
        self._ids, self._keyring = (system, component), keyring
        self._fixed = None if peers is None else tuple(peers)
        self.codecs: dict[Hashable, Codec] = {key: self._new(key) for key in self._fixed or ()}
        self._learned: dict[Hashable, _LearnedPeer] = {}
        self._now = 0.0

    def codec(self, key: Hashable) -> Codec:
        """The codec of a peer; a new peer is added."""
        key = None if self._fixed is None else key
        if key not in self.codecs:
            self._add(key, self._new(key))
        return self.codecs[key]

    def decode(self, data: bytes, key: Hashable, now: float) -> list[Message]:
        """The messages of a datagram; an unknown sender becomes a peer with its first accepted frame."""
        self._now = now
        name = None if self._fixed is None else key
        codec = self.codecs.get(name) or self._new(name)
        messages = codec.decode(data)
        if name in self._learned and messages:
            self._learned[name].hear(now)
        elif name not in self.codecs and any(self._is_welcome(m) for m in messages):
            self._add(name, codec)
        return messages

    def accepts(self, message: Message) -> bool:
        """True unless a key is set and the message is not signed with it."""
        return bool(message.get_signed()) or not self._keyring.is_on

    def peers(self) -> Collection[Hashable]:
        """The peers that get telemetry; none if the transport itself sends to everyone."""
        return () if self._fixed is None else self.codecs.keys()

    def readers(self, key: Hashable) -> list[Hashable]:
        """The other peers that accept frames from ``key``: those with the same signing key, or with none."""
        keys = {None, self._keyring.key(key)}
        return [peer for peer in self.peers() if peer != key and self._keyring.key(peer) in keys]

    def _is_welcome(self, message: Message) -> bool:
        """Whether its sender may become a peer; a frame with our own ids is an echo or spoofed."""
        is_own = source_of(message) == self._ids
        return self.accepts(message) and addressed_to(message, *self._ids) and not is_own

    def _new(self, key: Hashable) -> Codec:
        return Codec(*self._ids, self._keyring.link(key))

    def _add(self, key: Hashable, codec: Codec) -> None:
        if len(self._learned) >= MAX_LEARNED_PEERS:
            leaving = min(self._learned, key=self._worth)
            del self._learned[leaving], self.codecs[leaving]
        self.codecs[key], self._learned[key] = codec, _LearnedPeer(self._now)

    def _worth(self, key: Hashable) -> tuple[bool, float, int]:
        peer = self._learned[key]
        is_here = self._now - peer.heard < PEER_TIMEOUT
        return is_here, peer.seconds if is_here else peer.heard, self.codecs[key].statistics.received

    def encode(self, outgoing: Outgoing) -> list[tuple[Hashable | None, bytes]]:
        """Datagrams for the destination; the key None means everyone."""
        if outgoing.peer is not None:
            key = outgoing.peer.key
            return [(key, self.codec(key).encode(outgoing.message))]
        if self._fixed is None:
            return [(None, self.codec(None).encode(outgoing.message))]
        return [(key, codec.encode(outgoing.message)) for key, codec in self.codecs.items()]


COPIES_PER_SECOND = 1000.0  # [1/s] datagrams that result from the frames of one peer
MAX_COPIES_BURST = 250  # of these after a pause: as many as one datagram full of frames causes
RESERVE_PER_SECOND = 200.0  # [1/s] further copies, shared by all peers that used up their own or are new
MAX_SOURCES_PER_PEER = 16  # (system, component) pairs remembered per peer; one more replaces the one with fewest frames
ROUTE_LIFETIME = 60.0  # [s] of silence after which a component's peer is forgotten
MAX_REMEMBERED_FRAMES = 1024  # frames remembered to recognise repetitions

SECRET_MESSAGES = frozenset(  # messages that carry a key or a password
    {
        mavlink.MAVLINK_MSG_ID_SETUP_SIGNING,
        mavlink.MAVLINK_MSG_ID_AUTH_KEY,
        mavlink.MAVLINK_MSG_ID_CHANGE_OPERATOR_CONTROL,
        mavlink.MAVLINK_MSG_ID_WIFI_CONFIG_AP,
    }
)
LINK_LOCAL_MESSAGES = frozenset({mavlink.MAVLINK_MSG_ID_RADIO_STATUS})  # about the link of the radio itself


class Withheld(Enum):
    """Reasons for which a frame is not forwarded."""

    STRANGER = "its port is not a peer of the vehicle"
    SECRET = "it contains a key or a password"  # noqa: S105 - not one itself
    LINK_LOCAL = "it is about its own link"
    NO_SENDER = "its sender has system id 0"
    NOBODY_THERE = "its target was not heard at another peer"
    REPEATED = "it was forwarded already"
    TOO_MANY = "its peer exceeds its rate"


class RoutingStatistics(NamedTuple):
    """A snapshot of the router's counters."""

    forwarded: int = 0  # forwarded frames
    copies: int = 0  # datagrams sent for them
    withheld: Mapping[Withheld, int] = MappingProxyType({})  # frames by the reason why they were not forwarded


@dataclass(slots=True)
class _Heard:
    frames: int = 0
    last: float = 0.0  # [s]


class _Neighbour:
    """A peer: the sources heard at it, and the rate at which its frames are forwarded."""

    def __init__(self, now: float) -> None:
        # Empty at first: changing the port with every frame must not help.
        self.bucket = TokenBucket(capacity=MAX_COPIES_BURST, rate=COPIES_PER_SECOND, now=now, tokens=0.0)
        self.sources: dict[Source, _Heard] = {}

    def hear(self, source: Source, now: float) -> None:
        if source not in self.sources and len(self.sources) >= MAX_SOURCES_PER_PEER:
            del self.sources[min(self.sources, key=lambda s: self.sources[s].frames)]
        heard = self.sources.setdefault(source, _Heard())
        heard.frames, heard.last = heard.frames + 1, now

    def forget(self, now: float) -> None:
        for source in [s for s, heard in self.sources.items() if now - heard.last > ROUTE_LIFETIME]:
            del self.sources[source]


class Router:
    """Decides where a frame is forwarded to, and remembers which source was heard at which peer.

    Args:
        system: Own system id.
        component: Own component id.
        peers: Returns the present peers.
        readers: Returns those peers, other than a given one, that may read its frames.
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
        self._reserve = TokenBucket(capacity=RESERVE_PER_SECOND, rate=RESERVE_PER_SECOND)
        self._recent: dict[bytes, float] = {}  # digest of a forwarded frame, and when it was forwarded
        self._forget_at = 0.0
        self._forwarded = self._copies = 0
        self._withheld: Counter[Withheld] = Counter()

    @property
    def statistics(self) -> RoutingStatistics:
        """Counters since the start."""
        return RoutingStatistics(self._forwarded, self._copies, MappingProxyType(dict(self._withheld)))

    def forward(self, message: Message, origin: Hashable, now: float) -> list[tuple[Hashable, bytes]]:
        """The copies of a frame to send, each with its peer; often none.

        Args:
            message: Decoded and accepted; not from this vehicle.
            origin: Where it came from; frames from others than the peers are not forwarded.
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
        drop_oldest(self._recent, MAX_REMEMBERED_FRAMES)
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
        if message.get_msgId() in SECRET_MESSAGES:
            return Withheld.SECRET
        if message.get_msgId() in LINK_LOCAL_MESSAGES:
            return Withheld.LINK_LOCAL
        if message.get_srcSystem() == 0:
            return Withheld.NO_SENDER
        if not destinations:
            is_ours = target[0] in {0, self._ids[0]} and target[1] in {0, self._ids[1]}
            return None if is_ours else Withheld.NOBODY_THERE
        return Withheld.REPEATED if digest in self._recent else None

    def _is_paid(self, neighbour: _Neighbour, copies: int, now: float) -> bool:
        return neighbour.bucket.take(now, copies) or self._reserve.take(now, copies)

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
        while self._recent and now - next(iter(self._recent.values())) > DUPLICATE_WINDOW:
            del self._recent[next(iter(self._recent))]
        if now >= self._forget_at:
            self._forget_at = now + 1.0
            for neighbour in self._neighbours.values():
                neighbour.forget(now)
