"""Fly a vehicle from a program of your own: ``async with connect() as vehicle: await vehicle.arm()``.

The typed, asynchronous API over a station and its link; the tests run docs/scripting.md.
"""

from darko_gcs.errors import FlightError, GroundError, LinkError
from darko_gcs.scripting.vehicle import Vehicle, connect, connect_all
from protocol.names import Mode

__all__ = ["FlightError", "GroundError", "LinkError", "Mode", "Vehicle", "connect", "connect_all"]
