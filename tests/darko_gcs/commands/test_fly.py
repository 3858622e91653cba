"""``darko-gcs fly``: bad options are refused by name; without ``--headless`` the screens open."""

import pytest

from darko_gcs.__main__ import main
from darko_gcs.commands import fly
from darko_gcs.tui import app
from protocol.dialect.mavlink import MAV_CMD_NAV_TAKEOFF
from tests.support.paths import DATA


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


def test_without_headless_the_screens_open_with_the_mission(monkeypatch, tmp_path):
    opened = []
    monkeypatch.setattr(app, "run_screens", lambda app: opened.append(app) or 0)
    mission = str(DATA / "square.plan")
    arguments = ["--mission", mission, "--port", "0", "--record", str(tmp_path)]
    assert fly.run(fly.parser({"fly": ""}).parse_args(arguments)) == 0
    assert [item.command for item in opened[0].draft.plan.items][:1] == [MAV_CMD_NAV_TAKEOFF]


def test_what_only_screens_can_do_is_refused_without_them(capsys):
    options = ["--overlay", "x.kml", "--on-alert", "true", "--live-3d", "--dialect", "common"]
    assert main(["fly", "--mission", "x.plan", "--headless", *options]) == 2
    assert "--dialect, --on-alert, --live-3d, --overlay: for the screens" in capsys.readouterr().err
