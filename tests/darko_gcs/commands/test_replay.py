"""``darko-gcs replay`` from the command line: what is refused before a screen opens."""

import pytest

from darko_gcs.__main__ import main
from darko_gcs.tui import app as app_module
from tests.support.paths import DATA

LOG = str(DATA / "square-flight.tlog")


@pytest.mark.parametrize("words", [["--offset", "3"], ["--align", "start"]])
def test_an_alignment_of_one_log_is_an_error(words, capsys):
    assert main(["replay", LOG, *words]) == 2
    assert "need a second log" in capsys.readouterr().err


@pytest.mark.parametrize("words", [["--offset", "x"], ["--offset", "inf"], ["--align", "north"], ["--speed", "0"]])
def test_what_makes_no_sense_is_refused_in_words(words, capsys):
    with pytest.raises(SystemExit):
        main(["replay", LOG, LOG, *words])
    assert words[0] in capsys.readouterr().err


def test_a_second_log_that_is_none_is_an_error(tmp_path, capsys):
    path = tmp_path / "notes.tlog"
    path.write_text("no log\n")
    assert main(["replay", LOG, str(path)]) == 2
    assert "not a telemetry log" in capsys.readouterr().err


def test_an_address_to_send_to_is_checked_before_a_screen_opens(capsys):
    assert main(["replay", LOG, "--to", "tcp:127.0.0.1:14550"]) == 3
    assert "udpout:HOST:PORT" in capsys.readouterr().err
    assert main(["replay", LOG, "--to", "udpout:192.0.2.1:14550"]) == 2
    assert "--network" in capsys.readouterr().err
    assert main(["replay", LOG, LOG, "--to", "udpout:127.0.0.1:14550"]) == 2
    assert "one log only" in capsys.readouterr().err


def test_an_overlay_is_taken_for_one_flight_and_for_two(tmp_path, monkeypatch):
    opened = []
    monkeypatch.setattr(app_module, "run_screens", lambda app: opened.append(app) or 0)
    path = tmp_path / "field.geojson"
    path.write_text('{"type": "Point", "coordinates": [1.48, 43.56]}')
    for files in ([LOG], [LOG, LOG]):
        assert main(["replay", *files, "--overlay", str(path)]) == 0
        assert [len(shape.points) for shape in opened[-1].overlay] == [1]
