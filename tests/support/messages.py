"""Messages as they arrive at a ground station."""

from protocol.codec import Codec
from protocol.dialect import mavlink

VEHICLE, OTHER = Codec(1, 1), Codec(7, 1)


def told(message, codec=VEHICLE):
    """A message as it arrives."""
    return Codec(255, 190).decode(codec.encode(message))[0]


def heartbeat(armed=False, mode=4 << 16 | 3 << 24, state=mavlink.MAV_STATE_ACTIVE):
    base = 1 | (mavlink.MAV_MODE_FLAG_SAFETY_ARMED if armed else 0)
    return mavlink.MAVLink_heartbeat_message(19, mavlink.MAV_AUTOPILOT_PX4, base, mode, state, 3)


def position(ms, x, y=0.0):
    return mavlink.MAVLink_local_position_ned_message(ms, x, y, -3, 0, 0, 0)
