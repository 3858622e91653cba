"""MAVLink 2 signatures: keys, timestamps, the 13 bytes behind a signed frame, and which frames are accepted.

A signed frame has bit 0 of its incompatibility flags set and ends in a link id (1 byte), a timestamp (6 bytes, least
significant first, in units of 10 us since 2015-01-01 UTC) and the first 6 bytes of
SHA-256(key, header with its 0xFD, payload, checksum, link id, timestamp).
Specification: https://mavlink.io/en/guide/message_signing.html. ``protocol.wire.signing`` decides which frames are
accepted.

The rules, in the order of their checks (https://mavlink.io/en/guide/message_signing.html):

1. While no key is set on any link, every frame is accepted, signed or not.
2. Once a key is set, an unsigned frame of ``DISPLAY_ONLY`` is shown to the owner but has no effect; any other
   unsigned frame is refused.
3. The digest is checked first. A frame with a wrong digest is refused and changes no state: a forged timestamp cannot
   block a peer.
4. A timestamp must be later than the last one of its stream (key, link id, system, component). That of a new stream
   must be at most 60 s behind our own. Both must be later than ``KeyRecord.timestamp``, which is above every timestamp
   used before the last restart.
5. A timestamp in the last ten years of its range (from 2094 on) is refused: our own timestamps follow those received,
   and after the end of the range no frame could be newer.

A new key is held beside the old one until a frame signed with it arrives. If none arrives within
``CONFIRMATION_TIMEOUT``, it is forgotten. So a mistyped or lost key locks nobody out.

Time is an argument. Timestamps advance with the link's monotonic clock and with those received; a wall clock that
steps backwards does not affect them.
"""

import hmac
from collections import Counter
from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from hashlib import sha256
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

from protocol.dialect import mavlink
from protocol.errors import FileError, LocalProtocolError
from protocol.tools.files import decode_text
from protocol.wire.framing import CHECKSUM_SIZE, HEADER_V2, MAGIC_V2, SIGNATURE_SIZE, SIGNED_FLAG, message_id
from protocol.wire.message_frames import checksum

KEY_SIZE = 32  # [bytes]
NO_KEY = bytes(KEY_SIZE)  # in SETUP_SIGNING: signing ends
TICKS_PER_SECOND = 100_000  # of the timestamp
MAX_TIMESTAMP = (1 << 48) - 1  # greatest timestamp

_DIGEST_SIZE = 6  # [bytes] of the signature's 13
_EPOCH = 1_420_070_400  # 2015-01-01 UTC [s since 1970]
_MAX_KEY_FILE = 4096  # [bytes] a key file is small: any larger file was named by mistake


class Signature(NamedTuple):
    """Link id and timestamp at the end of a signed frame."""

    link: int  # 0..255, chosen by the sender
    timestamp: int  # [10 us since 2015]


def timestamp_at(unix_time: float) -> int:
    """Signing timestamp [10 us since 2015] of a time [s since 1970]; 0 before 2015."""
    return min(max(round((unix_time - _EPOCH) * TICKS_PER_SECOND), 0), MAX_TIMESTAMP)


def load_key(text: str) -> bytes:
    """The 32-byte key in ``text``: 64 hexadecimal digits, or the path of a key file.

    A key file holds the 64 digits, with optional white space around them, or the 32 bytes themselves.

    Raises:
        FileError: ``text`` is neither; the message is one line and never quotes a key.
    """
    digits = _hexadecimal(text)
    if digits is not None:
        return _checked_key(digits, "signing key")
    path = Path(text)
    try:
        with path.open("rb") as file:
            content = file.read(_MAX_KEY_FILE)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        shown = f"{text[:40]}..." if len(text) > 43 else text
        raise FileError(f"signing key: neither 64 hexadecimal digits nor a readable file: {shown}: {reason}") from error
    digits = content if len(content) == KEY_SIZE else _hexadecimal(_text(content))
    if digits is None:
        raise FileError(f"signing key: {path}: neither 64 hexadecimal digits nor 32 bytes")
    return _checked_key(digits, f"signing key: {path}")


def _text(content: bytes) -> str:
    try:
        return decode_text(content).strip()
    except UnicodeError:
        return ""


def is_signed(frame: bytes | bytearray) -> bool:
    """True for a version 2 frame that carries a signature, right or wrong."""
    return len(frame) > SIGNATURE_SIZE and frame[0] == MAGIC_V2 and bool(frame[2] & SIGNED_FLAG)


def is_secret(frame: bytes | bytearray) -> bool:
    """True for a frame with a key in it (SETUP_SIGNING): it must never be recorded or forwarded."""
    is_v2 = len(frame) >= HEADER_V2 and frame[0] == MAGIC_V2
    return is_v2 and message_id(frame) == mavlink.MAVLINK_MSG_ID_SETUP_SIGNING


def sign_frame(frame: bytes, key: bytes, signature: Signature) -> bytes:
    """The signed copy of an unsigned version 2 frame: flag set, checksum computed anew, signature appended.

    Raises:
        LocalProtocolError: The frame is not an unsigned version 2 frame of the dialect.
    """
    kind = mavlink.mavlink_map.get(message_id(frame))
    if frame[0] != MAGIC_V2 or frame[2] & SIGNED_FLAG or kind is None:
        raise LocalProtocolError("only unsigned MAVLink 2 frames of the dialect can be signed")
    signed = bytearray(frame[:-CHECKSUM_SIZE])
    signed[2] |= SIGNED_FLAG
    signed += checksum(bytes(signed[1:]), kind.crc_extra).to_bytes(CHECKSUM_SIZE, "little")
    signed += bytes([signature.link]) + signature.timestamp.to_bytes(6, "little")
    return bytes(signed + sha256(key + signed).digest()[:_DIGEST_SIZE])


def signature_of(frame: bytes | bytearray) -> Signature:
    """Link id and timestamp of a signed frame, as it claims them."""
    return Signature(frame[-SIGNATURE_SIZE], int.from_bytes(frame[-SIGNATURE_SIZE + 1 : -_DIGEST_SIZE], "little"))


def verify(frame: bytes | bytearray, key: bytes) -> bool:
    """True if the frame was signed with ``key``; its timestamp is not checked."""
    digest = sha256(key + frame[:-_DIGEST_SIZE]).digest()[:_DIGEST_SIZE]
    return hmac.compare_digest(digest, bytes(frame[-_DIGEST_SIZE:]))


def _hexadecimal(text: str) -> bytes | None:
    if len(text) != 2 * KEY_SIZE or not text.isascii():
        return None
    try:
        return bytes.fromhex(text)
    except ValueError:
        return None


def _checked_key(key: bytes, what: str) -> bytes:
    if key == NO_KEY or len(key) != KEY_SIZE:
        raise FileError(f"{what}: a key of zeros means that there is no key")
    return key


DISPLAY_ONLY = frozenset({mavlink.MAVLINK_MSG_ID_HEARTBEAT, mavlink.MAVLINK_MSG_ID_RADIO_STATUS})
CONFIRMATION_TIMEOUT = 10.0  # [s]
MAX_NEW_STREAM_AGE = 60 * TICKS_PER_SECOND
MAX_ACCEPTED_TIMESTAMP = MAX_TIMESTAMP - 10 * 365 * 86400 * TICKS_PER_SECOND
LOOK_AHEAD = 10 * TICKS_PER_SECOND  # the saved time is ahead of the used one by this: one write per 10 s
MAX_STREAMS = 1024  # remembered; frames of a forgotten stream must be later than those of every forgotten stream

Stream = tuple[bytes, int, int, int]  # key, link id, system, component


class Verdict(Enum):
    """Result of judging one frame."""

    OPEN = "open"  # no key is set: accepted
    SIGNED = "signed"  # correctly signed and new: accepted
    DISPLAY_ONLY = "display only"  # unsigned, of ``DISPLAY_ONLY``: shown, without effect
    UNSIGNED = "unsigned"  # refused, as all below
    BAD_SIGNATURE = "bad signature"
    REPLAYED = "replayed"  # correctly signed, but not new
    FUTURE = "from the future"  # correctly signed, too near the end of the range of timestamps

    __hash__ = object.__hash__  # each frame counts one: that of Enum takes three times as long

    @property
    def is_refused(self) -> bool:
        """True if the frame is to be dropped."""
        return self not in _ACCEPTED


_OPEN = Verdict.OPEN
_ACCEPTED = frozenset({Verdict.OPEN, Verdict.SIGNED, Verdict.DISPLAY_ONLY})


class KeyState(Enum):
    """State of a proposed key."""

    PENDING = "pending"  # held until a frame signed with it arrives
    ON = "on"  # it is the key now
    OFF = "off"  # signing ended
    EXPIRED = "expired"  # never confirmed: the old key stays in force
    REFUSED = "refused"


class KeyChange(NamedTuple):
    """The state of a proposed key, with a text for the operator."""

    state: KeyState
    text: str


class KeyRecord(NamedTuple):
    """State that must survive a restart. ``keys`` by link; None is for all links without their own."""

    keys: Mapping[Hashable, bytes] = MappingProxyType({})
    timestamp: int = 0  # no timestamp up to this one is used or accepted again [10 us since 2015]


@dataclass(slots=True)
class _KeySlot:
    key: bytes | None = None
    pending: bytes | None = None
    initial: int = 0  # timestamp that came with the pending key
    deadline: float = field(default=float("inf"))


class Keyring:
    """The keys, the time and the counters of one vehicle or ground station; all its links share them.

    Args:
        keys: By link name as the transport knows it; None is for every link without its own. As soon as one key is
            set, a link without a key is read-only.
        timestamp: The wall clock at the start [10 us since 2015].
        now: The link's monotonic clock at the same moment [s].
        floor: ``KeyRecord.timestamp`` of the last run.
        is_private: True for a link that no other machine can listen to (loopback): only there a first key is accepted.
        keep: Called with what must survive a restart, before it is used.
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
        self._slots = {None: _KeySlot()} | {name: _KeySlot(key) for name, key in keys.items()}
        self.is_on = False  # true if a key is set for at least one link
        self._keys_changed()
        self._began, self._since, self._now = timestamp, now, now
        self._floor = self._bound = floor
        self._timestamp = max(timestamp, floor)
        self._streams: dict[Stream, int] = {}
        self._forgotten = 0  # greatest timestamp of a stream that is no longer remembered
        self._counts: Counter[Verdict] = Counter()
        self.opened = 0  # frames of ``Verdict.OPEN`` that were not judged because there was nothing to judge
        self._changes: list[KeyChange] = []
        self._links = 0

    @property
    def counts(self) -> Mapping[Verdict, int]:
        """Frames by verdict, since the start."""
        return MappingProxyType({verdict: count for verdict in Verdict if (count := self.count(verdict))})

    def count(self, verdict: Verdict) -> int:
        """Frames of one verdict, since the start."""
        return self._counts[verdict] + (self.opened if verdict is _OPEN else 0)

    @property
    def refused(self) -> int:
        """Frames dropped since the start."""
        return sum(count for verdict, count in self._counts.items() if verdict.is_refused)

    @property
    def record(self) -> KeyRecord:
        """State that must survive a restart."""
        keys = {name: slot.key for name, slot in self._slots.items() if slot.key is not None}
        return KeyRecord(MappingProxyType(keys), self._bound)

    def link(self, name: Hashable) -> "LinkSigning":
        """Signing and judging for one link; each has its own link id on the wire."""
        self._links += 1
        return LinkSigning(self, name, (self._links - 1) & 0xFF)

    def key(self, name: Hashable) -> bytes | None:
        """The key in force on a link."""
        return self._slot(name).key

    def advance_time(self, now: float) -> None:
        """Let time pass: timestamps advance with it, and an unconfirmed key expires."""
        self._now = max(self._now, now)
        self._advance(self._began + round((self._now - self._since) * TICKS_PER_SECOND))
        for slot in self._slots.values():
            if self._now >= slot.deadline:
                _forget(slot)
                self._report(
                    KeyState.EXPIRED, f"New signing key not confirmed within {CONFIRMATION_TIMEOUT:g} s: forgotten"
                )

    def next_deadline(self) -> float:
        """Link time at which ``advance_time`` must be called next [s]."""
        return min(slot.deadline for slot in self._slots.values())

    def changes(self) -> list[KeyChange]:
        """Changes of proposed keys since the last call."""
        changes, self._changes = self._changes, []
        return changes

    def propose(self, name: Hashable, key: bytes, timestamp: int, *, signed: bool) -> None:
        """A peer sent SETUP_SIGNING over a link; ``changes()`` has the result.

        Args:
            name: The link it arrived on.
            key: Its secret_key [32 bytes]; zeros end signing at once, which cannot lock anybody out.
            timestamp: Its initial_timestamp [10 us since 2015].
            signed: Whether the frame was correctly signed.
        """
        slot = self._slot(name)
        refusal = self._refusal(name, key, timestamp, signed=signed)
        if refusal:
            self._report(KeyState.REFUSED, f"Signing key refused: {refusal}")
        elif key == NO_KEY:
            if slot.key is not None:
                slot.key = None
                self._keys_changed()
                _forget(slot)
                self._keep()
                self._report(KeyState.OFF, "Signing off: unsigned commands are accepted")
        elif key != slot.key:
            is_new = key != slot.pending
            slot.pending, slot.initial, slot.deadline = key, timestamp, self._now + CONFIRMATION_TIMEOUT
            if is_new:
                self._report(KeyState.PENDING, "New signing key: waiting for a frame signed with it")

    # For links

    def judge(self, name: Hashable, frame: bytes | bytearray) -> Verdict:
        """The verdict on a frame whose checksum is right; it is counted."""
        verdict = self._judge(name, frame)
        self._counts[verdict] += 1
        return verdict

    def next_timestamp(self) -> int:
        """Timestamp of the next frame sent: later than all before, on any link."""
        self._advance(self._timestamp + 1)
        return self._timestamp

    # Inside

    def _keys_changed(self) -> None:
        self.is_on = any(slot.key is not None for slot in self._slots.values())

    def _slot(self, name: Hashable) -> _KeySlot:
        return self._slots.get(name) or self._slots[None]

    def _refusal(self, name: Hashable, key: bytes, timestamp: int, *, signed: bool) -> str:
        if self.is_on and not signed:
            return "the message with it is not signed"
        if not self.is_on and not self._is_private(name):
            return "a first key is accepted over loopback only"
        if key == NO_KEY and sum(slot.key is not None for slot in self._slots.values()) > 1:
            return "other links have keys, so this one needs one too"
        if len(key) != KEY_SIZE or not 0 <= timestamp <= MAX_ACCEPTED_TIMESTAMP:
            return "its timestamp is from the future or does not fit 48 bits"
        return ""

    def _judge(self, name: Hashable, frame: bytes | bytearray) -> Verdict:
        slot = self._slot(name)
        if not is_signed(frame):
            if not self.is_on:
                return Verdict.OPEN
            return Verdict.DISPLAY_ONLY if message_id(frame) in DISPLAY_ONLY else Verdict.UNSIGNED
        if slot.key is not None and verify(frame, slot.key):
            return self._judge_age(frame, slot.key)
        if slot.pending is not None and verify(frame, slot.pending):
            verdict = self._judge_age(frame, slot.pending)
            if verdict is Verdict.SIGNED:
                self._confirm(slot)
            return verdict
        return Verdict.BAD_SIGNATURE if self.is_on else Verdict.OPEN

    def _judge_age(self, frame: bytes | bytearray, key: bytes) -> Verdict:
        link, timestamp = signature_of(frame)
        stream = (key, link, frame[5], frame[6])
        oldest = self._streams.get(stream, max(self._timestamp - MAX_NEW_STREAM_AGE - 1, self._forgotten))
        if timestamp <= max(oldest, self._floor):
            return Verdict.REPLAYED
        if timestamp > MAX_ACCEPTED_TIMESTAMP:
            return Verdict.FUTURE
        self._advance(timestamp)
        self._streams[stream] = timestamp
        if len(self._streams) > MAX_STREAMS:
            oldest_stream = min(self._streams, key=lambda known: self._streams[known])
            self._forgotten = max(self._forgotten, self._streams.pop(oldest_stream))
        return Verdict.SIGNED

    def _confirm(self, slot: _KeySlot) -> None:
        slot.key, initial = slot.pending, slot.initial
        self._keys_changed()
        _forget(slot)
        self._timestamp = max(self._timestamp, initial)
        self._keep()
        self._report(KeyState.ON, "Signing key confirmed: unsigned commands are refused")

    def _advance(self, timestamp: int) -> None:
        self._timestamp = min(max(self._timestamp, timestamp), MAX_TIMESTAMP)
        if self._timestamp > self._bound and self.is_on:
            self._keep()

    def _keep(self) -> None:
        self._bound = min(max(self._bound, self._timestamp + LOOK_AHEAD), MAX_TIMESTAMP)
        self.keep(self.record)

    def _report(self, state: KeyState, text: str) -> None:
        self._changes.append(KeyChange(state, text))


class LinkSigning:
    """One link's view of a ``Keyring``: signs outgoing frames and judges incoming ones."""

    def __init__(self, keyring: Keyring, name: Hashable, link_id: int) -> None:
        self.keyring, self._name, self._link_id = keyring, name, link_id

    @property
    def is_signing(self) -> bool:
        """True if outgoing frames are signed."""
        return self.keyring.key(self._name) is not None

    def sign(self, frame: bytes) -> bytes:
        """A frame of ours, signed if the link has a key."""
        key = self.keyring.key(self._name)
        if key is None:
            return frame
        return sign_frame(frame, key, Signature(self._link_id, self.keyring.next_timestamp()))

    def judge(self, frame: bytes | bytearray) -> Verdict:
        """The verdict on an incoming frame whose checksum is right."""
        return self.keyring.judge(self._name, frame)


def _forget(slot: _KeySlot) -> None:
    slot.pending, slot.initial, slot.deadline = None, 0, float("inf")
