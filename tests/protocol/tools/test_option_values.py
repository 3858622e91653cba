"""Values of command line options that both programs take, among them ports of this machine."""

import argparse

import pytest

from protocol.tools import option_values
from protocol.tools.option_values import is_loopback, open_port_warning

EVERYWHERE = "0.0.0.0"  # noqa: S104 - the address the warning is about


@pytest.mark.parametrize("host", ["127.0.0.1", "127.1.2.3", "::1", "localhost"])
def test_only_this_machine_reaches_a_loopback_address(host):
    assert is_loopback(host)
    assert is_loopback((host, 14550))
    assert open_port_warning(host, signed=False) == ""


@pytest.mark.parametrize("peer", ["ground", None, ("192.0.2.7", 14550), (), 7, "127.0.0.1.example"])
def test_any_other_address_is_not_loopback(peer):
    assert not is_loopback(peer)


@pytest.mark.parametrize("host", [EVERYWHERE, "192.0.2.7", "::", "vehicle.example", ""])
def test_a_port_that_others_can_reach_is_warned_about_unless_signed(host):
    assert host in open_port_warning(host, signed=False)
    assert "without a signing key" in open_port_warning(host, signed=False)
    assert open_port_warning(host, signed=True) == ""


@pytest.mark.parametrize(
    ("value", "text", "taken"),
    [
        ("finite_number", "-1e3", -1000.0),
        ("nonnegative_number", "0", 0.0),
        ("positive_number", "0.5", 0.5),
        ("share", "0", 0.0),
        ("share", "1", 1.0),
        ("natural_number", "0", 0),
        ("counting_number", "1", 1),
        ("system_id", "1", 1),
        ("system_id", "255", 255),
        ("port_number", "0", 0),
        ("port_number", "65535", 65535),
        ("ipv4_address", "10.0.0.1", "10.0.0.1"),
        ("socket_address", "127.0.0.1:14580", ("127.0.0.1", 14580)),
    ],
)
def test_what_can_be_used_is_taken(value, text, taken):
    assert getattr(option_values, value)(text) == taken


@pytest.mark.parametrize(
    ("value", "text", "reason"),
    [
        ("finite_number", "fast", "'fast' is not a finite number"),
        ("finite_number", "nan", "'nan' is not a finite number"),
        ("nonnegative_number", "-0.1", "-0.1 is negative"),
        ("positive_number", "0", "0 is not above 0"),
        ("share", "1.5", "1.5 is not from 0 to 1"),
        ("share", "-0.1", "-0.1 is not from 0 to 1"),
        ("whole_number", "2.5", "'2.5' is not a whole number"),
        ("natural_number", "-1", "-1 is negative"),
        ("counting_number", "0", "0 is not above 0"),
        ("system_id", "0", "0 is not a system id, 1 to 255"),
        ("system_id", "256", "256 is not a system id, 1 to 255"),
        ("port_number", "65536", "65536 is not a port, 0 to 65535"),
        ("port_number", "http", "'http' is not a whole number"),
        ("ipv4_address", "localhost", "'localhost' is not an IPv4 address"),
        ("socket_address", "127.0.0.1", "'127.0.0.1' is not ADDRESS:PORT"),
        ("socket_address", "127.0.0.1:0", "'127.0.0.1:0': nothing can be sent to port 0"),
    ],
)
def test_the_rest_is_refused_with_its_reason(value, text, reason):
    with pytest.raises(argparse.ArgumentTypeError, match=f"^{reason}$"):
        getattr(option_values, value)(text)
