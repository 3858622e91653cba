"""Checksums of many frames at once: CRC-16/MCRF4XX (https://mavlink.io/en/guide/serialization.html#checksum)."""

import numpy as np
from numpy.typing import NDArray

from protocol.tlog.spans import spans

__all__ = ["accumulate", "checksums"]

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
