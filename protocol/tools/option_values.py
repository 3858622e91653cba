"""Values of command line options that both programs take, among them ports of this machine."""

from __future__ import annotations

import argparse
import ipaddress
import math
from collections.abc import Hashable

GROUND_SYSTEM = 255  # system id of a ground station
STATION_PORT = 14550
"""Where ground stations listen."""

STATION_URL = f"udpout:127.0.0.1:{STATION_PORT}"
"""A ground station on this machine, as ``--to`` names it."""

OUTWARD_KINDS = ("udpout", "tcp", "serial")
"""Links that reach out, as an address begins."""

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


MAX_PORT, MAX_SYSTEM_ID = 65535, 255


def finite_number(text: str) -> float:
    """A number that is neither infinite nor NaN; raises as ``argparse`` expects, as all of these do."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError(f"{text!r} is not a finite number")
    return value


def nonnegative_number(text: str) -> float:
    """A number from 0."""
    value = finite_number(text)
    if value < 0.0:
        raise argparse.ArgumentTypeError(f"{text} is negative")
    return value


def positive_number(text: str) -> float:
    """A number above 0."""
    value = finite_number(text)
    if value <= 0.0:
        raise argparse.ArgumentTypeError(f"{text} is not above 0")
    return value


def share(text: str) -> float:
    """A number from 0 to 1."""
    value = finite_number(text)
    if not 0.0 <= value <= 1.0:
        raise argparse.ArgumentTypeError(f"{text} is not from 0 to 1")
    return value


def whole_number(text: str) -> int:
    """A whole number."""
    try:
        return int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number") from None


def natural_number(text: str) -> int:
    """A whole number from 0, as a seed is."""
    value = whole_number(text)
    if value < 0:
        raise argparse.ArgumentTypeError(f"{text} is negative")
    return value


def counting_number(text: str) -> int:
    """A whole number above 0."""
    value = whole_number(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text} is not above 0")
    return value


def system_id(text: str) -> int:
    """A MAVLink system id, 1 to 255."""
    value = whole_number(text)
    if not 1 <= value <= MAX_SYSTEM_ID:
        raise argparse.ArgumentTypeError(f"{text} is not a system id, 1 to {MAX_SYSTEM_ID}")
    return value


def port_number(text: str) -> int:
    """A UDP or TCP port; 0: any."""
    value = whole_number(text)
    if not 0 <= value <= MAX_PORT:
        raise argparse.ArgumentTypeError(f"{text} is not a port, 0 to {MAX_PORT}")
    return value


def ipv4_address(text: str) -> str:
    """An IPv4 address in digits."""
    try:
        return str(ipaddress.IPv4Address(text))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not an IPv4 address") from None


def socket_address(text: str) -> tuple[str, int]:
    """An IPv4 address and a port to send to."""
    host, separator, port = text.rpartition(":")
    if not separator:
        raise argparse.ArgumentTypeError(f"{text!r} is not ADDRESS:PORT")
    address = ipv4_address(host), port_number(port)
    if address[1] == 0:
        raise argparse.ArgumentTypeError(f"{text!r}: nothing can be sent to port 0")
    return address
