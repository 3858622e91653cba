"""``darko-sitl mocap``: its options, and what is said of bad ones."""

from contextlib import ExitStack

import pytest

from darko_gcs.motion_capture.poses import HALL_SIDES
from protocol.natnet import BIT_STREAMS
from sitl.__main__ import COMMANDS, main
from sitl.commands.mocap import SIDE_NAMES, parser
from sitl.motion_capture.cameras import SIDES
from sitl.motion_capture.motive_process import build_motive, sensors_of
from sitl.sensors.sensor_files import load_sensors

PARSER = parser(COMMANDS)
FREE_PORT = ["--command-port", "0"]


def test_every_bit_stream_and_every_side_can_be_chosen():
    choices = {option: action.choices for action in PARSER._actions for option in action.option_strings}
    assert choices["--natnet"] == tuple(f"{major}.{minor}" for major, minor in BIT_STREAMS)
    assert set(SIDE_NAMES) == set(SIDES) == set(HALL_SIDES)


def test_without_options_the_cameras_are_the_vehicle_s_own():
    assert sensors_of(PARSER.parse_args([])) == load_sensors()


def test_options_change_the_specification_of_the_file(tmp_path):
    file = tmp_path / "slow.toml"
    file.write_text('[motion_capture.rate]\nvalue = 120.0\nunit = "Hz"\nsource = "measured"\n')
    given = ["--sensors", str(file), "--delay", "0.03", "--jitter", "0.002", "--dropout", "0.1", "--noise", "0.002"]
    spec = sensors_of(PARSER.parse_args(given)).motion_capture
    assert (spec.timing, spec.noise) == ((120.0, 0.03, 0.002, 0.1), 0.002)


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["--rate", "5"], "--rate 5 Hz is not from 10 to 250 Hz"),
        (["--event", "gone@3"], "'gone@3' is not KIND@START+SECONDS"),
        (["--sensors", "/nowhere.toml"], "/nowhere.toml: No such file"),
        (["--body", "/nowhere.toml"], "/nowhere.toml: No such file"),
        (["--signing-key", "xyz"], "xyz"),
        (["--bind", "203.0.113.1"], "cannot listen on 203.0.113.1"),
    ],
)
def test_what_cannot_be_used_is_one_line(capsys, arguments, reason):
    assert main(["mocap", *FREE_PORT, *arguments]) == 2
    error = capsys.readouterr().err
    assert reason in error
    assert error.count("\n") == 1


@pytest.mark.parametrize(
    ("option", "value", "reason"),
    [
        ("--multicast", "10.0.0.1", "is not a multicast address"),
        ("--bind", "here", "is not an IPv4 address"),
        ("--vehicle", "14580", "is not ADDRESS:PORT"),
        ("--dropout", "2", "is not from 0 to 1"),
        ("--x-angle", "nan", "is not a finite number"),
        ("--command-port", "70000", "is not a port"),
        ("--system", "0", "is not a system id"),
        ("--seed", "-1", "is negative"),
    ],
)
def test_a_bad_value_is_refused_with_its_option(capsys, option, value, reason):
    with pytest.raises(SystemExit):
        PARSER.parse_args([option, value])
    assert f"argument {option}: " in (error := capsys.readouterr().err)
    assert reason in error


@pytest.fixture
def motive(request):
    said = []
    with ExitStack() as stack:
        yield build_motive(PARSER.parse_args([*FREE_PORT, *getattr(request, "param", [])]), said.append, stack), said


def test_it_says_who_it_is_what_it_streams_and_whom_it_waits_for(motive):
    running, said = motive
    running.step(100.0)
    assert said[0].startswith("Motive 2.1, NatNet 3.1, at 127.0.0.1:")
    assert said[0].endswith("rigid body DarkO (1), 200 Hz to 239.255.42.99:1511, z up")
    assert said[1:] == ["waiting for the vehicle at 127.0.0.1:14580"]


@pytest.mark.parametrize("motive", [["--bind", "0.0.0.0", "--unicast"]], indirect=True)  # noqa: S104
def test_a_port_that_others_reach_is_warned_of(motive):
    assert "WARNING: listening on 0.0.0.0" in motive[1][1]


def test_a_line_that_is_typed_is_obeyed_and_answered(motive, tmp_path):
    running, said = motive
    typed = tmp_path / "typed"
    typed.write_text("swap 2\n")
    with typed.open() as file:
        running._stdin = file.fileno()
        running._take_line()
        assert said[-1] == "swap for 2 s"
        running._take_line()
    assert running._stdin is None
