"""Values of command parameters that the dialect has no enum for."""

__all__ = ["DEFAULT_SPEED", "FORCE_ARM_DISARM", "NO_CHANGE"]

FORCE_ARM_DISARM = 21196
"""param2 of MAV_CMD_COMPONENT_ARM_DISARM: arm or disarm without the usual checks.

https://mavlink.io/en/messages/common.html#MAV_CMD_COMPONENT_ARM_DISARM
"""

NO_CHANGE, DEFAULT_SPEED = -1.0, -2.0
"""param2 and param3 of MAV_CMD_DO_CHANGE_SPEED: leave speed or throttle as it is, or return to the vehicle's own.

https://mavlink.io/en/messages/common.html#MAV_CMD_DO_CHANGE_SPEED
"""
