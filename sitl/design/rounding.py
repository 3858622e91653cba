"""Numbers of a design, rounded so that every processor flies the same ones.

A result is kept to a multiple of a power of two, chosen by its largest entry: exact arithmetic, which turns noise
about zero into zero and leaves everything else within ``10**-digits`` of the largest entry.

LAPACK and BLAS choose their loops by processor, so their last bits differ between machines. Two machines that differ by
e, relative to the largest entry, round it to two values where a border lies in between: a chance of ``e 10**digits``
for each number. With nine digits that is 1e-5 for a dozen of well conditioned numbers (e = 1e-15), but 0.1 for the ten
thousand of a gain schedule (e = 1e-14). So what is flown is computed without LAPACK, in the one order of
:mod:`sitl.design.matrices`, and rounding is the second line of defence.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from sitl.model.airframe import Array

DIGITS = 9
# The unit changes where the largest entry passes this share of a power of two: nothing lies there by its nature, as it
# may on the power of two itself. It has few bits, so that what is rounded up to it stays below the change.
BORDER = 91.0 / 128.0


def rounded_matrix(M: npt.ArrayLike, digits: int = DIGITS) -> Array:
    """The array within ``10**-digits`` of its largest entry; infinities and NaN stay as they are.

    Args:
        M: Of any shape.
        digits: Significant decimal digits of the largest entry, 3 to 15.
    """
    values = np.asarray(M, dtype=np.float64)
    finite = np.isfinite(values)
    unit = _unit(float(np.max(np.abs(values), where=finite, initial=0.0)), digits)
    with np.errstate(invalid="ignore"):
        rounded_values = np.rint(values / unit) * unit + 0.0  # no negative zero
    return np.array(np.where(finite, rounded_values, values), order="C")


def rounded(value: float, digits: int = DIGITS) -> float:
    """The number within ``10**-digits`` of itself."""
    return float(rounded_matrix(value, digits))


def _unit(largest: float, digits: int) -> float:
    """The power of two of which the results are multiples."""
    share, exponent = math.frexp(largest)  # largest = share 2**exponent, 0.5 <= share < 1
    if share <= BORDER:
        exponent -= 1
    bits = math.ceil(digits * math.log2(10.0) - math.log2(BORDER))
    return math.ldexp(1.0, max(exponent - bits, -1000))
