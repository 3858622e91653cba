"""The time in front of each frame of a telemetry log: eight bytes, microseconds since 1970, big-endian."""

__all__ = ["STAMP_SIZE", "TIME_LIMIT"]

STAMP_SIZE = 8  # [bytes]
TIME_LIMIT = 1 << 53  # [us] first time that is refused: up to it, a float64 holds every time exactly
