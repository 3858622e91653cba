"""``darko-sitl export``: writes what can be compiled, and refuses in one line."""

import pytest

from sitl.__main__ import main
from tests.support.exported import need


@pytest.mark.long
def test_what_is_written_is_checked_by_flights(tmp_path, capsys):
    need("cc")
    assert main(["export", "c", str(tmp_path), "--for", "paparazzi", "--estimator", "sensors"]) == 0
    assert "airframe darko, double precision, estimator by sensors" in capsys.readouterr().out
    assert (tmp_path / "conf" / "modules" / "ctrl_darko.xml").is_file()
    assert main(["export", "check", str(tmp_path), "--flights", "2", "--seconds", "0.1"]) == 0
    told = capsys.readouterr().out
    assert "2 of 2 flights the same to the bit: 100 periods" in told
    assert "2 of 2 flights navigated the same to the bit: 100 periods" in told


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (["check", "nowhere"], "nowhere holds no exported controller: darko-sitl export c nowhere"),
        (["c", "nowhere", "--register", "os:path"], "--register os:path is a module, no Register"),
        (["c", "/dev/null/x"], "cannot be written"),
        (["c", "nowhere", "--sensors", "mine.toml"], "--sensors mine.toml: without --estimator no sensor is read"),
    ],
)
def test_what_cannot_be_done_is_one_line(words, text, capsys):
    assert main(["export", *words]) != 0
    assert text in capsys.readouterr().err


def test_a_controller_that_there_is_none_of_is_refused(capsys):
    with pytest.raises(SystemExit):
        main(["--controller", "lqr"])
    assert "'lqr' is none of hybrid, report, indi, robust-pi and c:DIR" in capsys.readouterr().err
