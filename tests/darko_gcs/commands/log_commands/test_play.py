"""``darko-gcs log play`` from the command line."""

import argparse

import pytest

from darko_gcs.commands.log_commands import play as log_play
from darko_gcs.errors import GroundError
from tests.support.gcs.sample_logs import hover_log
from tests.support.logs import log_of, unknown_frame
from tests.support.paths import DATA

NOBODY = "udpout:127.0.0.1:9"  # the port discard, which no program has


def run(*words):
    parser = argparse.ArgumentParser()
    log_play.configure(parser)
    return log_play.run(parser.parse_args([str(word) for word in words]))


def test_it_says_what_was_sent(tmp_path, capsys):
    path = tmp_path / "flight.tlog"
    path.write_bytes(hover_log())
    assert run(path, "--to", NOBODY, "--speed", "1000") == 0
    out = capsys.readouterr().out
    assert "16 frames in 16.0 s; left out: 1 of ground stations" in out
    assert "16 frames sent" in out


def test_a_beginning_behind_the_end_is_an_error():
    with pytest.raises(GroundError, match=r"--at 540: the log ends after 3\.4 s"):
        run(DATA / "square-flight.tlog", "--to", NOBODY, "--at", "9:00")


def test_another_machine_is_refused_before_anything_is_sent():
    with pytest.raises(GroundError, match="not this machine"):
        run(DATA / "square-flight.tlog", "--to", "udpout:192.0.2.7:14550")


def test_a_log_without_a_vehicle_is_an_error(tmp_path):
    path = tmp_path / "flight.tlog"
    frame = bytearray(unknown_frame(77_000, b"ab"))
    frame[6] = 190  # of a ground station
    path.write_bytes(log_of([bytes(frame)] * 3))
    with pytest.raises(GroundError, match="nothing to send"):
        run(path, "--to", NOBODY)
