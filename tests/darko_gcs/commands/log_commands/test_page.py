"""``darko-gcs log report`` from the command line."""

import argparse

import pytest

from darko_gcs.commands.log_commands import page as log_page
from protocol.errors import FileError
from tests.support.paths import DATA

pytest.importorskip("plotly")
FLIGHT = DATA / "square-flight.tlog"


def arguments(*words):
    parser = argparse.ArgumentParser()
    log_page.configure(parser)
    return parser.parse_args(words)


def test_the_page_has_every_chart_and_needs_no_other_file(tmp_path, capsys):
    page = tmp_path / "flight.html"
    assert log_page.run(arguments(str(FLIGHT), "--out", str(page))) == 0
    assert "34.4 s of flight, 3 jumps" in capsys.readouterr().out
    text = page.read_text()
    for heading in ("Path", "Lyapunov values and jumps", "Actuators", "Energy by law", "Tracking", "Events"):
        assert f"<h2>{heading}" in text
    assert "hover zero-moment to hover linear (enter linear)" in text
    assert "<script src" not in text


def test_a_log_without_a_vehicle_is_an_error_and_writes_nothing(tmp_path):
    empty, page = tmp_path / "empty.tlog", tmp_path / "page.html"
    empty.write_bytes(b"")
    with pytest.raises(FileError, match="the file is empty"):
        log_page.run(arguments(str(empty), "--out", str(page)))
    assert not page.exists()


def test_a_page_that_cannot_be_written_is_an_error(tmp_path):
    with pytest.raises(FileError, match="cannot be written"):
        log_page.run(arguments(str(FLIGHT), "--out", str(tmp_path / "nowhere" / "page.html")))
