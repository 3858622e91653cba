"""Arguments of --sitl are read by darko-sitl before a screen opens; sessions keep to themselves."""

import pytest

from darko_gcs.__main__ import main
from darko_gcs.commands import connect
from darko_gcs.commands.options import listening_port
from darko_gcs.errors import GroundError
from darko_gcs.feed.sitl_process import check_arguments


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--wind", "x"], "argument --wind: 'x' is not a finite number"),
        (["--wind", "5@"], "argument --wind: '5@' has no direction"),
        (["--seed", "a"], "argument --seed: 'a' is not a whole number"),
    ],
)
def test_bad_arguments_are_told_in_the_simulators_words(arguments, words):
    with pytest.raises(GroundError) as caught:
        check_arguments(arguments)
    assert words in str(caught.value)
    assert "_" not in str(caught.value)


@pytest.mark.long
def test_an_unknown_airframe_is_told_with_those_there_are():
    with pytest.raises(GroundError, match=r"no parameter set 'foo': there are .*nominal"):
        check_arguments(["--airframe", "foo"], "foo")


def test_the_ground_station_ends_with_the_exit_code_of_an_argument_before_its_screen_opens(capsys):
    assert main(["--sitl", "--wind", "x"]) == 2
    assert "darko-gcs: " in capsys.readouterr().err


def test_a_session_with_its_own_simulator_listens_where_nobody_else_sends():
    def port(*arguments):
        return listening_port(connect.parser({}).parse_args(arguments))

    assert (port(), port("--sitl"), port("--sitl", "--port", "14550"), port("--port", "0")) == (14550, 0, 14550, 0)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--dialect", "ardupilot"], "--dialect: pymavlink has no dialect ardupilot; it has"),
        (["--on-alert", "no-such-program -x"], "there is no program no-such-program"),
        (["--on-alert", "'open"], "--on-alert 'open: No closing quotation"),
        (["--on-alert", ""], "there is no program"),
    ],
)
def test_a_dialect_or_a_command_that_is_not_there_is_refused_before_a_screen_opens(arguments, words, capsys):
    assert main(arguments) == 2
    assert words in capsys.readouterr().err


@pytest.mark.parametrize("option", ["--port", "--vehicle"])
def test_numbers_are_refused_without_internal_names(option, capsys):
    with pytest.raises(SystemExit):
        connect.parser({}).parse_args([option, "abc"])
    assert "'abc' is not a whole number" in capsys.readouterr().err
