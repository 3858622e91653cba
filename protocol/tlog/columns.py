"""Fields of many messages of one type as arrays, each decoded when it is asked for, straight from the log's bytes."""

from collections.abc import ItemsView, Iterator, Mapping, ValuesView
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from protocol.tlog.scan import spans
from protocol.wire.message import Message

__all__ = ["Columns", "payload_type"]

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
