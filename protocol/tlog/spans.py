"""Many short spans of a log's bytes at once."""

import numpy as np
from numpy.typing import NDArray

__all__ = ["spans"]


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
