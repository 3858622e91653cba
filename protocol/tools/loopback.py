"""Ports of this machine: the usual ones, and a free one."""

from __future__ import annotations

import ipaddress
from collections.abc import Hashable

__all__ = [
    "PROGRAM_PORT",
    "STATION_PORT",
    "STATION_URL",
    "VEHICLE_PORT",
    "is_loopback",
    "open_port_warning",
]

STATION_PORT = 14550
"""Where ground stations listen."""

STATION_URL = f"udpout:127.0.0.1:{STATION_PORT}"
"""A ground station on this machine, as ``--to`` names it."""

PROGRAM_PORT = 14540
"""Where programs listen that fly the vehicle."""

VEHICLE_PORT = 14580
"""Where the vehicle listens."""


def is_loopback(address: Hashable) -> bool:
    """True if only programs of this machine can have the address.

    Args:
        address: A host ("127.0.0.1", "::1", "localhost") or a socket address (host, port). Another name than
            "localhost" and anything else that is not an IP address are not loopback.
    """
    host = address[0] if isinstance(address, tuple) and address else address
    if not isinstance(host, str):
        return False
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def open_port_warning(host: str, *, signed: bool) -> str:
    """A warning if programs on other machines can send unsigned commands to this port; else "".

    Args:
        host: The local address of the port.
        signed: True if a signing key is set, so that unsigned commands are refused.
    """
    if signed or is_loopback(host):
        return ""
    return f"WARNING: listening on {host} without a signing key: anyone who reaches this port can send commands"
