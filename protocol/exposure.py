"""Who can reach a listening address, in words for the one who chose it."""

import ipaddress

__all__ = ["exposure"]


def exposure(host: str, *, signed: bool) -> str:
    """A warning if programs of other machines may give orders here unsigned; else nothing.

    Args:
        host: The local address that is listened on; a name other than localhost counts as reachable.
        signed: Whether a signing key is set, so that unsigned orders are refused.
    """
    if signed or _is_loopback(host):
        return ""
    return f"WARNING: listening on {host} without a signing key: whoever reaches this port gives orders"


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"
