"""``darko-gcs fly``: bad options are refused by name."""

import pytest

from darko_gcs.commands import fly


@pytest.mark.parametrize("text", ["nan", "-5", "0", "inf"])
def test_an_impossible_timeout_is_refused_by_name(capsys, text):
    with pytest.raises(SystemExit):
        fly.parser({"fly": ""}).parse_args(["--mission", "x.plan", f"--timeout={text}"])
    assert f"argument --timeout: {text} is not a positive number of seconds" in capsys.readouterr().err
