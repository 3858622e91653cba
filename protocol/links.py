"""The links of a vehicle with many peers: a codec for each, and who becomes one."""

from collections.abc import Collection, Hashable, Iterable
from dataclasses import dataclass

from protocol.codec import Codec, Message, source_of
from protocol.engines.base import Outgoing, addressed_to
from protocol.keyring import Keyring

__all__ = ["MOST_LEARNT", "Links"]

MOST_LEARNT = (
    16  # one more replaces one that has departed, or was heard in the fewest seconds: a flood drives nobody out
)
DEPARTED = 60.0  # a peer that was silent for so long [s] has probably gone; it makes room first


@dataclass(slots=True)
class _Learnt:
    """A peer that made itself known."""

    heard: float  # when it said something last [s]
    seconds: int = 1  # in how many it did: what one says in one of them counts once

    def hear(self, now: float) -> None:
        self.seconds += int(now) != int(self.heard)
        self.heard = now


class Links:
    """Who gets what, and with which sequence number.

    Sequence numbers count per link, and clients call every gap a loss: an answer to one peer must not tear a hole
    into the others' numbers. So each peer has its own codec. Without a list of peers the transport sends to
    everyone itself, and all share one codec.
    """

    def __init__(self, system: int, component: int, peers: Iterable[Hashable] | None, keyring: Keyring) -> None:
        self._ids, self._keyring = (system, component), keyring
        self._fixed = None if peers is None else tuple(peers)
        self.codecs: dict[Hashable, Codec] = {key: self._new(key) for key in self._fixed or ()}
        self._learnt: dict[Hashable, _Learnt] = {}
        self._now = 0.0

    def codec(self, key: Hashable) -> Codec:
        """The codec that serves ``key``."""
        key = None if self._fixed is None else key
        if key not in self.codecs:
            self._add(key, self._new(key))
        return self.codecs[key]

    def decode(self, data: bytes, key: Hashable, now: float) -> list[Message]:
        """All that a peer says; a stranger becomes a peer by its first frame that is believed."""
        self._now = now
        name = None if self._fixed is None else key
        codec = self.codecs.get(name) or self._new(name)
        messages = codec.decode(data)
        if name in self._learnt and messages:
            self._learnt[name].hear(now)
        elif name not in self.codecs and any(self._is_welcome(m) for m in messages):
            self._add(name, codec)
        return messages

    def believes(self, message: Message) -> bool:
        """True unless a key is set and the message is not signed with it."""
        return bool(message.get_signed()) or not self._keyring.is_on

    def peers(self) -> Collection[Hashable]:
        """Who gets telemetry; nobody that is known by name while the transport sends to everyone itself."""
        return () if self._fixed is None else self.codecs.keys()

    def readers(self, key: Hashable) -> list[Hashable]:
        """Peers that what came from ``key`` means something to: those with the same signing key, or with none."""
        keys = {None, self._keyring.key(key)}
        return [peer for peer in self.peers() if peer != key and self._keyring.key(peer) in keys]

    def _is_welcome(self, message: Message) -> bool:
        """Whether its sender may become a peer; a frame in this vehicle's own name is an echo, or a lie."""
        is_own = source_of(message) == self._ids
        return self.believes(message) and addressed_to(message, *self._ids) and not is_own

    def _new(self, key: Hashable) -> Codec:
        return Codec(*self._ids, self._keyring.link(key))

    def _add(self, key: Hashable, codec: Codec) -> None:
        if len(self._learnt) >= MOST_LEARNT:
            leaving = min(self._learnt, key=self._worth)
            del self._learnt[leaving], self.codecs[leaving]
        self.codecs[key], self._learnt[key] = codec, _Learnt(self._now)

    def _worth(self, key: Hashable) -> tuple[bool, float, int]:
        peer = self._learnt[key]
        is_here = self._now - peer.heard < DEPARTED
        return is_here, peer.seconds if is_here else peer.heard, self.codecs[key].statistics.received

    def encode(self, outgoing: Outgoing) -> list[tuple[Hashable | None, bytes]]:
        """Datagrams for the destination; None as a key means everyone."""
        if outgoing.peer is not None:
            key = outgoing.peer.key
            return [(key, self.codec(key).encode(outgoing.message))]
        if self._fixed is None:
            return [(None, self.codec(None).encode(outgoing.message))]
        return [(key, codec.encode(outgoing.message)) for key, codec in self.codecs.items()]
