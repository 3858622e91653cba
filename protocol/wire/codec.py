"""Bytes to messages and back: sends MAVLink 2, receives versions 1 and 2.

Frames are found here, before the generated ``MAVLink.decode``, because a datagram is a unit: a truncated frame must not
swallow the next one, and no bytes are carried over to the next datagram. Wire input never raises an error.
Specification: https://mavlink.io/en/guide/serialization.html.
"""

import re
import struct
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from protocol.dialect import mavlink
from protocol.errors import LocalProtocolError
from protocol.wire.framing import MAGIC_V1, MAGIC_V2, SIGNED_FLAG, frame_length, message_id
from protocol.wire.message import Message, Source, source_of
from protocol.wire.other_dialects import OtherDialect
from protocol.wire.signing import Keyring, LinkSigning, Verdict

MAX_FALSE_STARTS = 32  # false frame starts per datagram before the rest is dropped: bounds the CPU time of a flood
MAX_COUNTED_SOURCES = 64  # (system, component) pairs counted at once; one more replaces the one with fewest frames
_START, _MAGIC = re.compile(rb"[\xfd\xfe]"), frozenset({MAGIC_V1, MAGIC_V2})
_WINDOW = 128  # half the range of sequence numbers: nearer ones are ahead, the others arrived late
_REMEMBERED = (2 << _WINDOW) - 1  # bits of frames that may still be told apart


@dataclass(frozen=True, slots=True)
class SourceStatistics:
    """Frames of one (system, component), counted by their sequence numbers."""

    received: int = 0  # frames that arrived, repeated ones included
    lost: int = 0  # sequence numbers never seen; a frame that arrives late is no longer lost
    repeated: int = 0  # frames that had arrived already


@dataclass(frozen=True, slots=True, kw_only=True)
class Statistics:
    """Snapshot of one link end's counters."""

    sources: Mapping[Source, SourceStatistics] = field(default_factory=lambda: MappingProxyType({}))
    received: int = 0  # messages decoded
    sent: int = 0  # messages encoded
    bytes_received: int = 0
    bytes_sent: int = 0
    bad_crc: int = 0  # frames of a known message whose checksum is wrong
    bad_flags: int = 0  # version 2 frames with an unknown incompatibility flag
    unknown_id: int = 0  # well-framed messages outside the dialect: their checksum cannot be verified
    garbage_bytes: int = 0  # bytes that belong to no accepted frame
    signed: int = 0  # frames correctly signed with this link's key
    refused: int = 0  # whole frames dropped for a missing or wrong signature: they count nowhere else


class _Sequence:
    """Sequence numbers of one source: which are missing, which arrived twice."""

    __slots__ = ("_newest", "_seen", "_since", "lost", "received", "repeated")

    def __init__(self, first: int) -> None:
        self.received, self.lost, self.repeated = 1, 0, 0
        self._newest = first
        self._seen = 1  # bit k: the frame k before the newest has been seen
        self._since = 0  # how far back the window reaches: nothing before the first frame is missing

    @property
    def statistics(self) -> SourceStatistics:
        return SourceStatistics(self.received, self.lost, self.repeated)

    def account(self, number: int) -> None:
        self.received += 1
        ahead = (number - self._newest) & 0xFF
        if 0 < ahead < _WINDOW:
            self._seen = ((self._seen << ahead) | 1) & _REMEMBERED
            self._newest, self._since = number, min(self._since + ahead, _WINDOW)
            self.lost += ahead - 1
            return
        behind = (-ahead) & 0xFF
        if self._seen >> behind & 1 or behind > self._since:
            self.repeated += 1
            return
        self._seen |= 1 << behind
        self.lost -= 1


class Codec:
    """One end of a link: its sequence counter for outgoing frames, statistics of incoming ones.

    A decoded message has its raw bytes in ``get_msgbuf()``; ``get_signed()`` is true if it was correctly signed.

    Args:
        system: Own system id.
        component: Own component id.
        signing: Signs outgoing frames and judges incoming ones; without it no frame is signed and all are accepted.
        other: Decodes messages that our dialect has not.
    """

    def __init__(
        self, system: int, component: int, signing: LinkSigning | None = None, other: OtherDialect | None = None
    ) -> None:
        for name, number in (("system", system), ("component", component)):
            if not 0 <= number <= 255:
                raise LocalProtocolError(f"{name} id {number} is not in 0..255")
        self.system, self.component = system, component
        self._mav = mavlink.MAVLink(None, srcSystem=system, srcComponent=component)
        self._signing, self._other = signing or Keyring().link(None), other
        self._sequences: dict[Source, _Sequence] = {}
        self._counts = dict.fromkeys(
            ("received", "sent", "bytes_received", "bytes_sent", "bad_crc", "bad_flags", "unknown_id"), 0
        )
        self._counts |= dict.fromkeys(("garbage_bytes", "signed", "refused"), 0)

    @property
    def statistics(self) -> Statistics:
        """A snapshot of the counters."""
        sources = {source: sequence.statistics for source, sequence in self._sequences.items()}
        return Statistics(sources=MappingProxyType(sources), **self._counts)

    def encode(self, message: Message) -> bytes:
        """One MAVLink 2 frame with the next sequence number. The caller's message is not modified.

        Raises:
            LocalProtocolError: A field does not fit its type on the wire, or another sender's message would be signed
                with our key; no sequence number is used up.
        """
        if self._signing.is_signing and message.get_msgbuf() and source_of(message) != (self.system, self.component):
            raise LocalProtocolError(f"{message.get_type()} is from another sender: forward it without signing")
        frame = self._signing.sign(self._pack(message))
        self._mav.seq = (self._mav.seq + 1) & 0xFF
        self._counts["sent"] += 1
        self._counts["bytes_sent"] += len(frame)
        return frame

    def check(self, message: Message) -> None:
        """Check that a message can be encoded, before it is queued.

        Raises:
            LocalProtocolError: A field does not fit its type on the wire.
        """
        self._pack(message)

    def decode(self, datagram: bytes) -> list[Message]:
        """All messages of one datagram, in order. Never raises; damage is counted and skipped."""
        data, messages = bytearray(datagram), []
        self._counts["bytes_received"] += len(data)
        at, damaged_until, flaws = 0, 0, 0
        while at < len(data):
            if data[at] not in _MAGIC or flaws >= MAX_FALSE_STARTS:
                start = _START.search(data, at) if flaws < MAX_FALSE_STARTS else None
                if start is None:
                    self._counts["garbage_bytes"] += len(data) - at
                    break
                self._counts["garbage_bytes"] += start.start() - at
                at = start.start()
            length = frame_length(data, at)
            end = at + length
            message, flaw = self._read(data[at:end]) if length else (None, "garbage")
            if flaw == "unknown_id" and not _at_boundary(data, end):
                flaw = "garbage"  # its checksum cannot be verified, and no frame follows it
            if not flaw or flaw == "unknown_id":
                if self._admit(data, at, end, message):
                    messages.extend([message] if message is not None else [])
                    self._counts["unknown_id"] += flaw == "unknown_id"
                at = end
                continue
            # One damaged frame counts once, although bytes inside it may look like further frames.
            if flaw != "garbage" and at >= damaged_until:
                self._counts[flaw] += 1
                damaged_until = end
            self._counts["garbage_bytes"] += 1
            at, flaws = at + 1, flaws + 1
        self._counts["received"] += len(messages)
        return messages

    def _pack(self, message: Message) -> bytes:
        twin = object.__new__(type(message))  # packing writes a header into the message: work on a copy
        twin.__dict__.update(message.__dict__)
        try:
            return bytes(twin.pack(self._mav))
        except (struct.error, OverflowError, TypeError, AttributeError) as error:
            raise LocalProtocolError(f"{message.get_type()} cannot be encoded: {error}") from error

    def _read(self, frame: bytearray) -> tuple[Message | None, str]:
        if frame[0] == MAGIC_V2 and frame[2] & ~SIGNED_FLAG:
            return None, "bad_flags"
        if (number := message_id(frame)) not in mavlink.mavlink_map:
            if self._other is None or not self._other.knows(number):
                return None, "unknown_id"
            message = self._other.decode(frame)
            return message, "bad_crc" if message is None else ""
        try:
            return self._mav.decode(frame), ""
        except mavlink.MAVError:
            return None, "bad_crc"

    def _admit(self, data: bytearray, at: int, end: int, message: Message | None) -> bool:
        """True unless the frame is refused for its signature or for the lack of one."""
        verdict = self._signing.judge(data[at:end], message_id(data, at))
        if verdict.is_refused:
            self._counts["refused"] += 1
            return False
        if verdict is Verdict.SIGNED:
            self._counts["signed"] += 1
            if message is not None:
                message._signed = True  # noqa: SLF001 - get_signed() returns it
        self._account(data, at)
        return True

    def _account(self, data: bytearray, at: int) -> None:
        number, system, component = data[at + 2 : at + 5] if data[at] == MAGIC_V1 else data[at + 4 : at + 7]
        key = (system, component)
        if (sequence := self._sequences.get(key)) is not None:
            sequence.account(number)
        else:
            if len(self._sequences) >= MAX_COUNTED_SOURCES:
                del self._sequences[min(self._sequences, key=lambda k: self._sequences[k].received)]
            self._sequences[key] = _Sequence(number)


def _at_boundary(data: bytearray, end: int) -> bool:
    return end == len(data) or data[end] in {MAGIC_V1, MAGIC_V2}
