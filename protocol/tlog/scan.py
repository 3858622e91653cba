"""Finds the records of a telemetry log and the damage between them.

A record is a time stamp (eight bytes, microseconds) and one frame. No marker precedes it, so every byte
that may begin a frame is a candidate. A candidate must pass these tests:

- its time is before the year 2255, its flags are known and the whole frame is in the file;
- a known message, of the dialect or of another autopilot (``message_set``), has the right checksum;
- any other message, whose checksum cannot be verified, is followed by the likely start of another record or by the
  end of the file, and contains no verified record.

Candidates that pass are accepted in the order of the file; one that overlaps an accepted record is dropped. The rest is
damage: every byte of the file belongs to one record or to one piece of damage. All steps work on whole arrays.

If the records fill less than half of the file, it is read once more with little-endian stamps, as early ground stations
wrote them; the byte order that more verified bytes agree with is that of the file.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from protocol.tlog.message_set import MessageTable, dialect_table, message_class, whole_table
from protocol.wire.framing import (
    CHECKSUM_SIZE,
    HEADER_V1,
    HEADER_V2,
    MAGIC_V1,
    MAGIC_V2,
    OVERHEAD_V1,
    OVERHEAD_V2,
    SIGNATURE_SIZE,
    SIGNED_FLAG,
    message_id,
)

STAMP_SIZE = 8  # [bytes]
TIME_LIMIT = 1 << 53  # [us] first time that is refused: up to it, a float64 holds every time exactly


_BLOCK = 16384  # spans per pass: their bytes stay in the cache


def accumulate(crc: NDArray[np.uint16], byte: NDArray[np.uint8] | NDArray[np.uint16]) -> NDArray[np.uint16]:
    """Checksums after one more byte each; both arrays have shape (n,)."""
    low: NDArray[np.uint16] = np.bitwise_xor(crc, byte) & np.uint16(0xFF)
    low ^= (low << np.uint16(4)) & np.uint16(0xFF)
    return np.asarray((crc >> 8) ^ (low << 8) ^ (low << 3) ^ (low >> 4), dtype=np.uint16)


def checksums(data: NDArray[np.uint8], offsets: NDArray[np.int64], lengths: NDArray[np.uint16]) -> NDArray[np.uint16]:
    """Checksum of each ``data[offset : offset + length]``, before the message's CRC_EXTRA.

    Args:
        data: Bytes, shape (m,).
        offsets: Starts of the spans, shape (n,).
        lengths: Lengths of the spans, >= 1, shape (n,); every span lies inside ``data``.
    """
    crcs = np.empty(len(offsets), dtype=np.uint16)
    order = np.argsort(lengths, kind="stable")  # of 16 bits: by radix
    for at in range(0, len(order), _BLOCK):
        block = order[at : at + _BLOCK]
        crcs[block] = _checksums_by_length(data, offsets[block], lengths[block])
    return crcs


def _checksums_by_length(
    data: NDArray[np.uint8], starts: NDArray[np.int64], lengths: NDArray[np.uint16]
) -> NDArray[np.uint16]:
    """Checksums of spans whose lengths ascend: the longer ones go on while the shorter ones are ready."""
    crc = np.full(len(starts), 0xFFFF, dtype=np.uint16)
    longest = (int(lengths[-1]) + 1) // 2
    words = spans(data, starts, 2 * longest).view("<u2").reshape(-1, longest)
    scratch = np.empty_like(crc)
    at_end = np.searchsorted(lengths, np.arange(2 * longest, dtype=np.uint16), side="right").reshape(-1, 2)
    for k, (ready, odd) in enumerate(at_end.tolist()):  # one byte is left of those between
        if odd > ready:
            crc[ready:odd] = accumulate(crc[ready:odd], words[ready:odd, k] & np.uint16(0xFF))
        crc[odd:] ^= words[odd:, k]
        _shift_in_two_bytes(crc[odd:], scratch[odd:])
    return crc


def _shift_in_two_bytes(crc: NDArray[np.uint16], scratch: NDArray[np.uint16]) -> None:
    """Checksums, in place, after two bytes that have been added to them.

    With the reflected polynomial x^16 + x^12 + x^5 + 1 the remainder is t + t/x^5 + t/x^12, where t solves
    t = crc + x^4 t + x^11 t. As (x^4 + x^11)^2 = x^8 in 16 bits, t = (1 + x^4 + x^11)(1 + x^8) crc. Shifts and sums of
    whole arrays are quicker than a table.
    """
    np.left_shift(crc, 8, out=scratch)
    np.bitwise_xor(crc, scratch, out=crc)
    np.left_shift(crc, 4, out=scratch)
    np.bitwise_xor(scratch, crc, out=scratch)
    np.left_shift(crc, 11, out=crc)
    np.bitwise_xor(crc, scratch, out=crc)  # t
    np.right_shift(crc, 5, out=scratch)
    np.bitwise_xor(scratch, crc, out=scratch)
    np.right_shift(crc, 12, out=crc)
    np.bitwise_xor(crc, scratch, out=crc)


def spans(data: NDArray[np.uint8], starts: NDArray[np.int64], size: int) -> NDArray[np.void]:
    """The bytes [start, start + size) of each start, one element of ``size`` bytes each; zeros behind the end.

    Args:
        data: Bytes, shape (m,).
        starts: Where the spans begin, inside ``data``, shape (n,).
        size: Bytes of a span, >= 1.
    """
    kind = f"V{size}"
    if not len(starts):
        return np.zeros(0, dtype=kind)
    if int(starts.max()) + size > len(data):
        return _spans_at_the_end(data, starts, size)
    windows: NDArray[np.void] = np.ndarray((len(data) - size + 1,), kind, data, 0, (1,))  # one at every byte
    return windows[starts]


def _spans_at_the_end(data: NDArray[np.uint8], starts: NDArray[np.int64], size: int) -> NDArray[np.void]:
    found = np.zeros(len(starts), dtype=f"V{size}")
    whole = starts + size <= len(data)
    found[whole] = spans(data, starts[whole], size)
    rows = found.view(np.uint8).reshape(-1, size)
    for row in np.flatnonzero(~whole).tolist():
        piece = data[starts[row] :]
        rows[row, : len(piece)] = piece
    return found


Bytes = NDArray[np.uint8]
Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]
ByteOrder = Literal["big", "little"]

_MIN_FRAME = OVERHEAD_V1  # [bytes] a version 1 frame without payload
DIALECT_SHARE = 0.9  # of the candidates: if fewer are of the dialect, the log is one of another autopilot
_LIKELY_TIMES = range(946_684_800_000_000, 4_102_444_800_000_000)  # of this century [us since 1970]
_BLOCK = 1 << 18  # bytes that are searched for markers at once: they stay in the cache
# A time stamp and the header that follows it. Names of one version lie over those of the other.
_HEADER = np.dtype(
    {
        "names": ["big", "little", "marker", "length", "flags", "system_v1", "component_v1", "id_v1", "system",
                  "component", "id"],
        "formats": [">u8", "<u8", "u1", "u1", "u1", "u1", "u1", "u1", "u1", "u1", "<u4"],
        "offsets": [0, 0, 8, 9, 10, 11, 12, 13, 13, 14, 14],  # version 2's id has three bytes behind the component
        "itemsize": 18,
    }
)  # fmt: skip
_HIGH_BYTES = {"big": (0, 1), "little": (7, 6)}  # of a stamp, the highest one first


@dataclass(frozen=True, slots=True)
class Damage:
    """Bytes that belong to no record; ``what`` describes them."""

    offset: int
    length: int
    what: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Records:
    """Records in the order of the file; every array has shape (n,)."""

    offsets: Ints  # of the time stamp
    ends: Ints
    times: Ints  # [us] as written
    ids: NDArray[np.int32]  # message ids
    v2: Flags  # a frame of version 2
    payload_lengths: Bytes
    systems: Bytes
    components: Bytes
    known: Flags  # the message is known and the checksum is right
    byte_order: ByteOrder  # of the time stamps


@dataclass(frozen=True, slots=True)
class _Candidates:
    """Bytes that may begin a frame; ``markers`` are their offsets, ascending."""

    markers: Ints
    ends: Ints  # may lie outside the file
    checked: NDArray[np.uint16]  # bytes that the checksum covers: header without its marker, and payload
    ids: NDArray[np.int32]

    def only(self, chosen: Flags) -> _Candidates:
        """The chosen candidates, without a copy if all are chosen."""
        if chosen.all():
            return self
        rows = np.flatnonzero(chosen)
        return _Candidates(self.markers[rows], self.ends[rows], self.checked[rows], self.ids[rows])


def scan(data: Bytes) -> tuple[Records, list[Damage]]:
    """Records of a log and the damage between them. Never raises an error, whatever the bytes are."""
    records = _found_records(data, "big")
    if 2 * int((records.ends - records.offsets).sum()) < len(data):
        records = max(records, _found_records(data, "little"), key=_verified)
    return records, _damage(data, records)


def _verified(records: Records) -> int:
    """Bytes of records with a right checksum."""
    return int((records.ends - records.offsets)[records.known].sum())


def _found_records(data: Bytes, byte_order: ByteOrder) -> Records:
    """Records with time stamps of one byte order."""
    found = _candidates(data, byte_order)
    headers = found.markers - STAMP_SIZE  # likely starts of records, whole or truncated
    found = found.only(found.ends <= len(data))
    known, accepted = np.zeros((2, len(found.ids)), dtype=np.bool_)
    is_foreign = np.count_nonzero(dialect_table().knows(found.ids)) < DIALECT_SHARE * len(known)
    for table in (whole_table,) if is_foreign else (dialect_table, whole_table):
        fresh = table().knows(found.ids) & ~known
        accepted[fresh] = _checksum_holds(data, found.only(fresh), table())
        known |= fresh
        proven = found.markers[known & accepted] - STAMP_SIZE
        accepted[~known] = _fits_its_neighbours(len(data), found.only(~known), headers, proven)
        if known[accepted].all():
            break  # no message of another autopilot: the second table is not needed
    found, known = found.only(accepted), known[accepted]
    disjoint = _disjoint(found.markers - STAMP_SIZE, found.ends)
    return _records(data, found.only(disjoint), known[disjoint], byte_order)


def _candidates(data: Bytes, byte_order: ByteOrder) -> _Candidates:
    """Marker bytes with a possible time before them and known flags after them."""
    markers = _markers(data, byte_order)
    header = spans(data, markers - STAMP_SIZE, _HEADER.itemsize).view(_HEADER)
    v2 = header["marker"] == MAGIC_V2
    signature = np.uint16(SIGNATURE_SIZE) * (v2 & (header["flags"] == SIGNED_FLAG))
    checked = header["length"] + np.where(v2, np.uint16(HEADER_V2 - 1), np.uint16(HEADER_V1 - 1))
    ids = np.where(v2, header["id"] >> 8, header["id_v1"]).astype(np.int32)
    return _Candidates(markers, markers + (checked + np.uint16(1 + CHECKSUM_SIZE) + signature), checked, ids)


def _markers(data: Bytes, byte_order: ByteOrder) -> Ints:
    """Offsets of bytes that may begin a frame: after a possible time, before known flags; the shortest frame fits."""
    found, stop = [np.zeros(0, dtype=np.int64)], len(data) - STAMP_SIZE - _MIN_FRAME + 1
    highest, second = _HIGH_BYTES[byte_order]
    for begin in range(0, stop, _BLOCK):
        end = min(begin + _BLOCK, stop)
        marker = data[begin + STAMP_SIZE : end + STAMP_SIZE]
        likely = marker - np.uint8(MAGIC_V2) < 2
        likely &= data[begin + highest : end + highest] == 0
        likely &= data[begin + second : end + second] < TIME_LIMIT >> 48
        likely &= (marker == MAGIC_V1) | (data[begin + STAMP_SIZE + 2 : end + STAMP_SIZE + 2] <= SIGNED_FLAG)
        found.append(np.flatnonzero(likely) + (begin + STAMP_SIZE))
    return np.concatenate(found)


def _records(data: Bytes, found: _Candidates, known: Flags, byte_order: ByteOrder) -> Records:
    offsets = found.markers - STAMP_SIZE
    header = spans(data, offsets, _HEADER.itemsize).view(_HEADER)
    v2 = header["marker"] == MAGIC_V2
    return Records(
        offsets=offsets,
        ends=found.ends,
        times=header[byte_order].astype(np.int64),
        ids=found.ids,
        v2=v2,
        payload_lengths=header["length"].copy(),
        systems=np.where(v2, header["system"], header["system_v1"]),
        components=np.where(v2, header["component"], header["component_v1"]),
        known=known,
        byte_order=byte_order,
    )


def _checksum_holds(data: Bytes, found: _Candidates, table: MessageTable) -> Flags:
    """Whether the checksums of messages that are in the table are right."""
    starts = found.markers + 1
    crc = accumulate(checksums(data, starts, found.checked), table.crc_extra(found.ids))
    holds: Flags = np.equal(spans(data, starts + found.checked, CHECKSUM_SIZE).view("<u2"), crc)
    return holds


def _fits_its_neighbours(size: int, found: _Candidates, headers: Ints, proven: Ints) -> Flags:
    """Whether frames without a verifiable checksum end where a record begins and contain no verified record.

    Args:
        size: Bytes of the log.
        found: Frames of unknown messages.
        headers: Likely starts of records, ascending.
        proven: Starts of the verified records, ascending.
    """
    following = headers.take(np.searchsorted(headers, found.ends), mode="clip")
    followed = (following == found.ends) | (size - found.ends < STAMP_SIZE + _MIN_FRAME)
    first = np.searchsorted(proven, found.markers - STAMP_SIZE, side="right")
    fits: Flags = followed & (first == np.searchsorted(proven, found.ends))
    return fits


def _disjoint(starts: Ints, ends: Ints) -> Flags:
    """Whether each span, ascending by start, begins at or after the end of the last one kept."""
    keep = np.ones(len(starts), dtype=np.bool_)
    if not np.any(starts[1:] < ends[:-1]):
        return keep
    free = 0
    for k, (start, end) in enumerate(zip(starts.tolist(), ends.tolist(), strict=True)):
        keep[k] = start >= free
        free = end if keep[k] else free
    return keep


def _damage(data: Bytes, records: Records) -> list[Damage]:
    begins = np.concatenate(([0], records.ends))
    ends = np.concatenate((records.offsets, [len(data)]))
    gaps = np.flatnonzero(ends > begins)
    return [
        Damage(begin, end - begin, _diagnose(data, begin, end, records.byte_order))
        for begin, end in zip(begins[gaps].tolist(), ends[gaps].tolist(), strict=True)
    ]


def _diagnose(data: Bytes, begin: int, end: int, byte_order: ByteOrder) -> str:
    """The fault at ``begin``, where a record should start."""
    header = bytes(data[begin : begin + STAMP_SIZE + 10])
    if not data[begin:end].any():
        return "zeros"
    if end == len(data) and _cut_short(header, len(data) - begin, byte_order):
        return "record cut short by the end of the file"
    if len(header) < STAMP_SIZE + 10 or header[STAMP_SIZE] not in {MAGIC_V1, MAGIC_V2}:
        return "no frame where one should start"
    if int.from_bytes(header[:STAMP_SIZE], byte_order) >= TIME_LIMIT:
        other: ByteOrder = "little" if byte_order == "big" else "big"
        is_likely = int.from_bytes(header[:STAMP_SIZE], other) in _LIKELY_TIMES
        return "impossible time" + (f", but for {other}-endian stamps as only a part of the file has" * is_likely)
    return _diagnose_frame(header[STAMP_SIZE:])


def _diagnose_frame(header: bytes) -> str:
    v2 = header[0] == MAGIC_V2
    if v2 and header[2] > SIGNED_FLAG:
        return f"unknown incompatibility flags {header[2]:#04x}"
    number = message_id(header)
    known = message_class(number)
    if known is None:
        return f"message {number} is not in the dialect and no record follows it"
    return f"wrong checksum or length of {known.msgname}"


def _cut_short(header: bytes, left: int, byte_order: ByteOrder) -> bool:
    """Whether the bytes up to the end of the file are the beginning of a record."""
    if left <= STAMP_SIZE:
        is_whole = byte_order == "big" or left == STAMP_SIZE
        return left < 2 or not is_whole or int.from_bytes(header[:STAMP_SIZE].ljust(8, b"\0"), byte_order) < TIME_LIMIT
    is_possible = int.from_bytes(header[:STAMP_SIZE], byte_order) < TIME_LIMIT
    if header[STAMP_SIZE] not in {MAGIC_V1, MAGIC_V2} or not is_possible:
        return False
    v2 = header[STAMP_SIZE] == MAGIC_V2
    whole = (
        STAMP_SIZE + (OVERHEAD_V2 if v2 else OVERHEAD_V1) + (header[STAMP_SIZE + 1] if left > STAMP_SIZE + 1 else 255)
    )
    whole += SIGNATURE_SIZE * (v2 and left > STAMP_SIZE + 2 and header[STAMP_SIZE + 2] == SIGNED_FLAG)
    return left < whole
