"""Whom a link end believes: keys by link, pending keys, the age of what arrives, and what was refused.

The rules, in the order a frame meets them (https://mavlink.io/en/guide/message_signing.html):

1. While no key is set anywhere, everything is believed, signed or not.
2. Once a key is set, a frame of ``LOOKED_AT`` that is not signed is shown to the owner but orders nothing; any other
   unsigned frame is refused.
3. The digest comes first. A frame that fails it is refused and moves nothing: no forged timestamp can block a peer.
4. A timestamp must be later than the last one of its stream (key, link id, system, component), a new stream's no
   more than 60 s behind the own one; and both later than ``KeyRecord.timestamp``, which no timestamp passed before
   the last restart.
5. A timestamp in the last ten years of its range (from 2094 on) is refused: time follows what is heard, and at the end
   of its range nobody could say anything later.

A new key is held beside the old one until a frame that is signed with it arrives; without one within
``CONFIRM_WITHIN`` it is forgotten. So a key that was mistyped, or never arrived, locks nobody out.

Time is an argument. Timestamps follow the link's steady clock from where they began, and what was received; a wall
clock that goes backwards does not reach them.
"""

from collections import Counter
from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from types import MappingProxyType
from typing import NamedTuple

from protocol.dialect import mavlink
from protocol.signing import (
    KEY_SIZE,
    MOST,
    NO_KEY,
    TICKS_PER_SECOND,
    Signature,
    is_signed,
    sign_frame,
    signature_of,
    verify,
)

__all__ = ["LOOKED_AT", "KeyChange", "KeyRecord", "KeyState", "Keyring", "LinkSigning", "Verdict"]

LOOKED_AT = frozenset({mavlink.MAVLINK_MSG_ID_HEARTBEAT, mavlink.MAVLINK_MSG_ID_RADIO_STATUS})
CONFIRM_WITHIN = 10.0  # [s]
NEW_STREAM_AGE = 60 * TICKS_PER_SECOND
LATEST = MOST - 10 * 365 * 86400 * TICKS_PER_SECOND
LOOK_AHEAD = 10 * TICKS_PER_SECOND  # kept time runs ahead of used time by this: one write per 10 s
MOST_STREAMS = 1024  # remembered; of those that were forgotten, only what is later than all their frames is believed

Stream = tuple[bytes, int, int, int]  # key, link id, system, component


class Verdict(Enum):
    """What becomes of one frame."""

    OPEN = "open"  # no key is set: believed
    SIGNED = "signed"  # rightly signed and new: believed
    LOOKED_AT = "looked at"  # unsigned, of the allow list: shown, not believed
    UNSIGNED = "unsigned"  # refused, as all below
    BAD_SIGNATURE = "bad signature"
    REPLAYED = "replayed"  # rightly signed, but not new
    FUTURE = "from the future"  # rightly signed, at a time that would leave none to go on

    @property
    def is_refused(self) -> bool:
        """True if the frame is to be dropped."""
        return self in {Verdict.UNSIGNED, Verdict.BAD_SIGNATURE, Verdict.REPLAYED, Verdict.FUTURE}


class KeyState(Enum):
    """What became of a key that was proposed."""

    PENDING = "pending"  # held until a frame signed with it arrives
    ON = "on"  # it is the key now
    OFF = "off"  # no key any more
    EXPIRED = "expired"  # never confirmed: the old state stays
    REFUSED = "refused"


class KeyChange(NamedTuple):
    """For the owner: what became of a proposed key, in words."""

    state: KeyState
    text: str


class KeyRecord(NamedTuple):
    """What must survive a restart. ``keys`` by link, None for all that have none of their own."""

    keys: Mapping[Hashable, bytes] = MappingProxyType({})
    timestamp: int = 0  # no timestamp up to this one is used or believed again [10 us since 2015]


@dataclass(slots=True)
class _Lock:
    key: bytes | None = None
    pending: bytes | None = None
    initial: int = 0  # timestamp that came with the pending key
    deadline: float = field(default=float("inf"))


class Keyring:
    """The keys, the time and the counters of one vehicle or ground station; all its links share them.

    Args:
        keys: By link name as the transport knows it; None is for every link without its own. As soon as one key is
            set, a link that has none is read-only.
        timestamp: The wall clock when it starts [10 us since 2015].
        now: The link's steady clock at that moment [s].
        floor: ``KeyRecord.timestamp`` of the last run.
        is_private: True for links nobody else can listen to (loopback): a first key is taken from no other.
        keep: Called with what must survive a restart, before it is relied upon.
    """

    def __init__(
        self,
        keys: Mapping[Hashable, bytes] = MappingProxyType({}),
        *,
        timestamp: int = 0,
        now: float = 0.0,
        floor: int = 0,
        is_private: Callable[[Hashable], bool] = lambda _name: False,
        keep: Callable[[KeyRecord], None] = lambda _record: None,
    ) -> None:
        self.keep = keep
        self._is_private = is_private
        self._locks = {None: _Lock()} | {name: _Lock(key) for name, key in keys.items()}
        self._began, self._since, self._now = timestamp, now, now
        self._floor = self._bound = floor
        self._timestamp = max(timestamp, floor)
        self._streams: dict[Stream, int] = {}
        self._forgotten = 0  # greatest timestamp of a stream that is no longer remembered
        self._counts: Counter[Verdict] = Counter()
        self._changes: list[KeyChange] = []
        self._links = 0

    @property
    def is_on(self) -> bool:
        """True if a key is set, for one link at least."""
        return any(lock.key is not None for lock in self._locks.values())

    @property
    def counts(self) -> Mapping[Verdict, int]:
        """Frames by what became of them, since the start."""
        return MappingProxyType(dict(self._counts))

    @property
    def refused(self) -> int:
        """Frames dropped since the start."""
        return sum(count for verdict, count in self._counts.items() if verdict.is_refused)

    @property
    def record(self) -> KeyRecord:
        """What must survive a restart."""
        keys = {name: lock.key for name, lock in self._locks.items() if lock.key is not None}
        return KeyRecord(MappingProxyType(keys), self._bound)

    def link(self, name: Hashable) -> "LinkSigning":
        """The signer and judge of one link; each has its own link id on the wire."""
        self._links += 1
        return LinkSigning(self, name, (self._links - 1) & 0xFF)

    def key(self, name: Hashable) -> bytes | None:
        """The key in force on a link."""
        return self._lock(name).key

    def tell_time(self, now: float) -> None:
        """Let time pass: timestamps follow it, a key that nobody confirmed is forgotten."""
        self._now = max(self._now, now)
        self._advance(self._began + round((self._now - self._since) * TICKS_PER_SECOND))
        for lock in self._locks.values():
            if self._now >= lock.deadline:
                _forget(lock)
                self._tell(KeyState.EXPIRED, f"New signing key not confirmed within {CONFIRM_WITHIN:g} s: forgotten")

    def next_deadline(self) -> float:
        """When ``tell_time`` has something to do."""
        return min(lock.deadline for lock in self._locks.values())

    def changes(self) -> list[KeyChange]:
        """What became of proposed keys since the last call."""
        changes, self._changes = self._changes, []
        return changes

    def propose(self, name: Hashable, key: bytes, timestamp: int, *, signed: bool) -> None:
        """A peer sent SETUP_SIGNING over a link: see ``changes()`` for what came of it.

        Args:
            name: The link it came by.
            key: Its secret_key [32 bytes]; zeros end signing at once, which locks nobody out.
            timestamp: Its initial_timestamp [10 us since 2015].
            signed: Whether the frame was rightly signed.
        """
        lock = self._lock(name)
        refusal = self._refusal(name, key, timestamp, signed=signed)
        if refusal:
            self._tell(KeyState.REFUSED, f"Signing key refused: {refusal}")
        elif key == NO_KEY:
            if lock.key is not None:
                lock.key = None
                _forget(lock)
                self._keep()
                self._tell(KeyState.OFF, "Signing ended: unsigned orders are obeyed")
        elif key != lock.key:
            is_new = key != lock.pending
            lock.pending, lock.initial, lock.deadline = key, timestamp, self._now + CONFIRM_WITHIN
            if is_new:
                self._tell(KeyState.PENDING, "New signing key waits for a frame signed with it")

    # For links

    def judge(self, name: Hashable, frame: bytes | bytearray, message_id: int) -> Verdict:
        """What becomes of a frame whose checksum is right; counted."""
        verdict = self._judge(name, frame, message_id)
        self._counts[verdict] += 1
        return verdict

    def next_timestamp(self) -> int:
        """For the next frame that is sent: later than all before, of whatever link."""
        self._advance(self._timestamp + 1)
        return self._timestamp

    # Inside

    def _lock(self, name: Hashable) -> _Lock:
        return self._locks.get(name) or self._locks[None]

    def _refusal(self, name: Hashable, key: bytes, timestamp: int, *, signed: bool) -> str:
        if self.is_on and not signed:
            return "it must itself be signed"
        if not self.is_on and not self._is_private(name):
            return "a first key is taken over loopback only"
        if key == NO_KEY and sum(lock.key is not None for lock in self._locks.values()) > 1:
            return "other links keep their keys, this one cannot be open"
        if len(key) != KEY_SIZE or not 0 <= timestamp <= LATEST:
            return "its timestamp is from the future, or does not fit 48 bits"
        return ""

    def _judge(self, name: Hashable, frame: bytes | bytearray, message_id: int) -> Verdict:
        lock = self._lock(name)
        if not is_signed(frame):
            if not self.is_on:
                return Verdict.OPEN
            return Verdict.LOOKED_AT if message_id in LOOKED_AT else Verdict.UNSIGNED
        if lock.key is not None and verify(frame, lock.key):
            return self._judge_age(frame, lock.key)
        if lock.pending is not None and verify(frame, lock.pending):
            verdict = self._judge_age(frame, lock.pending)
            if verdict is Verdict.SIGNED:
                self._confirm(lock)
            return verdict
        return Verdict.BAD_SIGNATURE if self.is_on else Verdict.OPEN

    def _judge_age(self, frame: bytes | bytearray, key: bytes) -> Verdict:
        link, timestamp = signature_of(frame)
        stream = (key, link, frame[5], frame[6])
        oldest = self._streams.get(stream, max(self._timestamp - NEW_STREAM_AGE - 1, self._forgotten))
        if timestamp <= max(oldest, self._floor):
            return Verdict.REPLAYED
        if timestamp > LATEST:
            return Verdict.FUTURE
        self._advance(timestamp)
        self._streams[stream] = timestamp
        if len(self._streams) > MOST_STREAMS:
            oldest_stream = min(self._streams, key=lambda known: self._streams[known])
            self._forgotten = max(self._forgotten, self._streams.pop(oldest_stream))
        return Verdict.SIGNED

    def _confirm(self, lock: _Lock) -> None:
        lock.key, initial = lock.pending, lock.initial
        _forget(lock)
        self._timestamp = max(self._timestamp, initial)
        self._keep()
        self._tell(KeyState.ON, "Signing key confirmed: unsigned orders are refused")

    def _advance(self, timestamp: int) -> None:
        self._timestamp = min(max(self._timestamp, timestamp), MOST)
        if self._timestamp > self._bound and self.is_on:
            self._keep()

    def _keep(self) -> None:
        self._bound = min(max(self._bound, self._timestamp + LOOK_AHEAD), MOST)
        self.keep(self.record)

    def _tell(self, state: KeyState, text: str) -> None:
        self._changes.append(KeyChange(state, text))


class LinkSigning:
    """One link's view of a ``Keyring``: signs what goes out by it, judges what comes in."""

    def __init__(self, keyring: Keyring, name: Hashable, link_id: int) -> None:
        self._keyring, self._name, self._link_id = keyring, name, link_id

    @property
    def is_signing(self) -> bool:
        """True if what goes out is signed."""
        return self._keyring.key(self._name) is not None

    def sign(self, frame: bytes) -> bytes:
        """An own frame, signed if the link has a key."""
        key = self._keyring.key(self._name)
        if key is None:
            return frame
        return sign_frame(frame, key, Signature(self._link_id, self._keyring.next_timestamp()))

    def judge(self, frame: bytes | bytearray, message_id: int) -> Verdict:
        """What becomes of a frame that came in and whose checksum is right."""
        return self._keyring.judge(self._name, frame, message_id)


def _forget(lock: _Lock) -> None:
    lock.pending, lock.initial, lock.deadline = None, 0, float("inf")
