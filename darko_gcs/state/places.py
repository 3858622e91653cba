"""Places that a map can show."""

from __future__ import annotations

__all__ = ["is_fix", "is_on_map"]

MAX_LATITUDE_E7, MAX_LONGITUDE_E7 = 89_0000000, 180_0000000  # [1e-7 deg]


def is_on_map(latitude: int, longitude: int) -> bool:
    """True for a place that a map can show [1e-7 deg]."""
    return abs(latitude) <= MAX_LATITUDE_E7 and abs(longitude) <= MAX_LONGITUDE_E7


def is_fix(latitude: int, longitude: int) -> bool:
    """False for 0, 0, which vehicles tell until they know their place [1e-7 deg]."""
    return latitude != 0 or longitude != 0
