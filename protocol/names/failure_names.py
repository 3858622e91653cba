"""Short names of what MAV_CMD_INJECT_FAILURE can let fail, and how: gyro, motor; off, stuck."""

from protocol.dialect import mavlink

__all__ = ["FAILURE_TYPES", "FAILURE_UNITS"]


def _named(enum: str) -> dict[str, int]:
    """The values of an enumeration by their short names, such as gyro or motor."""
    skipped = (f"{enum}_", "SENSOR_", "SYSTEM_")
    values = {}
    for number, entry in mavlink.enums[enum].items():
        name = str(entry.name)
        for prefix in skipped:
            name = name.removeprefix(prefix)
        if name != "ENUM_END":
            values[name.lower()] = number
    return values


FAILURE_UNITS, FAILURE_TYPES = _named("FAILURE_UNIT"), _named("FAILURE_TYPE")
