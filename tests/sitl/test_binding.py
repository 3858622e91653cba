"""Who can reach the vehicle: this machine alone, unless an option says otherwise, and then a warning unless signed."""

import socket

import pytest

from darko_gcs.commands import connect, fly
from darko_gcs.errors import LinkError
from darko_gcs.feed import LiveFeed
from darko_gcs.signing import open_keyring
from darko_gcs.station import Station
from protocol.exposure import exposure
from sitl.__main__ import main
from sitl.commands.run import parser
from sitl.wire.transport import PortError, UdpTransport

KEY, EVERYWHERE = "ab" * 32, "0.0.0.0"  # noqa: S104 - what is warned of


@pytest.mark.parametrize("host", ["127.0.0.1", "127.1.2.3", "::1", "localhost"])
def test_loopback_is_nobody_elses(host):
    assert exposure(host, signed=False) == ""


@pytest.mark.parametrize("host", [EVERYWHERE, "192.0.2.7", "::", "vehicle.example", ""])
def test_any_other_address_is_warned_of_unless_signed(host):
    assert host in exposure(host, signed=False)
    assert "without a signing key" in exposure(host, signed=False)
    assert exposure(host, signed=True) == ""


def test_without_an_option_both_sides_listen_on_loopback():
    assert parser({}).parse_args([]).bind == "127.0.0.1"
    assert connect.parser({}).parse_args([]).host == "127.0.0.1"


def test_an_open_vehicle_warns_even_when_it_is_to_be_quiet(tmp_path, capsys):
    arguments = ["run", "--quiet", "--bind", EVERYWHERE, "--port", "0", "--state-dir", str(tmp_path)]
    assert main([*arguments, "--airframe", "none"]) != 0
    assert "listening on 0.0.0.0 without a signing key" in capsys.readouterr().err
    assert main([*arguments, "--airframe", "none", "--signing-key", KEY]) != 0
    assert "WARNING" not in capsys.readouterr().err


def test_an_address_of_another_machine_is_one_line(tmp_path, capsys):
    assert main(["run", "--bind", "192.0.2.7", "--port", "0", "--state-dir", str(tmp_path)]) != 0
    error = capsys.readouterr().err
    assert "cannot listen on 192.0.2.7:0" in error
    assert error.count("\n") == 1
    with pytest.raises(SystemExit):
        main(["run", "--bind", "somewhere"])
    assert "'somewhere' is not an IPv4 address" in capsys.readouterr().err


def test_a_port_that_is_taken_is_one_line():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        with pytest.raises(PortError, match="cannot listen on"):
            UdpTransport(taken.getsockname())


@pytest.mark.parametrize(
    ("host", "key", "warned"), [(EVERYWHERE, None, 1), (EVERYWHERE, KEY, 0), ("127.0.0.1", None, 0)]
)
async def test_the_ground_station_warns_of_an_open_port(host, key, warned):
    feed = LiveFeed(Station(keyring=open_keyring(key)), host, 0, None)
    await feed.open()
    try:
        texts = [entry.text for entry in feed.snapshot.messages]
    finally:
        await feed.close()
    assert sum("without a signing key" in text for text in texts) == warned


@pytest.mark.parametrize("host", ["a" * 300, "a..b", "\udcff"])
async def test_a_host_that_no_host_can_be_is_one_line(host):
    feed = LiveFeed(Station(), host, 0, None)
    with pytest.raises(LinkError, match=r"cannot listen on .{1,64}:0: "):
        await feed.open()
    await feed.close()


@pytest.mark.parametrize("text", ["nan", "-5", "0", "inf"])
def test_a_time_out_that_is_no_time_is_refused_by_name(capsys, text):
    with pytest.raises(SystemExit):
        fly.parser({"fly": ""}).parse_args(["--mission", "x.plan", f"--timeout={text}"])
    assert f"argument --timeout: {text} is no time to wait for" in capsys.readouterr().err
