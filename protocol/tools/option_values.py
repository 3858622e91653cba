"""Values of command line options that both programs take; what cannot be used is refused in words of the option."""

from __future__ import annotations

import argparse
import ipaddress
import math

__all__ = [
    "MAX_PORT",
    "finite_number",
    "ipv4_address",
    "natural_number",
    "nonnegative_number",
    "port_number",
    "positive_number",
    "share",
    "socket_address",
    "system_id",
    "whole_number",
]

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
