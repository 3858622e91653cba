"""Checksums of many frames at once: CRC-16/MCRF4XX (https://mavlink.io/en/guide/serialization.html#checksum)."""

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

__all__ = ["accumulate", "checksums"]

_BLOCK = 16384  # frames per pass: its two columns stay in the cache


def _table() -> NDArray[np.uint16]:
    low = [(byte ^ byte << 4) & 0xFF for byte in range(256)]
    return np.array([(byte << 8) ^ (byte << 3) ^ (byte >> 4) for byte in low], dtype=np.uint16)


_TABLE = _table()


def _pair_table() -> NDArray[np.uint16]:
    """After two bytes from each possible remainder and pair, which stand in it added without carry."""
    mixed = np.arange(1 << 16, dtype=np.uint16)
    return accumulate(accumulate(mixed, np.zeros(1, np.uint8)), np.zeros(1, np.uint8))


def accumulate(crc: NDArray[np.uint16], byte: NDArray[np.uint8]) -> NDArray[np.uint16]:
    """Checksums after one more byte each; both arrays have shape (n,)."""
    after: NDArray[np.uint16] = (crc >> 8) ^ _TABLE[crc.astype(np.uint8) ^ byte]
    return after


_PAIRS = _pair_table()


def checksums(data: NDArray[np.uint8], offsets: NDArray[np.int64], lengths: NDArray[np.int64]) -> NDArray[np.uint16]:
    """Checksum of each ``data[offset : offset + length]``, before the message's CRC_EXTRA.

    Spans of equal length become the columns of one array, which is processed two bytes at a time for all together.

    Args:
        data: Bytes, shape (m,).
        offsets: Starts of the spans, shape (n,).
        lengths: Lengths of the spans, >= 1, shape (n,); every span lies inside ``data``.
    """
    crcs = np.empty(len(offsets), dtype=np.uint16)
    order = np.argsort(lengths, kind="stable")
    cuts = np.flatnonzero(np.diff(lengths[order])) + 1
    for group in np.split(order, cuts) if len(order) else []:
        spans = sliding_window_view(data, int(lengths[group[0]]))
        for at in range(0, len(group), _BLOCK):
            block = group[at : at + _BLOCK]
            crcs[block] = _checksums_of_rows(spans[offsets[block]])
    return crcs


def _checksums_of_rows(rows: NDArray[np.uint8]) -> NDArray[np.uint16]:
    """Checksum of each row."""
    crc = np.full(len(rows), 0xFFFF, dtype=np.uint16)
    even = rows.shape[1] & ~1
    for pair in np.ascontiguousarray(rows[:, :even]).view("<u2").T.copy():
        crc = _PAIRS.take(crc ^ pair)
    return accumulate(crc, rows[:, -1]) if even < rows.shape[1] else crc
