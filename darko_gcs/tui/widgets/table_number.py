"""Numbers of fixed width."""

from __future__ import annotations

import math


def table_number(value: float | None, digits: int, width: int) -> str:
    """A number of fixed width; dashes for None, NaN and infinity.

    Args:
        value: The number.
        digits: After the point.
        width: Cells.
    """
    if value is None or not math.isfinite(value):
        return "--".rjust(width)
    return f"{round(value, digits) + 0.0:{width}.{digits}f}"  # + 0.0 turns -0.0 into 0.0
