"""``darko-gcs bridge``: its options, the labs' settings, and what is said of bad ones."""

import pytest

from darko_gcs.__main__ import COMMANDS, main
from darko_gcs.commands.bridge import parser
from darko_gcs.motion_capture.bridge_links import CLOCKS
from darko_gcs.motion_capture.poses import AXES_OF_LABS, ESTIMATORS, HALL_SIDES, MESSAGE_MAKERS, AxesSettings
from darko_gcs.motion_capture.run_bridge import axes_settings

PARSER = parser(COMMANDS)


def test_what_the_source_knows_can_be_chosen():
    choices = {option: set(action.choices or ()) for action in PARSER._actions for option in action.option_strings}
    assert choices["--message"] == set(MESSAGE_MAKERS)
    assert choices["--estimator"] == set(ESTIMATORS)
    assert choices["--clock"] == set(CLOCKS)
    assert choices["--lab"] == set(AXES_OF_LABS)
    assert choices["--nose"] == choices["--long-edge"] == choices["--x-side"] == set(HALL_SIDES)


@pytest.mark.parametrize(
    ("arguments", "settings"),
    [
        ([], AxesSettings("z", "near", 0.0, "far")),
        (["--lab", "delft"], AxesSettings("y", "right", 0.0, "far")),
        (["--lab", "delft", "--x-angle", "-23"], AxesSettings("y", "right", -23.0, "far")),
        (
            ["--up-axis", "y", "--long-edge", "left", "--x-side", "far", "--nose", "near"],
            AxesSettings("y", "left", 90.0, "near"),
        ),
    ],
)
def test_the_axes_are_a_lab_s_but_for_what_is_named(arguments, settings):
    assert axes_settings(PARSER.parse_args(arguments)) == settings


@pytest.mark.parametrize(
    ("option", "value", "reason"),
    [
        ("--server", "motive", "is not an IPv4 address"),
        ("--to", "127.0.0.1", "is not ADDRESS:PORT"),
        ("--to", "127.0.0.1:0", "port 0"),
        ("--rate", "0", "is not above 0"),
        ("--latency", "501", "is not from 0 to 500 ms"),
        ("--x-angle", "inf", "is not a finite number"),
        ("--system", "256", "is not a system id"),
        ("--message", "pose", "invalid choice"),
    ],
)
def test_a_bad_value_is_refused_with_its_option(capsys, option, value, reason):
    with pytest.raises(SystemExit):
        PARSER.parse_args([option, value])
    assert f"argument {option}: " in (error := capsys.readouterr().err)
    assert reason in error


@pytest.mark.parametrize(
    ("arguments", "code", "reason"),
    [
        (["--interface", "203.0.113.1"], 3, "cannot listen on 203.0.113.1:0"),
        (["--signing-key", "/nowhere"], 2, "/nowhere"),
    ],
)
def test_what_cannot_be_used_is_one_line_with_its_exit_code(capsys, arguments, code, reason):
    assert main(["bridge", *arguments]) == code
    assert reason in capsys.readouterr().err.splitlines()[-1]


def test_the_body_is_a_name_or_a_number():
    assert [PARSER.parse_args(["--body", text]).body for text in ("DarkO", "12", "2b")] == ["DarkO", 12, "2b"]
