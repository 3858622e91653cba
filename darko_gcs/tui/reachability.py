"""Whether a command can reach a vehicle now, in the same words on every screen."""

from __future__ import annotations

from darko_gcs.state.snapshot import Snapshot
from darko_gcs.station.station import Station


def why_unreachable(station: Station | None, s: Snapshot) -> str:
    """Reason why nothing can be sent to a vehicle; empty if it can.

    Args:
        station: Of the vehicle; None in a replay.
        s: What is known of it.
    """
    if station is None:
        return "This is a recording: there is no vehicle to command"
    if s.source is None:
        return "No vehicle has been heard yet: nothing was sent"
    return "The vehicle is silent: nothing was sent" if s.lost else ""
