"""``darko-gcs log info`` from the command line."""

import argparse
import json

import pytest

from darko_gcs.commands.log_commands import info as log_info
from protocol.errors import FileError
from tests.support.gcs.sample_logs import hover_log


def arguments(*words):
    parser = argparse.ArgumentParser()
    log_info.configure(parser)
    return parser.parse_args(words)


def test_the_summary_is_printed_as_text_or_json(tmp_path, capsys):
    path = tmp_path / "flight.tlog"
    path.write_bytes(hover_log())
    assert log_info.run(arguments(str(path))) == 0
    assert capsys.readouterr().out.startswith(f"{path}: 17 messages")
    assert log_info.run(arguments(str(path), "--json")) == 0
    assert json.loads(capsys.readouterr().out)["records"] == 17


def test_a_file_that_is_no_log_is_an_error(tmp_path):
    path = tmp_path / "notes.txt"
    path.write_text("no log\n")
    with pytest.raises(FileError, match=r"notes\.txt: not a telemetry log: it is a text file"):
        log_info.run(arguments(str(path)))
