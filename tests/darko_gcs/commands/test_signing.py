"""``darko-gcs --signing-key``, ``--give-key`` and ``darko-gcs signing``: errors are one line and an exit code."""

from darko_gcs.__main__ import main
from tests.support.vehicle.signed_station import KEY


def test_giving_a_key_needs_a_key(capsys):
    assert main(["connect", "--give-key"]) == 2
    assert capsys.readouterr().err == "darko-gcs: --give-key needs --signing-key: there is no key to give\n"


def test_a_bad_key_is_one_line_and_exit_code_2(tmp_path, capsys):
    (tmp_path / "key").write_text("no key")
    code = main(["connect", "--record", str(tmp_path), "--signing-key", str(tmp_path / "key")])
    error = capsys.readouterr().err
    assert (code, error.count("\n")) == (2, 1)
    assert "signing key" in error


def test_a_bad_new_key_is_refused_without_being_quoted(capsys):
    assert main(["signing", "--signing-key", KEY.hex(), "--new-key", "0" * 64]) == 2
    error = capsys.readouterr().err
    assert "--new-key: signing key: a key of zeros" in error
    assert "0" * 64 not in error
