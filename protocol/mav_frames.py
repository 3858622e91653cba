"""Meanings of the MAV_FRAMEs (https://mavlink.io/en/messages/common.html#MAV_FRAME).

A frame with _INT in its name means the same as the frame without.
"""

from protocol.dialect import mavlink

__all__ = [
    "ABSOLUTE_ALTITUDE_FRAMES",
    "BODY_FRAMES",
    "GLOBAL_FRAMES",
    "OFFSET_FRAMES",
    "RELATIVE_ALTITUDE_FRAMES",
    "is_global_frame",
]

ABSOLUTE_ALTITUDE_FRAMES = frozenset({mavlink.MAV_FRAME_GLOBAL, mavlink.MAV_FRAME_GLOBAL_INT})
"""Latitude, longitude, altitude above mean sea level."""

RELATIVE_ALTITUDE_FRAMES = frozenset({mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT, mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT})
"""Latitude, longitude, altitude above home."""

_TERRAIN_ALTITUDE_FRAMES = frozenset({mavlink.MAV_FRAME_GLOBAL_TERRAIN_ALT, mavlink.MAV_FRAME_GLOBAL_TERRAIN_ALT_INT})

GLOBAL_FRAMES = ABSOLUTE_ALTITUDE_FRAMES | RELATIVE_ALTITUDE_FRAMES | _TERRAIN_ALTITUDE_FRAMES
"""x and y are latitude and longitude."""

BODY_FRAMES = frozenset({mavlink.MAV_FRAME_BODY_NED, mavlink.MAV_FRAME_BODY_OFFSET_NED, mavlink.MAV_FRAME_BODY_FRD})
"""Axes turn with the vehicle."""

OFFSET_FRAMES = frozenset(
    {mavlink.MAV_FRAME_LOCAL_OFFSET_NED, mavlink.MAV_FRAME_BODY_OFFSET_NED, mavlink.MAV_FRAME_BODY_FRD}
)
"""Positions count from where the vehicle is."""


def is_global_frame(frame: int) -> bool:
    """True if x and y in this MAV_FRAME are latitude and longitude."""
    return frame in GLOBAL_FRAMES
