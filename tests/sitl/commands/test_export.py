"""``darko-sitl export``: writes what can be compiled, and refuses in one line."""

import sys

import pytest

from sitl.__main__ import main
from tests.support.exported import need


@pytest.mark.long
def test_what_is_written_is_checked_by_flights(tmp_path, capsys):
    need("cc")
    assert main(["export", "c", str(tmp_path), "--for", "paparazzi", "--estimator", "sensors"]) == 0
    assert "hybrid controller, airframe darko, double precision, estimator by sensors" in capsys.readouterr().out
    assert (tmp_path / "conf" / "modules" / "ctrl_darko.xml").is_file()
    assert main(["export", "check", str(tmp_path), "--flights", "2", "--seconds", "0.1"]) == 0
    told = capsys.readouterr().out
    assert "2 of 2 flights the same to the bit: 100 periods" in told
    assert "2 of 2 flights navigated the same to the bit: 100 periods" in told


@pytest.mark.long
@pytest.mark.parametrize(
    ("words", "text"),
    [
        (["check", "nowhere"], "nowhere holds no exported controller: darko-sitl export c nowhere"),
        (["c", "nowhere", "--register", "os:path"], "--register os:path is a module, no Register"),
        (["c", "nowhere", "--register", "os"], "--register os is no MODULE:NAME"),
        (["c", "nowhere", "--register", "os:nothing"], "--register os:nothing: module 'os' has no attribute 'nothing'"),
        (["c", "/dev/null/x"], "cannot be written"),
        (["c", "nowhere", "--sensors", "mine.toml"], "--sensors mine.toml: without --estimator no sensor is read"),
    ],
)
def test_what_cannot_be_done_is_one_line(words, text, capsys):
    assert main(["export", *words]) != 0
    assert text in capsys.readouterr().err


def test_a_module_of_a_users_own_that_fails_is_one_line(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.path", list(sys.path))
    (tmp_path / "own_laws_that_fail.py").write_text("x = 1\ny = x / 0\n", encoding="utf-8")
    assert main(["export", "c", "out", "--register", "own_laws_that_fail:REGISTER"]) != 0
    told = capsys.readouterr().err
    assert "--register own_laws_that_fail:REGISTER: ZeroDivisionError: division by zero" in told
    assert "own_laws_that_fail.py, line 2)" in told
    assert not (tmp_path / "out").exists()


@pytest.mark.long
def test_a_file_in_place_of_the_folder_is_refused(tmp_path, capsys):
    (tmp_path / "file").write_text("x", encoding="utf-8")
    assert main(["export", "c", str(tmp_path / "file")]) != 0
    assert "file is a file, no folder" in capsys.readouterr().err


def test_a_controller_that_there_is_none_of_is_refused(capsys):
    with pytest.raises(SystemExit):
        main(["--controller", "lqr"])
    assert "'lqr' is none of hybrid, report, indi, robust-pi and c:DIR" in capsys.readouterr().err
