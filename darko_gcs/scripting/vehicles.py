"""All vehicles on a link, for programs of your own."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from darko_gcs.scripting.vehicle import Vehicle
from darko_gcs.station.fleet import Fleet
from darko_gcs.station.keyring_setup import open_keyring
from darko_gcs.station.station import Station
from darko_gcs.tasks.link_session import open_link
from protocol.tools.option_values import STATION_PORT

LISTENING_TIME = 2.5  # after the first vehicle: each sends a HEARTBEAT a second [s]


@asynccontextmanager
async def connect_all(
    host: str = "127.0.0.1",
    port: int = STATION_PORT,
    *,
    signing_key: str | None = None,
    timeout: float = 30.0,
) -> AsyncIterator[dict[int, Vehicle]]:
    """The vehicles that are heard on a UDP port within 2.5 s of the first, by ascending system id.

    Args:
        host: Local address to listen on, or an address to connect to (as of ``connect``).
        port: Local UDP port; 0: any.
        signing_key: 64 hexadecimal digits, or a file with them.
        timeout: For the first vehicle to be heard [s].

    Raises:
        LinkError: The port is taken, nothing answers, or no vehicle is heard in time.
    """
    station = Station(keyring=open_keyring(signing_key))
    fleet = Fleet(station)
    async with open_link(station, host, port) as link:
        await Vehicle(link).wait_until(lambda s: s.source is not None, timeout, "a vehicle")
        await asyncio.sleep(LISTENING_TIME)
        vehicles = {system: Vehicle(link, station) for system, station in fleet.stations.items()}
        for vehicle in vehicles.values():
            await vehicle.wait_until(lambda s: s.boot is not None, timeout, "a message with the vehicle's time")
        yield vehicles
