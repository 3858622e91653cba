"""Events of flight plans, on the ground."""

from __future__ import annotations

from dataclasses import dataclass

from protocol.events.event import Event

__all__ = ["FlightPlanFailed", "FlightPlanReceived"]


@dataclass(frozen=True, slots=True)
class FlightPlanReceived(Event):
    """All entries of the vehicle's flight plan have arrived."""

    plan_id: int
    entries: int


@dataclass(frozen=True, slots=True)
class FlightPlanFailed(Event):
    """The flight plan could not be downloaded."""

    reason: str
