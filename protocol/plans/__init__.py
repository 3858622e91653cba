"""Mission items and plan files: QGroundControl's .plan and the older QGC WPL 110, read and written without loss.

A plan is mission items, a fence and rally points; the mission services send the same items over the wire.
"""

from protocol.plans.plan import MissionItem, Plan
from protocol.plans.plan_files import load, save

__all__ = ["MissionItem", "Plan", "load", "save"]
