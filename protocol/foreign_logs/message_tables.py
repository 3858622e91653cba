"""MAVLink messages by whole columns: tables of fields in, a telemetry log out.

A log of another kind is told to everything that reads logs as the messages a vehicle would have sent.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from protocol.tlog.message_set import message_named
from protocol.tlog.reader import payload_type
from protocol.tlog.scan import STAMP_SIZE, accumulate
from protocol.wire.framing import CHECKSUM_SIZE, HEADER_V2, MAGIC_V2
from protocol.wire.message import Message

COMPONENT = 1  # MAV_COMP_ID_AUTOPILOT1


class MessageRows(NamedTuple):
    """Messages of one kind from one system.

    Attributes:
        name: Of the message.
        system: System id of the sender.
        times: Since the vehicle was switched on [s], shape (n,).
        fields: Columns by field, in wire units, each of n rows; what is missing is zero.
    """

    name: str
    system: int
    times: NDArray[np.float64]
    fields: Mapping[str, NDArray[Any]]


def as_telemetry_log(tables: Sequence[MessageRows], start_usec: int) -> bytes:
    """A telemetry log of all messages, by time.

    Args:
        tables: The messages.
        start_usec: When the vehicle was switched on, since 1970 [us]; 0 if that is not known.
    """
    times = np.concatenate([table.times for table in tables]) if tables else np.zeros(0)
    if not len(times):
        return b""
    rank = np.empty(len(times), np.int64)
    order = np.argsort(times, kind="stable")
    rank[order] = np.arange(len(times))
    sizes = np.concatenate([np.full(len(table.times), _record_size(table.name)) for table in tables])
    ends = np.cumsum(sizes[order])
    data = np.zeros(int(ends[-1]), np.uint8)
    begin = 0
    for table in tables:
        places = rank[begin : begin + len(table.times)]
        begin += len(table.times)
        records = _records(table, places, start_usec)
        starts = ends[places] - records.shape[1]
        data[starts[:, np.newaxis] + np.arange(records.shape[1])] = records
    return data.tobytes()


def _record_size(name: str) -> int:
    return STAMP_SIZE + HEADER_V2 + payload_type(message_named(name)).itemsize + CHECKSUM_SIZE


def _records(table: MessageRows, places: NDArray[np.int64], start_usec: int) -> NDArray[np.uint8]:
    """Records of a table, one per row: stamp, header, payload, checksum."""
    known, count = message_named(table.name), len(table.times)
    payload = _payloads(known, table.fields, count)
    records = np.zeros((count, _record_size(table.name)), np.uint8)
    stamps = start_usec + np.rint(table.times * 1e6).astype(np.int64)
    records[:, :STAMP_SIZE] = stamps.astype(">u8").view(np.uint8).reshape(count, STAMP_SIZE)
    frame = records[:, STAMP_SIZE:]
    number = int(known.id)
    frame[:, 0], frame[:, 1], frame[:, 4] = MAGIC_V2, payload.shape[1], places & 0xFF
    frame[:, 5:HEADER_V2] = (table.system, COMPONENT, number & 0xFF, number >> 8 & 0xFF, number >> 16)
    frame[:, HEADER_V2:-CHECKSUM_SIZE] = payload
    crc = np.full(count, 0xFFFF, np.uint16)
    for column in frame[:, 1:-CHECKSUM_SIZE].T:
        crc = accumulate(crc, column)
    crc = accumulate(crc, np.full(count, known.crc_extra, np.uint8))
    frame[:, -CHECKSUM_SIZE:] = crc.astype("<u2").view(np.uint8).reshape(count, CHECKSUM_SIZE)
    return records


def _payloads(known: Message, fields: Mapping[str, NDArray[Any]], count: int) -> NDArray[np.uint8]:
    rows = np.zeros(count, payload_type(known))
    for name, values in fields.items():
        rows[name] = _fitting(values, rows.dtype[name].base)
    return rows.view(np.uint8).reshape(count, rows.dtype.itemsize)


def _fitting(values: NDArray[Any], kind: np.dtype[Any]) -> NDArray[Any]:
    """Values in a field's type: whole numbers are rounded and clipped, what is no number becomes 0 there."""
    if kind.kind in "iu":
        limits = np.iinfo(kind)
        if values.dtype.kind == "f":
            values = np.rint(np.nan_to_num(values, posinf=float(limits.max), neginf=float(limits.min)))
            # The largest 64-bit numbers are no floats: the one below them is.
            top = np.nextafter(float(limits.max), 0.0) if kind.itemsize == 8 else float(limits.max)
            return np.asarray(np.clip(values, float(limits.min), top).astype(kind))
        return np.asarray(np.clip(values, limits.min, limits.max).astype(kind))
    with np.errstate(over="ignore", invalid="ignore"):
        return values.astype(kind)
