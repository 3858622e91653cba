"""Places on the globe in the world frame NWU, for whoever knows its origin."""

from __future__ import annotations

from protocol.frames import Geodetic, LocalFrame


def level(lat_deg: float, lon_deg: float, frame: LocalFrame) -> tuple[float, float]:
    """North and west of the origin [m] of a latitude and longitude [deg]."""
    north, east, _ = frame.to_ned(Geodetic(lat_deg, lon_deg, frame.origin.alt))
    return (north, -east)
