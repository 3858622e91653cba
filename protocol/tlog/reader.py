"""Reads a telemetry log: an index of every record, messages one by one, fields as arrays."""

from collections.abc import Iterator
from functools import cache, cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from protocol.dialect import mavlink
from protocol.errors import FileError, LocalProtocolError
from protocol.framing import MAGIC_V2, split_frames
from protocol.message import Message, Source
from protocol.tlog.columns import payload_type, payloads
from protocol.tlog.scan import Damage, scan
from protocol.tlog.time_stamp import STAMP_SIZE

__all__ = ["TlogReader", "message_name", "read_tlog"]

_MAGIC = {b"ULog\x01\x12\x35": "a PX4 ULog file", b"\xa3\x95\x80": "an ArduPilot dataflash log"}


def message_name(number: int) -> str:
    """Name of a message id; ids outside the dialect are called ``UNKNOWN_n``, as in pymavlink."""
    known = mavlink.mavlink_map.get(number)
    return str(known.msgname) if known is not None else f"UNKNOWN_{number}"


class TlogReader:
    """Index of a log in memory. Damaged bytes raise no error: ``damage`` lists what was skipped.

    Attributes:
        times: Time of each record as written [us], shape (n,); it may go backwards (see ``backward``).
        offsets: Start of each record (its time stamp) in the file, shape (n,).
        lengths: Length of each record, stamp included, shape (n,).
        ids: Message ids, shape (n,).
        systems: Sending systems, shape (n,).
        components: Sending components, shape (n,).
        known: Whether the id is in the dialect, shape (n,); checksums of the others cannot be verified.
        damage: Bytes between the records.
    """

    def __init__(self, data: bytes) -> None:
        self._bytes = np.frombuffer(data, dtype=np.uint8)
        records, damage = scan(self._bytes)
        self.damage: tuple[Damage, ...] = tuple(damage)
        self.offsets, self.times = records.offsets, records.times
        self.lengths = records.ends - records.offsets
        self.ids, self.known = records.ids, records.known
        self._mav = mavlink.MAVLink(None)
        self._markers = self.offsets + STAMP_SIZE
        self._v2 = self._bytes[self._markers] == MAGIC_V2
        self.systems = self._bytes[self._markers + np.where(self._v2, 5, 3)]
        self.components = self._bytes[self._markers + np.where(self._v2, 6, 4)]

    def __len__(self) -> int:
        return len(self.offsets)

    @property
    def size(self) -> int:
        """Bytes of the log: the sum of all records and all damage."""
        return len(self._bytes)

    @property
    def signed(self) -> NDArray[np.bool_]:
        """Which frames carry a signature (not verified here), shape (n,)."""
        signed: NDArray[np.bool_] = self._v2 & (self._bytes[self._markers + 2] == 1)
        return signed

    @property
    def versions(self) -> NDArray[np.int64]:
        """MAVLink version of each frame, shape (n,)."""
        return np.where(self._v2, 2, 1)

    @cached_property
    def backward(self) -> NDArray[np.int64]:
        """Indices of the records with an earlier time than the record before."""
        return np.flatnonzero(np.diff(self.times) < 0) + 1

    def frame(self, index: int) -> bytes:
        """Raw frame of one record, without its time."""
        return self._bytes[self._markers[index] : self.offsets[index] + self.lengths[index]].tobytes()

    def records(self) -> Iterator[tuple[int, bytes]]:
        """(time [us], raw frame) of every record, as ``TlogWriter.write`` takes them."""
        for index in range(len(self)):
            yield int(self.times[index]), self.frame(index)

    def decode(self, index: int) -> Message | None:
        """Message of one record; None if its id is not in the dialect."""
        if not self.known[index]:
            return None
        return self._mav.decode(bytearray(self.frame(index)))

    def rows(self, name: str, source: Source | None = None) -> NDArray[np.int64]:
        """Indices of the records that hold message ``name``, of one (system, component) or of all.

        Raises:
            LocalProtocolError: The dialect has no such message.
        """
        chosen = self.ids == _message_class(name).id
        if source is not None:
            chosen &= (self.systems == source[0]) & (self.components == source[1])
        return np.flatnonzero(chosen)

    def columns(self, name: str, source: Source | None = None) -> dict[str, NDArray[np.generic]]:
        """Fields of all messages ``name`` by field name, in wire units, one row for each of ``rows``.

        Array fields have shape (n, count); text fields are bytes without their trailing zeros.

        Raises:
            LocalProtocolError: The dialect has no such message.
        """
        rows = self.rows(name, source)
        message_class = _message_class(name)
        starts = self._markers[rows] + np.where(self._v2[rows], 10, 6)
        lengths = self._bytes[self._markers[rows] + 1].astype(np.int64)
        table = payloads(self._bytes, starts, lengths, payload_type(message_class))
        return {field: table[field] for field in message_class.fieldnames}


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


def _message_class(name: str) -> Message:
    try:
        return _by_name()[name]
    except KeyError:
        raise LocalProtocolError(f"the dialect has no message {name!r}") from None


@cache
def _by_name() -> dict[str, Message]:
    return {known.msgname: known for known in mavlink.mavlink_map.values()}


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
