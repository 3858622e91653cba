"""Interface between a group of requests and the station that it belongs to."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from darko_gcs.state.snapshot import Snapshot
from protocol.dialect import mavlink
from protocol.endpoints.endpoint_ground import GroundEndpoint
from protocol.names.modes import Mode

__all__ = ["RequestContext"]


class RequestContext(Protocol):
    """The station, as its groups of requests see it.

    Attributes:
        snapshot: What is known of the vehicle.
        endpoint: Sends requests.
    """

    snapshot: Snapshot
    endpoint: GroundEndpoint

    def attempt(self, now: float, request: Callable[[], object]) -> None:
        """Send a request, and log why if it cannot be sent; ``now`` in seconds."""

    def add_line(self, now: float, text: str, severity: int = mavlink.MAV_SEVERITY_WARNING) -> None:
        """Add a line to the operator's message log."""

    def set_mode(self, mode: Mode, now: float) -> None:
        """Change the flight mode."""
