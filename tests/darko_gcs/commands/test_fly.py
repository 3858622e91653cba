"""``darko-gcs fly``: bad options are refused by name."""

import pytest

from darko_gcs.commands import fly


@pytest.mark.parametrize(
    ("text", "reason"),
    [("nan", "not a finite number"), ("-5", "not above 0"), ("0", "not above 0"), ("inf", "not a finite number")],
)
def test_an_impossible_timeout_is_refused_by_name(capsys, text, reason):
    with pytest.raises(SystemExit):
        fly.parser({"fly": ""}).parse_args(["--mission", "x.plan", f"--timeout={text}"])
    told = capsys.readouterr().err
    assert "argument --timeout:" in told
    assert reason in told
