"""A station on its link for the time of one job."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from darko_gcs.feed.outward_link import link_to
from darko_gcs.feed.udp_link import UdpLink
from darko_gcs.station.station import Station

POLL_PERIOD = 0.01  # [s]
ANSWER_TIMEOUT = 30.0  # for an upload or a command [s]
VEHICLE_TIMEOUT = 30.0  # for the first heartbeat of a vehicle that is already running [s]


@asynccontextmanager
async def open_link(station: Station, host: str, port: int) -> AsyncIterator[UdpLink]:
    """The open link of a station; it is closed at the end.

    Args:
        station: Talks to the vehicle.
        host: Local address to listen on, or an address to connect to (``udpout:``, ``tcp:``, ``serial:``).
        port: Local port to listen on.

    Raises:
        LinkError: If the port is not available, or nothing answers.
    """
    link = link_to(station, host)
    try:
        await link.open(host, port)
        yield link
    finally:
        await link.close()
