"""Addresses that only programs of this machine can reach, and a warning for a port that is open to others."""

from __future__ import annotations

import ipaddress
from collections.abc import Hashable

__all__ = ["is_loopback", "open_port_warning"]


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
