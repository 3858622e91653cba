"""Bytes to messages and back: sends MAVLink 2, receives versions 1 and 2.

A datagram is a unit: a truncated frame must not swallow the next one, and no bytes are carried over to the next
datagram. Wire input never raises an error.
Specification: https://mavlink.io/en/guide/serialization.html.
"""

import re
import struct
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from protocol.dialect import mavlink
from protocol.dialect.dialect_message import DialectMessage
from protocol.errors import LocalProtocolError, WireRangeError
from protocol.wire.framing import CHECKSUM_SIZE, HEADER_V2, MAGIC_V1, MAGIC_V2, SIGNED_FLAG, frame_length, message_id
from protocol.wire.message import Message, Source, source_of
from protocol.wire.message_frames import make_frame, read_frame, read_payload
from protocol.wire.other_dialects import OtherDialect
from protocol.wire.signing import Keyring, LinkSigning, Verdict

MAX_FALSE_STARTS = 32  # false frame starts per datagram before the rest is dropped: bounds the CPU time of a flood
MAX_KNOWN_STREAMS = 1024  # messages of one source and kind that are found at once; one more, and all are found anew
MAX_COUNTED_SOURCES = 64  # (system, component) pairs counted at once; one more replaces the one with fewest frames
_START, _MAGIC = re.compile(rb"[\xfd\xfe]"), frozenset({MAGIC_V1, MAGIC_V2})
_KINDS = {number.to_bytes(3, "little"): kind for number, kind in mavlink.mavlink_map.items()}
_OPEN = Verdict.OPEN
_UNFIT = (struct.error, OverflowError, TypeError, AttributeError, IndexError)
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

    __slots__ = ("_next", "_run", "_seen", "_settled", "_since", "lost", "repeated")

    def __init__(self, first: int) -> None:
        self.lost, self.repeated = 0, 0
        self._next = first
        self._run = 0  # frames in order, which the following lack
        self._settled = 0  # frames that arrived
        self._seen = 0  # bit k: the frame k before the newest has been seen
        self._since = -1  # how far back the window reaches: nothing before the first frame is missing

    @property
    def received(self) -> int:
        return self._settled + self._run

    @property
    def statistics(self) -> SourceStatistics:
        return SourceStatistics(self.received, self.lost, self.repeated)

    def account(self, number: int) -> None:
        if number == self._next:
            self._next = (number + 1) & 0xFF
            self._run += 1
        else:
            self._settle()
            self._account_out_of_order(number)

    def _settle(self) -> None:
        run, self._run = self._run, 0
        self._settled += run
        run = min(run, _WINDOW + 1)
        self._seen = ((self._seen + 1 << run) - 1) & _REMEMBERED
        self._since = min(self._since + run, _WINDOW)

    def _account_out_of_order(self, number: int) -> None:
        self._settled += 1
        ahead = (number - self._next + 1) & 0xFF
        if 0 < ahead < _WINDOW:
            self._seen = ((self._seen << ahead) | 1) & _REMEMBERED
            self._next, self._since = (number + 1) & 0xFF, min(self._since + ahead, _WINDOW)
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

    Attributes:
        sequence: Number of the next frame.
    """

    def __init__(
        self, system: int, component: int, signing: LinkSigning | None = None, other: OtherDialect | None = None
    ) -> None:
        for name, number in (("system", system), ("component", component)):
            if not 0 <= number <= 255:
                raise LocalProtocolError(f"{name} id {number} is not in 0..255")
        self.system, self.component = system, component
        self.sequence = 0
        self._signing, self._other = signing or Keyring().link(None), other
        self._keyring = self._signing.keyring
        self._sequences: dict[Source, _Sequence] = {}
        # By the bytes of a frame that hold sender and message id.
        self._streams: dict[bytes, tuple[type[DialectMessage], _Sequence]] = {}
        self._received = self._sent = self._bytes_received = self._bytes_sent = 0
        self._counts = dict.fromkeys(("bad_crc", "bad_flags", "unknown_id", "garbage_bytes", "signed", "refused"), 0)

    @property
    def statistics(self) -> Statistics:
        """A snapshot of the counters."""
        sources = {source: sequence.statistics for source, sequence in self._sequences.items()}
        return Statistics(
            sources=MappingProxyType(sources),
            received=self._received,
            sent=self._sent,
            bytes_received=self._bytes_received,
            bytes_sent=self._bytes_sent,
            **self._counts,
        )

    def encode(self, message: Message) -> bytes:
        """One MAVLink 2 frame with the next sequence number. The caller's message is not modified.

        Raises:
            LocalProtocolError: A field does not fit its type on the wire, or another sender's message would be signed
                with our key; no sequence number is used up.
        """
        is_signing = self._keyring.is_on and self._signing.is_signing
        if is_signing and message.get_msgbuf() and source_of(message) != (self.system, self.component):
            raise LocalProtocolError(f"{message.get_type()} is from another sender: forward it without signing")
        try:
            frame = make_frame(message, self.system, self.component, self.sequence)
        except _UNFIT as error:
            raise _misfit(message, error) from error
        if is_signing:
            frame = self._signing.sign(frame)
        self.sequence = (self.sequence + 1) & 0xFF
        self._sent += 1
        self._bytes_sent += len(frame)
        return frame

    def check(self, message: Message) -> None:
        """Check that a message can be encoded, before it is queued.

        Raises:
            LocalProtocolError: A field does not fit its type on the wire.
        """
        try:
            message.pack_fields()
        except _UNFIT as error:
            raise _misfit(message, error) from error

    def decode(self, datagram: bytes) -> list[Message]:
        """All messages of one datagram, in order. Never raises; damage is counted and skipped."""
        end = len(datagram) - CHECKSUM_SIZE
        self._bytes_received += len(datagram)
        stream = self._streams.get(datagram[5:10])
        # A datagram as most are: one intact unsigned frame of a message heard before, while no key is set.
        if (
            stream is not None
            and datagram[0] == MAGIC_V2
            and datagram[1] == end - HEADER_V2
            and not (datagram[2] or self._keyring.is_on)
        ):
            kind, sequence = stream
            message = read_payload(kind, datagram, HEADER_V2, end)
            if message is not None:
                sequence.account(datagram[4])
                self._keyring.opened += 1
                self._received += 1
                return [message]
        messages = self._decode_all(datagram)
        self._received += len(messages)
        return messages

    def _decode_all(self, data: bytes) -> list[Message]:
        messages: list[Message] = []
        size, at, damaged_until, flaws = len(data), 0, 0, 0
        while at < size:
            if data[at] not in _MAGIC or flaws >= MAX_FALSE_STARTS:
                start = _START.search(data, at) if flaws < MAX_FALSE_STARTS else None
                if start is None:
                    self._counts["garbage_bytes"] += size - at
                    break
                self._counts["garbage_bytes"] += start.start() - at
                at = start.start()
            end = at + frame_length(data, at)
            frame = data[at:end]
            message, flaw = self._read(frame) if frame else (None, "garbage")
            if flaw == "unknown_id" and not _at_boundary(data, end):
                flaw = "garbage"  # its checksum cannot be verified, and no frame follows it
            if not flaw or flaw == "unknown_id":
                if self._admits(frame, message):
                    if message is not None:
                        messages.append(message)
                    else:
                        self._counts["unknown_id"] += 1
                at = end
                continue
            # One damaged frame counts once, although bytes inside it may look like further frames.
            if flaw != "garbage" and at >= damaged_until:
                self._counts[flaw] += 1
                damaged_until = end
            self._counts["garbage_bytes"] += 1
            at, flaws = at + 1, flaws + 1
        return messages

    def _read(self, frame: bytes) -> tuple[Message | None, str]:
        if frame[0] == MAGIC_V2:
            if frame[2] > SIGNED_FLAG:
                return None, "bad_flags"
            kind = _KINDS.get(frame[7:10])
        else:
            kind = mavlink.mavlink_map.get(frame[5])
        if kind is not None:
            message = read_frame(kind, frame)
        elif self._other is not None and self._other.knows(message_id(frame)):
            message = self._other.decode(frame)
        else:
            return None, "unknown_id"
        return message, "bad_crc" if message is None else ""

    def _admits(self, frame: bytes, message: Message | None) -> bool:
        """True unless the frame is refused for its signature or for the lack of one."""
        verdict = self._signing.judge(frame)
        if verdict is not _OPEN:
            if verdict.is_refused:
                self._counts["refused"] += 1
                return False
            if verdict is Verdict.SIGNED:
                self._counts["signed"] += 1
                if message is not None:
                    message._signed = True  # noqa: SLF001 - get_signed() returns it
        at = 2 if frame[0] == MAGIC_V1 else 4
        sequence = self._sequence_of((frame[at + 1], frame[at + 2]), frame[at])
        sequence.account(frame[at])
        if frame[0] == MAGIC_V2 and isinstance(message, DialectMessage):
            if len(self._streams) >= MAX_KNOWN_STREAMS:
                self._streams.clear()
            self._streams[frame[5:10]] = type(message), sequence
        return True

    def _sequence_of(self, source: Source, first: int) -> _Sequence:
        """The sequence numbers of a source, which begin at ``first`` if it is new."""
        if source not in self._sequences:
            if len(self._sequences) >= MAX_COUNTED_SOURCES:
                del self._sequences[min(self._sequences, key=lambda k: self._sequences[k].received)]
                self._streams.clear()
            self._sequences[source] = _Sequence(first)
        return self._sequences[source]


def _misfit(message: Message, error: Exception) -> LocalProtocolError:
    return WireRangeError(f"{message.get_type()} cannot be encoded: {error}")


def _at_boundary(data: bytes, end: int) -> bool:
    return end == len(data) or data[end] in {MAGIC_V1, MAGIC_V2}
