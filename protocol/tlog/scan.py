"""Finds the records of a telemetry log and the damage between them.

A record is a time stamp (eight bytes, microseconds, big-endian) and one frame. No marker precedes it, so every byte
that may begin a frame is a candidate. A candidate must pass these tests:

- its time is before the year 2255, its flags are known and the whole frame is in the file;
- a message of the dialect has the right checksum;
- any other message, whose checksum cannot be verified, is followed by the likely start of another record or by the
  end of the file, and contains no verified record.

Candidates that pass are accepted in the order of the file; one that overlaps an accepted record is dropped. The rest is
damage: every byte of the file belongs to one record or to one piece of damage. All steps work on whole arrays.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from protocol.dialect import mavlink
from protocol.framing import MAGIC_V1, MAGIC_V2, OVERHEAD_V1, OVERHEAD_V2, SIGNATURE_SIZE, SIGNED_FLAG, message_id
from protocol.tlog.crc import accumulate, checksums
from protocol.tlog.time_stamp import STAMP_SIZE, TIME_LIMIT

__all__ = ["Damage", "Records", "scan"]

Bytes = NDArray[np.uint8]
Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]

_MIN_FRAME = OVERHEAD_V1  # [bytes] a version 1 frame without payload


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
    ids: Ints  # message ids
    known: Flags  # the id is in the dialect and the checksum is right


@dataclass(frozen=True, slots=True)
class _Candidates:
    """Bytes that may begin a frame; ``markers`` are their offsets, ascending."""

    markers: Ints
    ends: Ints  # may lie outside the file
    ids: Ints
    v2: Flags

    def only(self, chosen: Flags) -> "_Candidates":
        """The chosen candidates, without a copy if all are chosen."""
        if chosen.all():
            return self
        return _Candidates(self.markers[chosen], self.ends[chosen], self.ids[chosen], self.v2[chosen])


def scan(data: Bytes) -> tuple[Records, list[Damage]]:
    """Records of a log and the damage between them. Never raises an error, whatever the bytes are."""
    found = _candidates(data)
    headers = found.markers - STAMP_SIZE  # likely starts of records, whole or truncated
    found = found.only(found.ends <= len(data))
    known = np.isin(found.ids, _dialect()[0])
    accepted = np.zeros(len(known), dtype=np.bool_)
    accepted[known] = _checksum_holds(data, found.only(known))
    proven = found.markers[accepted] - STAMP_SIZE
    accepted[~known] = _fits_its_neighbours(len(data), found.only(~known), headers, proven)
    found, known = found.only(accepted), known[accepted]
    disjoint = _disjoint(found.markers - STAMP_SIZE, found.ends)
    found, known = found.only(disjoint), known[disjoint]
    offsets = found.markers - STAMP_SIZE
    records = Records(offsets=offsets, ends=found.ends, times=_times(data, offsets), ids=found.ids, known=known)
    return records, _damage(data, records)


def _candidates(data: Bytes) -> _Candidates:
    """Marker bytes with a possible time before them and known flags after them."""
    size = len(data)
    markers = np.flatnonzero((data - np.uint8(MAGIC_V2)) < 2).astype(np.int64)
    markers = markers[(markers >= STAMP_SIZE) & (markers + _MIN_FRAME <= size)]
    possible = (data[markers - 8] == 0) & (data[markers - 7] < TIME_LIMIT >> 48)
    v2 = data[markers] == MAGIC_V2
    possible &= ~v2 | (data[markers + 2] <= SIGNED_FLAG)
    markers, v2 = markers[possible], v2[possible]
    signed = np.where(v2, data[markers + 2], 0).astype(np.int64)
    ends = markers + data[markers + 1] + np.where(v2, OVERHEAD_V2, OVERHEAD_V1) + SIGNATURE_SIZE * signed
    ids = np.where(v2, _little_endian(data, markers + 7, 3), data[markers + 5])
    return _Candidates(markers, ends, ids, v2)


def _little_endian(data: Bytes, offsets: Ints, count: int) -> Ints:
    """Unsigned integers of ``count`` bytes; bytes outside the file are read as its last one."""
    number = np.zeros(len(offsets), dtype=np.int64)
    for k in range(count):
        number |= data.take(offsets + k, mode="clip").astype(np.int64) << 8 * k
    return number


@cache
def _dialect() -> tuple[Ints, Bytes]:
    """Message ids of the dialect, ascending, and the CRC_EXTRA of each."""
    ids = sorted(mavlink.mavlink_map)
    extra = [mavlink.mavlink_map[number].crc_extra for number in ids]
    return np.array(ids, dtype=np.int64), np.array(extra, dtype=np.uint8)


def _checksum_holds(data: Bytes, found: _Candidates) -> Flags:
    """Whether the checksums of messages of the dialect are right."""
    starts = found.markers + 1
    lengths = data[starts].astype(np.int64) + np.where(found.v2, 9, 5)  # header without its marker, and payload
    ids, extra = _dialect()
    crc = accumulate(checksums(data, starts, lengths), extra[np.searchsorted(ids, found.ids)])
    return np.equal(_little_endian(data, starts + lengths, 2), crc)


def _fits_its_neighbours(size: int, found: _Candidates, headers: Ints, proven: Ints) -> Flags:
    """Whether frames without a verifiable checksum end where a record begins and contain no verified record.

    Args:
        size: Bytes of the log.
        found: Frames outside the dialect.
        headers: Likely starts of records, ascending.
        proven: Starts of the verified records, ascending.
    """
    following = headers.take(np.searchsorted(headers, found.ends), mode="clip")
    followed = (following == found.ends) | (size - found.ends < STAMP_SIZE + _MIN_FRAME)
    first = np.searchsorted(proven, found.markers - STAMP_SIZE, side="right")
    fits: Flags = followed & (first == np.searchsorted(proven, found.ends))
    return fits


def _disjoint(starts: Ints, ends: Ints) -> Flags:
    """Which spans, ascending by start, begin at or after the end of the last chosen one."""
    keep = np.ones(len(starts), dtype=np.bool_)
    if not np.any(starts[1:] < ends[:-1]):
        return keep
    free = 0
    for k, (start, end) in enumerate(zip(starts.tolist(), ends.tolist(), strict=True)):
        keep[k] = start >= free
        free = end if keep[k] else free
    return keep


def _times(data: Bytes, offsets: Ints) -> Ints:
    if not len(offsets):
        return np.zeros(0, dtype=np.int64)
    stamps = np.ascontiguousarray(sliding_window_view(data, STAMP_SIZE)[offsets])
    return stamps.view(">u8")[:, 0].astype(np.int64)


def _damage(data: Bytes, records: Records) -> list[Damage]:
    begins = np.concatenate(([0], records.ends))
    ends = np.concatenate((records.offsets, [len(data)]))
    gaps = np.flatnonzero(ends > begins)
    return [
        Damage(begin, end - begin, _diagnose(data, begin, end))
        for begin, end in zip(begins[gaps].tolist(), ends[gaps].tolist(), strict=True)
    ]


def _diagnose(data: Bytes, begin: int, end: int) -> str:
    """The fault at ``begin``, where a record should start."""
    header = bytes(data[begin : begin + STAMP_SIZE + 10])
    if not data[begin:end].any():
        return "zeros"
    if end == len(data) and _cut_short(header, len(data) - begin):
        return "record cut short by the end of the file"
    if len(header) < STAMP_SIZE + 10 or header[STAMP_SIZE] not in {MAGIC_V1, MAGIC_V2}:
        return "no frame where one should start"
    if int.from_bytes(header[:STAMP_SIZE]) >= TIME_LIMIT:
        return "impossible time"
    return _diagnose_frame(header[STAMP_SIZE:])


def _diagnose_frame(header: bytes) -> str:
    v2 = header[0] == MAGIC_V2
    if v2 and header[2] > SIGNED_FLAG:
        return f"unknown incompatibility flags {header[2]:#04x}"
    number = message_id(header)
    if number not in mavlink.mavlink_map:
        return f"message {number} is not in the dialect and no record follows it"
    return f"wrong checksum or length of {mavlink.mavlink_map[number].msgname}"


def _cut_short(header: bytes, left: int) -> bool:
    """Whether the bytes up to the end of the file are the beginning of a record."""
    if left <= STAMP_SIZE:
        return left < 2 or int.from_bytes(header[:2]) < TIME_LIMIT >> 48
    if header[STAMP_SIZE] not in {MAGIC_V1, MAGIC_V2} or int.from_bytes(header[:STAMP_SIZE]) >= TIME_LIMIT:
        return False
    v2 = header[STAMP_SIZE] == MAGIC_V2
    whole = (
        STAMP_SIZE + (OVERHEAD_V2 if v2 else OVERHEAD_V1) + (header[STAMP_SIZE + 1] if left > STAMP_SIZE + 1 else 255)
    )
    whole += SIGNATURE_SIZE * (v2 and left > STAMP_SIZE + 2 and header[STAMP_SIZE + 2] == SIGNED_FLAG)
    return left < whole
