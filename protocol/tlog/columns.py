"""Fields of many messages of one type as arrays.

Payloads become the rows of one array, with the zeros that MAVLink 2 trims; one structured type then reads them all.
"""

from functools import cache

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from protocol.message import Message

__all__ = ["payload_type", "payloads"]

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


def payloads(
    data: NDArray[np.uint8], offsets: NDArray[np.int64], lengths: NDArray[np.int64], kind: np.dtype[np.void]
) -> NDArray[np.void]:
    """Structured array of n payloads; shorter ones are padded with zeros, longer ones truncated.

    Args:
        data: Bytes of the log.
        offsets: Starts of the payloads, shape (n,).
        lengths: Their lengths on the wire, shape (n,).
        kind: Type of one payload.
    """
    rows = np.zeros((len(offsets), kind.itemsize), dtype=np.uint8)
    lengths = np.minimum(lengths, kind.itemsize)
    for length in np.unique(lengths[lengths > 0]).tolist():
        chosen = np.flatnonzero(lengths == length)
        rows[chosen, :length] = sliding_window_view(data, length)[offsets[chosen]]
    return rows.view(kind)[:, 0]
