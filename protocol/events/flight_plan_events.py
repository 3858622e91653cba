"""Events of flight plans, on both sides."""

from __future__ import annotations

from dataclasses import dataclass

from protocol.events.event import Event
from protocol.wire.message import Peer

__all__ = ["FlightPlanAnswered", "FlightPlanFailed", "FlightPlanReceived", "FlightPlanUploaded"]


@dataclass(frozen=True, slots=True)
class FlightPlanReceived(Event):
    """All entries of the vehicle's flight plan have arrived."""

    plan_id: int
    entries: int


@dataclass(frozen=True, slots=True)
class FlightPlanFailed(Event):
    """The flight plan could not be downloaded."""

    reason: str


@dataclass(frozen=True, slots=True)
class FlightPlanUploaded(Event):
    """A ground station sent the vehicle the file of a flight plan: answer with ``FlightPlanFileServer.answer``."""

    data: bytes
    peer: Peer


@dataclass(frozen=True, slots=True)
class FlightPlanAnswered(Event):
    """The vehicle has loaded the plan that it was sent (empty text), or says why not."""

    text: str
