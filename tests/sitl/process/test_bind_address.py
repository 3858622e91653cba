"""The vehicle's port: only this machine reaches it unless an option says otherwise, and then it warns unless signed."""

import socket

import pytest

from sitl.__main__ import main
from sitl.commands.run import parser
from sitl.mavlink.transport import PortError, UdpTransport

KEY, EVERYWHERE = "ab" * 32, "0.0.0.0"  # noqa: S104 - the address the warning is about


def test_without_an_option_it_listens_on_loopback():
    assert parser({}).parse_args([]).bind == "127.0.0.1"


def test_an_open_vehicle_warns_also_with_quiet(tmp_path, capsys):
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


def test_a_port_in_use_is_one_line():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        with pytest.raises(PortError, match="cannot listen on"):
            UdpTransport(taken.getsockname())
