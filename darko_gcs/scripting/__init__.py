"""Fly a vehicle from a program of your own: ``async with connect() as vehicle: await vehicle.arm()``.

Belongs here: the typed, asynchronous API over a station and its link; the tests run docs/scripting.md.
May import: every other room of the ground station but the screens, and ``protocol``.
"""

from darko_gcs.errors import FlightError, GroundError, LinkError
from darko_gcs.scripting.vehicle import Vehicle, connect
from darko_gcs.scripting.vehicles import connect_all
from protocol.names import Mode

__all__ = ["FlightError", "GroundError", "LinkError", "Mode", "Vehicle", "connect", "connect_all"]
