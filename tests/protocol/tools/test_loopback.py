"""Loopback addresses, and the warning about a port that others can reach."""

import pytest

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
