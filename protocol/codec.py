"""Bytes to messages and back: MAVLink 2 out, versions 1 and 2 in.

Framing is done here, above the generated ``MAVLink.decode``, because a datagram is a unit: a frame cut short
must not swallow the next one, nor may anything be carried over to the next datagram. Wire input never raises.
Specification: https://mavlink.io/en/guide/serialization.html.
"""

import re
import struct
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

from protocol.dialect import mavlink
from protocol.errors import LocalProtocolError
from protocol.keyring import Keyring, LinkSigning, Verdict

__all__ = ["Codec", "Message", "Source", "SourceStatistics", "Statistics", "source_of"]

Message = Any  # any class of the generated dialect
Source = tuple[int, int]  # (system, component)

_V1, _V2 = 0xFE, 0xFD
_SIGNED = 0x01  # the only incompatibility flag that is understood
MOST_FLAWS = 32  # starts of frames that were none after which the rest of a datagram is given up: a flood costs time
MOST_SOURCES = 64  # (system, component) pairs counted at once; one more replaces the one that said least
_START = re.compile(rb"[\xfd\xfe]")
_WINDOW = 128  # half the range of sequence numbers: nearer ones are ahead, the others came late


@dataclass(frozen=True, slots=True)
class SourceStatistics:
    """What one (system, component) sent, as told by its sequence numbers."""

    received: int = 0  # frames that arrived, repeated ones included
    lost: int = 0  # sequence numbers never seen; a late frame takes its loss back
    repeated: int = 0  # frames that had arrived before


@dataclass(frozen=True, slots=True)
class Statistics:
    """Snapshot of one link end's counters."""

    sources: Mapping[Source, SourceStatistics] = field(default_factory=lambda: MappingProxyType({}))
    received: int = 0  # messages decoded
    sent: int = 0  # messages encoded
    bytes_received: int = 0
    bytes_sent: int = 0
    bad_crc: int = 0  # frames of a known message whose checksum is wrong
    bad_flags: int = 0  # version 2 frames with an incompatibility flag nobody here understands
    unknown_id: int = 0  # well-framed messages outside the dialect: their checksum cannot be verified
    garbage_bytes: int = 0  # bytes that belong to no accepted frame
    signed: int = 0  # frames rightly signed with this link's key
    refused: int = 0  # whole frames dropped for want of a good signature: they count nowhere else


class _Sequence:
    """Sequence numbers of one source: what is missing and what came twice."""

    def __init__(self, first: int) -> None:
        self.statistics = SourceStatistics(received=1)
        self._newest = first
        self._seen = 1  # bit k: the frame k before the newest has been seen
        self._since = 0  # how far back the window reaches: nothing before the first frame is missing

    def account(self, number: int) -> None:
        ahead = (number - self._newest) & 0xFF
        old = self.statistics
        if 0 < ahead < _WINDOW:
            self._seen = ((self._seen << ahead) | 1) & ((2 << _WINDOW) - 1)
            self._newest, self._since = number, min(self._since + ahead, _WINDOW)
            self.statistics = replace(old, received=old.received + 1, lost=old.lost + ahead - 1)
            return
        behind = (-ahead) & 0xFF
        if self._seen >> behind & 1 or behind > self._since:
            self.statistics = replace(old, received=old.received + 1, repeated=old.repeated + 1)
            return
        self._seen |= 1 << behind
        self.statistics = replace(old, received=old.received + 1, lost=old.lost - 1)


def source_of(message: Message) -> Source:
    """(system, component) that sent a decoded message."""
    return message.get_srcSystem(), message.get_srcComponent()


class Codec:
    """One link end: its own sequence counter on the way out, statistics on the way in.

    The raw bytes of a decoded message are its ``get_msgbuf()``; its ``get_signed()`` is true if it was rightly signed.

    Args:
        system: Own system id.
        component: Own component id.
        signing: Signs what goes out and judges what comes in; without it nothing is signed and all is believed.
    """

    def __init__(self, system: int, component: int, signing: LinkSigning | None = None) -> None:
        for name, number in (("system", system), ("component", component)):
            if not 0 <= number <= 255:
                raise LocalProtocolError(f"{name} id {number} is not in 0..255")
        self.system, self.component = system, component
        self._mav = mavlink.MAVLink(None, srcSystem=system, srcComponent=component)
        self._signing = signing or Keyring().link(None)
        self._sequences: dict[Source, _Sequence] = {}
        self._counts = dict.fromkeys(
            ("received", "sent", "bytes_received", "bytes_sent", "bad_crc", "bad_flags", "unknown_id"), 0
        )
        self._counts |= dict.fromkeys(("garbage_bytes", "signed", "refused"), 0)

    @property
    def statistics(self) -> Statistics:
        """Counters as they are now; the snapshot does not change afterwards."""
        sources = {source: sequence.statistics for source, sequence in self._sequences.items()}
        return Statistics(sources=MappingProxyType(sources), **self._counts)

    def encode(self, message: Message) -> bytes:
        """One MAVLink 2 frame with the next sequence number. The caller's message is left as it was.

        Raises:
            LocalProtocolError: A field does not fit its type on the wire, or signing would put this end's name to
                another's message; no sequence number is used up.
        """
        if self._signing.is_signing and message.get_msgbuf() and source_of(message) != (self.system, self.component):
            raise LocalProtocolError(f"{message.get_type()} is another's: forward its bytes, they are not ours to sign")
        frame = self._signing.sign(self._pack(message))
        self._mav.seq = (self._mav.seq + 1) & 0xFF
        self._counts["sent"] += 1
        self._counts["bytes_sent"] += len(frame)
        return frame

    def check(self, message: Message) -> None:
        """Let a message that cannot be encoded fail here, before anything is queued.

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
            start = _START.search(data, at) if flaws < MOST_FLAWS else None
            if start is None:
                self._counts["garbage_bytes"] += len(data) - at
                break
            self._counts["garbage_bytes"] += start.start() - at
            at = start.start()
            end = self._frame_end(data, at)
            message, flaw = self._read(data[at:end]) if end else (None, "garbage")
            if flaw == "unknown_id" and not _at_boundary(data, end):
                flaw = "garbage"  # its checksum proves nothing and what follows is no frame
            if flaw in {"", "unknown_id"}:
                if self._admit(data, at, end, message):
                    messages.extend([message] if message is not None else [])
                    self._counts["unknown_id"] += flaw == "unknown_id"
                at = end
                continue
            # One damaged frame counts once, though bytes inside it may look like further frames.
            if flaw != "garbage" and at >= damaged_until:
                self._counts[flaw] += 1
                damaged_until = end
            self._counts["garbage_bytes"] += 1
            at, flaws = at + 1, flaws + 1
        self._counts["received"] += len(messages)
        return messages

    def _pack(self, message: Message) -> bytes:
        twin = object.__new__(type(message))  # packing writes a header into the message: the caller keeps its own
        twin.__dict__.update(message.__dict__)
        try:
            return bytes(twin.pack(self._mav))
        except (struct.error, OverflowError, TypeError, AttributeError) as error:
            raise LocalProtocolError(f"{message.get_type()} cannot be encoded: {error}") from error

    @staticmethod
    def _frame_end(data: bytearray, at: int) -> int:
        """Index after the frame that starts at ``at``; 0 when none can."""
        if data[at] == _V2 and at + 3 <= len(data):
            end = at + 12 + data[at + 1] + (13 if data[at + 2] & _SIGNED else 0)
        elif data[at] == _V1 and at + 2 <= len(data):
            end = at + 8 + data[at + 1]
        else:
            return 0
        return end if end <= len(data) else 0

    def _read(self, frame: bytearray) -> tuple[Message | None, str]:
        if frame[0] == _V2 and frame[2] & ~_SIGNED:
            return None, "bad_flags"
        number = frame[5] if frame[0] == _V1 else int.from_bytes(frame[7:10], "little")
        if number not in mavlink.mavlink_map:
            return None, "unknown_id"
        try:
            return self._mav.decode(frame), ""
        except mavlink.MAVError:
            return None, "bad_crc"

    def _admit(self, data: bytearray, at: int, end: int, message: Message | None) -> bool:
        """True unless the frame's signature, or the want of one, refuses it."""
        number = data[at + 5] if data[at] == _V1 else int.from_bytes(data[at + 7 : at + 10], "little")
        verdict = self._signing.judge(data[at:end], number)
        if verdict.is_refused:
            self._counts["refused"] += 1
            return False
        if verdict is Verdict.SIGNED:
            self._counts["signed"] += 1
            if message is not None:
                message._signed = True  # noqa: SLF001 - what get_signed() tells
        self._account(data, at)
        return True

    def _account(self, data: bytearray, at: int) -> None:
        number, *source = data[at + 2 : at + 5] if data[at] == _V1 else data[at + 4 : at + 7]
        key = (source[0], source[1])
        if key in self._sequences:
            self._sequences[key].account(number)
        else:
            if len(self._sequences) >= MOST_SOURCES:
                del self._sequences[min(self._sequences, key=lambda k: self._sequences[k].statistics.received)]
            self._sequences[key] = _Sequence(number)


def _at_boundary(data: bytearray, end: int) -> bool:
    return end == len(data) or data[end] in {_V1, _V2}
