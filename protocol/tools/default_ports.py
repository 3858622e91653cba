"""UDP ports where each side is found unless told otherwise, as other ground stations and PX4's simulator have them."""

from __future__ import annotations

__all__ = ["PROGRAM_PORT", "STATION_PORT", "STATION_URL", "VEHICLE_PORT"]

STATION_PORT = 14550
"""Where ground stations listen."""

STATION_URL = f"udpout:127.0.0.1:{STATION_PORT}"
"""A ground station on this machine, as ``--to`` names it."""

PROGRAM_PORT = 14540
"""Where programs listen that fly the vehicle."""

VEHICLE_PORT = 14580
"""Where the vehicle listens."""
