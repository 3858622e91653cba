"""Reads a telemetry log: an index of every record, messages one by one, fields as arrays."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from protocol.errors import FileError
from protocol.tlog.columns import Columns
from protocol.tlog.message_set import decode, message_name, message_named
from protocol.tlog.recorder_clock import RecorderClock, recorder_clock
from protocol.tlog.scan import STAMP_SIZE, Damage, scan
from protocol.wire.framing import HEADER_V1, HEADER_V2, SIGNED_FLAG, split_frames
from protocol.wire.message import Message, Source

__all__ = ["TlogReader", "read_tlog"]

_MAGIC = {b"ULog\x01\x12\x35": "a PX4 ULog file", b"\xa3\x95\x80": "an ArduPilot dataflash log"}

_COLUMNS = (  # one row for each record
    *("times", "offsets", "lengths", "ids", "systems", "components", "known"),
    *("_v2", "_payload_lengths", "_payload_places"),
)


class TlogReader:
    """Index of a log in memory. Damaged bytes raise no error: ``damage`` lists what was skipped.

    Attributes:
        times: Time of each record as written [us], shape (n,); it may go backwards (see ``backward``).
        offsets: Start of each record (its time stamp) in the file, shape (n,).
        lengths: Length of each record, stamp included, shape (n,).
        ids: Message ids, shape (n,).
        systems: Sending systems, shape (n,).
        components: Sending components, shape (n,).
        known: Whether the message is known (``message_set``), shape (n,); checksums of the others cannot be verified.
        damage: Bytes between the records.
        byte_order: Of the time stamps: big-endian, or little-endian as early ground stations wrote them.
    """

    def __init__(self, data: bytes) -> None:
        self._bytes = np.frombuffer(data, dtype=np.uint8)
        records, damage = scan(self._bytes)
        self.damage: tuple[Damage, ...] = tuple(damage)
        self.offsets, self.times = records.offsets, records.times
        self.lengths = records.ends - records.offsets
        self.ids, self.known = records.ids, records.known
        self.systems, self.components = records.systems, records.components
        self.byte_order = records.byte_order
        self._v2 = records.v2
        self._payload_lengths = records.payload_lengths
        self._payload_places = np.where(records.v2, np.uint8(STAMP_SIZE + HEADER_V2), np.uint8(STAMP_SIZE + HEADER_V1))

    def only(self, chosen: NDArray[np.bool_]) -> TlogReader:
        """The log with some of its records alone, chosen by a mask of shape (n,); size and damage are the file's."""
        part = TlogReader.__new__(TlogReader)
        for name in ("_bytes", "damage", "byte_order"):
            setattr(part, name, getattr(self, name))
        for name in _COLUMNS:
            setattr(part, name, getattr(self, name)[chosen])
        return part

    def __len__(self) -> int:
        return len(self.offsets)

    @property
    def size(self) -> int:
        """Bytes of the log: the sum of all records and all damage."""
        return len(self._bytes)

    @property
    def signed(self) -> NDArray[np.bool_]:
        """Whether each frame carries a signature (not verified here), shape (n,)."""
        signed: NDArray[np.bool_] = self._v2 & (self._bytes[self.offsets + STAMP_SIZE + 2] == SIGNED_FLAG)
        return signed

    @property
    def versions(self) -> NDArray[np.int64]:
        """MAVLink version of each frame, shape (n,)."""
        return np.where(self._v2, 2, 1)

    @cached_property
    def clock(self) -> RecorderClock:
        """The recorder's clock: playing time, and where the clock was set."""
        return recorder_clock(self.times, self)

    @property
    def backward(self) -> NDArray[np.int64]:
        """Indices of the records with an earlier time than the record before."""
        return self.clock.backward

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the known messages that the log holds, by id."""
        return tuple(
            message_name(number) for number, (first, _) in self._groups.items() if self.known[self._by_id[first]]
        )

    def frame(self, index: int) -> bytes:
        """Raw frame of one record, without its time."""
        start = self.offsets[index]
        return self._bytes[start + STAMP_SIZE : start + self.lengths[index]].tobytes()

    def records(self) -> Iterator[tuple[int, bytes]]:
        """(time [us], raw frame) of every record, as ``TlogWriter.write`` takes them."""
        for index in range(len(self)):
            yield int(self.times[index]), self.frame(index)

    def decode(self, index: int) -> Message | None:
        """Message of one record; None if its id is not known."""
        return decode(self.frame(index), int(self.ids[index])) if self.known[index] else None

    def rows(self, name: str, source: Source | None = None) -> NDArray[np.int64]:
        """Indices of the records that hold message ``name``, of one (system, component) or of all.

        Raises:
            LocalProtocolError: There is no such message.
        """
        first, last = self._groups.get(message_named(name).id, (0, 0))
        rows = self._by_id[first:last]
        if source is None:
            return rows
        chosen: NDArray[np.int64] = rows[(self.systems[rows] == source[0]) & (self.components[rows] == source[1])]
        return chosen

    def columns(self, name: str, source: Source | None = None) -> Columns:
        """Fields of all messages ``name`` by field name, in wire units, one row for each of ``rows``.

        Each field is decoded when it is asked for. Array fields have shape (n, count); text fields are bytes without
        their trailing zeros.

        Raises:
            LocalProtocolError: There is no such message.
        """
        rows = self.rows(name, source)
        return Columns(
            self._bytes,
            self.offsets[rows] + self._payload_places[rows],
            self._payload_lengths[rows],
            message_named(name),
        )

    @cached_property
    def _by_id(self) -> NDArray[np.int64]:
        """Indices of the records, grouped by message id, ascending in each group."""
        narrow = bool((self.ids < 1 << 16).all())  # 16 bits are sorted by radix
        order = np.argsort(self.ids.astype(np.uint16) if narrow else self.ids, kind="stable")
        order.flags.writeable = False
        return order

    @cached_property
    def _groups(self) -> dict[int, tuple[int, int]]:
        """For each message id where its records begin and end in ``_by_id``."""
        ids = self.ids[self._by_id]
        cuts = [0, *(np.flatnonzero(np.diff(ids)) + 1).tolist(), len(ids)]
        return {int(ids[begin]): (begin, end) for begin, end in pairwise(cuts) if end > begin}


def read_tlog(path: Path | str) -> TlogReader:
    """The log in a file, read completely.

    Raises:
        FileError: The file cannot be read, is empty, or is not a telemetry log.
    """
    try:
        data = Path(path).read_bytes()
    except OSError as error:
        raise FileError(f"{path}: cannot be read: {error.strerror}") from error
    if not data:
        raise FileError(f"{path}: the file is empty")
    reader = TlogReader(data)
    bare = len(split_frames(data[:4096])) > 1
    if bare or not (reader.known.any() or 2 * int(reader.lengths.sum()) > len(data)):
        raise FileError(f"{path}: not a telemetry log: {_guess_type(data)}")
    return reader


def _guess_type(data: bytes) -> str:
    """A guess at the type of a file without records."""
    for magic, what in _MAGIC.items():
        if data.startswith(magic):
            return f"it is {what}"
    if split_frames(data[:4096]):
        return "it begins with bare MAVLink frames, without the time stamps of a log"
    if not set(data[:4096]) - set(b"\t\n\r\f") - set(range(0x20, 0x7F)):
        return "it is a text file"
    return f"its {len(data)} bytes hold no valid record"
