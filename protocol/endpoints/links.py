"""The links of a vehicle to its peers: a codec for each, and which senders become peers."""

from __future__ import annotations

from collections.abc import Collection, Hashable, Iterable
from dataclasses import dataclass

from protocol.engines.base import Outgoing
from protocol.wire.codec import Codec
from protocol.wire.keyring import Keyring
from protocol.wire.message import Message, addressed_to, source_of

__all__ = ["MAX_LEARNED_PEERS", "Links"]

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
