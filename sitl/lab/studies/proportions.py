"""Shares of flights with their confidence interval: no count stands without it.

The interval is that of Clopper and Pearson (Biometrika 26, 1934), which covers the true share in at least 95 % of
studies, however few the flights are and however near to none or all of them the count is.
"""

from __future__ import annotations

from typing import NamedTuple

from scipy.special import betaincinv

from sitl import SitlError

CONFIDENCE = 0.95  # two-sided


class ShareBounds(NamedTuple):
    """Ends of an interval of a share, 0..1."""

    low: float
    high: float


def share_bounds(count: int, of: int) -> ShareBounds:
    """The interval of the share that ``count`` in ``of`` independent flights tell of.

    Raises:
        SitlError: There is no flight, or more are counted than flown.
    """
    if not 0 <= count <= of or of < 1:
        raise SitlError(f"{count} of {of} is no share")
    tail = 0.5 * (1.0 - CONFIDENCE)
    low = float(betaincinv(count, of - count + 1, tail)) if count else 0.0
    high = float(betaincinv(count + 1, of - count, 1.0 - tail)) if count < of else 1.0
    return ShareBounds(low, high)


def percent_bounds(count: int, of: int) -> str:
    """The interval in words, such as ``93.9 to 100 %``."""
    low, high = share_bounds(count, of)
    return f"{_percent(low)} to {_percent(high)} %"


def counted(count: int, of: int) -> str:
    """A count with its interval, such as ``59 of 60 (91.1 to 100 %)``."""
    return f"{count} of {of} ({percent_bounds(count, of)})"


def _percent(share: float) -> str:
    """One decimal, but none at the ends, which are exact."""
    return f"{100.0 * share:.0f}" if share in {0.0, 1.0} else f"{100.0 * share:.1f}"
