"""Plan files: QGroundControl's .plan and the older QGC WPL 110, read and written without loss."""

from protocol.plans.files import load, save
from protocol.plans.mission import MissionItem
from protocol.plans.plan import Plan

__all__ = ["MissionItem", "Plan", "load", "save"]
