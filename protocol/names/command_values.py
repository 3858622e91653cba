"""Values of command parameters that the dialect has no enum for."""

__all__ = ["FORCE_ARM_DISARM"]

FORCE_ARM_DISARM = 21196
"""param2 of MAV_CMD_COMPONENT_ARM_DISARM: arm or disarm without the usual checks.

https://mavlink.io/en/messages/common.html#MAV_CMD_COMPONENT_ARM_DISARM
"""
