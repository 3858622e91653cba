"""Reads a telemetry log: an index of every record, messages one by one, fields as arrays, a timeline to play.

Playing time never runs backwards, also if the recording clock did: where that clock was set back, playing continues
from there, and a single record with a time far from its neighbours' gets theirs. A leap forward is a clock that was
set, not a silence, if it is of more than a day, or if the vehicle's own clock says that less than half of it passed.

The caller has the clock: it decides on pauses and speed. Playing time is that of ``recorder_clock``.
"""

from __future__ import annotations

from collections.abc import ItemsView, Iterator, Mapping, ValuesView
from dataclasses import dataclass, replace
from functools import cache, cached_property
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from protocol.errors import FileError
from protocol.tlog.message_set import decode, message_name, message_named
from protocol.tlog.scan import STAMP_SIZE, Damage, scan, spans
from protocol.wire.framing import HEADER_V1, HEADER_V2, SIGNED_FLAG, split_frames
from protocol.wire.message import Message, Source

_TYPES = {
    "char": "S",
    "int8_t": "<i1",
    "uint8_t": "<u1",
    "int16_t": "<i2",
    "uint16_t": "<u2",
    "int32_t": "<i4",
    "uint32_t": "<u4",
    "int64_t": "<i8",
    "uint64_t": "<u8",
    "float": "<f4",
    "double": "<f8",
}


@cache
def payload_type(message_class: Message) -> np.dtype[np.void]:
    """Structured type of a message's untrimmed payload: fields in wire order, with extensions."""
    fields: list[tuple[str, str, tuple[int, ...]]] = []
    kinds = dict(zip(message_class.fieldnames, message_class.fieldtypes, strict=True))
    for position, name in enumerate(message_class.ordered_fieldnames):
        count = message_class.array_lengths[position]
        kind = _TYPES[kinds[name]]
        text = kind == "S"
        fields.append((name, f"S{count or 1}" if text else kind, (count,) if count and not text else ()))
    return np.dtype(fields)


class Columns(Mapping[str, NDArray[Any]]):
    """Fields of n payloads by name, one row for each payload. Memory is taken by those that were asked for.

    Args:
        data: Bytes of the log.
        starts: Starts of the payloads, shape (n,).
        lengths: Their lengths on the wire, shape (n,); what is missing of a payload is zeros, what it has more is left
            out.
        message_class: The message.
    """

    def __init__(
        self, data: NDArray[np.uint8], starts: NDArray[np.int64], lengths: NDArray[np.uint8], message_class: Message
    ) -> None:
        self._data, self._starts, self._lengths = data, starts, lengths
        self._names = tuple(message_class.fieldnames)
        self._type = payload_type(message_class)
        self._places = {name: place[1] for name, place in (self._type.fields or {}).items()}
        self._shortest, self._longest = (int(lengths.min()), int(lengths.max())) if len(lengths) else (0, 0)
        self._decoded: dict[str, NDArray[Any]] = {}

    def __getitem__(self, name: str) -> NDArray[Any]:
        if name not in self._decoded:
            self._decoded[name] = self._decode(name)
        return self._decoded[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)

    def items(self) -> ItemsView[str, NDArray[Any]]:
        """All fields, decoded at once: quicker than one by one."""
        self._decode_all()
        return super().items()

    def values(self) -> ValuesView[NDArray[Any]]:
        """All fields without their names, decoded at once."""
        self._decode_all()
        return super().values()

    def _decode_all(self) -> None:
        if len(self._decoded) == len(self._names):
            return
        rows = spans(self._data, self._starts, self._type.itemsize)
        self._clear_missing(rows, 0)
        table = rows.view(self._type)
        self._decoded = {name: table[name] for name in self._names}

    def _decode(self, name: str) -> NDArray[Any]:
        kind, at = self._type[name], self._places[name]
        found = spans(self._data, self._starts + at, kind.itemsize)
        self._clear_missing(found, at)
        return found.view(kind.base).reshape(-1, *kind.shape)

    def _clear_missing(self, found: NDArray[np.void], at: int) -> None:
        """Zeros where a payload has ended, in pieces of it from ``at``: MAVLink 2 leaves out zeros at the end."""
        size, whole = found.itemsize, max(self._shortest - at, 0)
        if whole >= size:
            return
        tails = found.view(np.uint8).reshape(-1, size)[:, whole:]
        if self._longest == self._shortest:
            tails[:] = 0
        else:
            tails *= np.arange(at + whole, at + size) < self._lengths[:, np.newaxis]


Ints = NDArray[np.int64]
BOOT_TIMED = ("ATTITUDE", "LOCAL_POSITION_NED", "GLOBAL_POSITION_INT", "SYSTEM_TIME")  # with a time since boot
DAY = 86_400_000_000  # [us]
MIN_LEAP = 60_000_000  # that is looked at: a shorter one is a silence [us]


@dataclass(frozen=True)
class RecorderClock:
    """The times of a log's records.

    Attributes:
        playing: Playing time of each record [s], ascending, shape (n,).
        backward: Records with an earlier time than the one before.
        forward: Records before which the clock was set forward.
        times: As recorded [us since 1970], shape (n,).
    """

    playing: NDArray[np.float64]
    backward: Ints
    forward: Ints
    times: Ints

    @property
    def duration(self) -> float:
        """Playing time of the last record [s]."""
        return float(self.playing[-1]) if len(self.playing) else 0.0

    @cached_property
    def start_usec(self) -> int:
        """Time of the first record, by the clock that most records were made by [us since 1970]."""
        cuts = [0, *sorted({*self.backward.tolist(), *self.forward.tolist()}), len(self.times)]
        begin = max(pairwise(cuts), key=lambda cut: cut[1] - cut[0])[0]
        return int(self.times[begin]) - round(float(self.playing[begin]) * 1e6) if len(self.times) else 0

    def steps(self, rows: Ints) -> NDArray[np.float64]:
        """By how much the clock stepped before some records [s]."""
        return (self.times[rows] - self.times[rows - 1]) / 1e6


def recorder_clock(times: Ints, reader: TlogReader | None = None) -> RecorderClock:
    """The clock of times as recorded [us], shape (n,); the log's messages tell the vehicle's clock."""
    if not len(times):
        return RecorderClock(np.zeros(0), np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64), times)
    before, now, after = times[:-2], times[1:-1], times[2:]
    steady = times.copy()
    odd = (before <= after) & ((now < before) | (now > after))
    steady[1:-1][odd] = before[odd]
    steps = np.diff(steady)
    forward = np.zeros(0, dtype=np.int64)
    if steps.max(initial=0) > MIN_LEAP:
        forward = _set_forward(steps, times, reader)
        steps[forward - 1] = 0
    playing = np.concatenate(([0.0], np.cumsum(np.maximum(steps, 0)) / 1e6))
    return RecorderClock(playing, np.flatnonzero(np.diff(times) < 0) + 1, forward, times)


def _set_forward(steps: Ints, times: Ints, reader: TlogReader | None) -> Ints:
    """Records before which the clock was set forward."""
    leaps = np.flatnonzero(steps > MIN_LEAP) + 1
    is_set = steps[leaps - 1] > DAY
    for name in BOOT_TIMED if reader is not None else ():
        if not is_set.all():
            is_set |= _is_silence_too_short(name, leaps, times, reader)
    return leaps[is_set]


def _is_silence_too_short(name: str, leaps: Ints, times: Ints, reader: TlogReader | None) -> NDArray[np.bool_]:
    """Before which records the sender's time since boot went on by less than half of what the recorder's did."""
    found = np.zeros(len(leaps), dtype=np.bool_)
    if reader is None or len(rows := reader.rows(name)) < 2:
        return found
    at = np.searchsorted(rows, leaps)
    inside = (at > 0) & (at < len(rows))
    first, then = rows[at[inside] - 1], rows[at[inside]]
    boot = reader.columns(name)["time_boot_ms"].astype(np.int64) * 1000
    passed = boot[at[inside]] - boot[at[inside] - 1]
    is_one_sender = (reader.systems[first] == reader.systems[then]) & (
        reader.components[first] == reader.components[then]
    )
    found[inside] = is_one_sender & (passed >= 0) & (2 * passed < times[then] - times[first])
    return found


_MAGIC = {b"ULog\x01\x12\x35": "a PX4 ULog file", b"\xa3\x95\x80": "an ArduPilot dataflash log"}

_COLUMNS = (  # one row for each record
    *("times", "offsets", "lengths", "ids", "systems", "components", "known"),
    *("_v2", "_payload_lengths", "_payload_places"),
)


@dataclass(frozen=True, slots=True)
class LogOrigin:
    """The file of another kind that a log was made from: its kind, its size [bytes], and the damage in it."""

    kind: str
    size: int
    damage: tuple[Damage, ...] = ()


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
        origin: The file of another kind that it was made from, whose size and damage count; None: it is the file.
    """

    def __init__(self, data: bytes, origin: LogOrigin | None = None) -> None:
        self.origin = origin
        self._bytes = np.frombuffer(data, dtype=np.uint8)
        records, damage = scan(self._bytes)
        self.damage: tuple[Damage, ...] = tuple(damage) if origin is None else origin.damage
        self.offsets, self.times = records.offsets, records.times
        self.lengths = records.ends - records.offsets
        self.ids, self.known = records.ids, records.known
        self.systems, self.components = records.systems, records.components
        self.byte_order = records.byte_order
        self._v2 = records.v2
        self._payload_lengths = records.payload_lengths
        self._payload_places = np.where(records.v2, np.uint8(STAMP_SIZE + HEADER_V2), np.uint8(STAMP_SIZE + HEADER_V1))

    def only(self, chosen: NDArray[np.bool_]) -> TlogReader:
        """The log with some of its records alone, by a mask of shape (n,); size, damage and times are the file's."""
        part = TlogReader.__new__(TlogReader)
        for name in ("_bytes", "damage", "byte_order", "origin"):
            setattr(part, name, getattr(self, name))
        for name in _COLUMNS:
            setattr(part, name, getattr(self, name)[chosen])
        part.clock = replace(recorder_clock(part.times, part), playing=self.clock.playing[chosen])
        return part

    def __len__(self) -> int:
        return len(self.offsets)

    @property
    def size(self) -> int:
        """Bytes of the file: the sum of all records and all damage."""
        return len(self._bytes) if self.origin is None else self.origin.size

    def row_before(self, piece: Damage) -> int:
        """Index of the record before a piece of damage, -1 if it is at the beginning; in another file, about where."""
        if self.origin is None:
            return int(np.searchsorted(self.offsets, piece.offset)) - 1
        return round((len(self) - 1) * min(piece.offset / max(self.origin.size, 1), 1.0))

    @property
    def signed(self) -> NDArray[np.bool_]:
        """Whether each frame carries a signature (not verified here), shape (n,)."""
        signed: NDArray[np.bool_] = self._v2 & (self._bytes[self.offsets + STAMP_SIZE + 2] == SIGNED_FLAG)
        return signed

    @property
    def sequences(self) -> NDArray[np.uint8]:
        """Sequence number of each frame, shape (n,)."""
        numbers: NDArray[np.uint8] = self._bytes[self.offsets + STAMP_SIZE + np.where(self._v2, 4, 2)]
        return numbers

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


@dataclass(frozen=True, slots=True)
class Marker:
    """A remark about the recording itself: damage, or a step of its clock."""

    time: float  # playing time [s]
    what: str


class Timeline:
    """Plays a log: a position in time, and the number of records played, which tells records of one time apart.

    Attributes:
        times: Playing time of each record [s], shape (n,).
        duration: Playing time of the last record [s].
        position: Playing time reached [s].
        played: Records played: the next one has this index.
        markers: Damage and steps of the recording clock, by time.
    """

    def __init__(self, reader: TlogReader) -> None:
        self._reader = reader
        self.times = reader.clock.playing
        self.duration = reader.clock.duration
        self.position = 0.0
        self.played = 0
        self.markers = _markers(reader, self.times)

    @property
    def finished(self) -> bool:
        """Whether every record has been played."""
        return self.played == len(self._reader)

    @property
    def time_usec(self) -> int:
        """Recorded time of the last record played [us]; of the first record before the start."""
        return int(self._reader.times[max(self.played - 1, 0)]) if len(self._reader) else 0

    def seek(self, time: float) -> None:
        """Move to a playing time [s], clamped to the log: after the records up to and at it."""
        self.position = min(max(time, 0.0), self.duration)
        self.played = self._count(self.position)

    def go_to(self, played: int) -> None:
        """Move to where so many records have been played."""
        self.played = min(max(played, min(1, len(self._reader))), len(self._reader))
        self.position = float(self.times[self.played - 1]) if self.played else 0.0

    def advance(self, dt: float) -> range:
        """Play ``dt`` seconds (>= 0): the records in (position, position + dt], the very first one included."""
        self.position = min(self.position + dt, self.duration)
        begin, self.played = self.played, max(self.played, self._count(self.position))
        return range(begin, self.played)

    def message(self, record: int) -> Message | None:
        """The message of a record; None outside the dialect, as on a link."""
        return self._reader.decode(record)

    def _count(self, time: float) -> int:
        """Records up to and at a playing time."""
        return int(np.searchsorted(self.times, time, side="right"))


def _markers(reader: TlogReader, times: NDArray[np.float64]) -> tuple[Marker, ...]:
    markers = []
    for piece in reader.damage:
        before = reader.row_before(piece)
        time = float(times[before]) if before >= 0 else 0.0
        markers.append(Marker(time, f"{piece.length} bytes damaged: {piece.what}"))
    rows = np.concatenate((reader.clock.backward, reader.clock.forward))
    for row, step in zip(rows.tolist(), reader.clock.steps(rows).tolist(), strict=True):
        markers.append(Marker(float(times[row]), f"recording clock stepped by {step:.3f} s"))
    return tuple(sorted(markers, key=lambda marker: marker.time))
