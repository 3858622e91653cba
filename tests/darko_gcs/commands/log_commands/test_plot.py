"""``darko-gcs log plot`` and ``log export`` from the command line."""

import argparse
import csv
import json

import numpy as np
import pytest

from darko_gcs.commands.log_commands import export as log_export
from darko_gcs.commands.log_commands import plot as log_plot
from darko_gcs.errors import GroundError
from protocol.errors import FileError
from protocol.tlog import read_tlog
from tests.support.paths import DATA

FLIGHT = DATA / "square-flight.tlog"


def run(module, *words):
    parser = argparse.ArgumentParser()
    module.configure(parser)
    return module.run(parser.parse_args([str(word) for word in words]))


def test_a_plot_in_the_terminal_names_its_lines(capsys, monkeypatch):
    pytest.importorskip("plotext")
    monkeypatch.setenv("COLUMNS", "70")
    assert run(log_plot, FLIGHT, "--", "-LOCAL_POSITION_NED.z", "DARKO_ACTUATORS.elevon[0]") == 0
    shown = capsys.readouterr().out
    assert "-LOCAL_POSITION_NED.z" in shown
    assert max(map(len, shown.splitlines())) <= 70


@pytest.mark.parametrize("suffix", ["png", "svg"])
def test_a_picture(tmp_path, suffix):
    pytest.importorskip("matplotlib")
    picture = tmp_path / f"height.{suffix}"
    assert run(log_plot, FLIGHT, "LOCAL_POSITION_NED.z", "--out", picture) == 0
    assert picture.read_bytes()[:4] in {b"\x89PNG", b"<?xm"}


def test_a_picture_of_no_known_kind_is_refused(tmp_path):
    with pytest.raises(GroundError, match=r"height\.gif: the name must end in \.png"):
        run(log_plot, FLIGHT, "LOCAL_POSITION_NED.z", "--out", tmp_path / "height.gif")


def test_a_csv_has_its_columns_at_the_times_of_the_first(tmp_path):
    table = tmp_path / "t.csv"
    assert (
        run(log_export, FLIGHT, table, "LOCAL_POSITION_NED.z", "deg(ATTITUDE.yaw)", "--from", "0:10", "--to", "20") == 0
    )
    heading, *rows = csv.reader(table.read_text().splitlines())
    assert heading == ["time", "LOCAL_POSITION_NED.z", "deg(ATTITUDE.yaw)"]
    times = np.array([float(row[0]) for row in rows])
    assert (times[0] >= 10.0, times[-1] <= 20.0, len(rows) > 50) == (True, True, True)


def test_parquet_has_the_same_columns(tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    path = tmp_path / "t.parquet"
    assert run(log_export, FLIGHT, path, "LOCAL_POSITION_NED.z") == 0
    table = parquet.read_table(path)
    assert table.column_names == ["time", "LOCAL_POSITION_NED.z"]
    assert table.num_rows == len(read_tlog(FLIGHT).rows("LOCAL_POSITION_NED"))


def test_kml_has_the_path(tmp_path):
    pytest.importorskip("simplekml")
    path = tmp_path / "t.kml"
    assert run(log_export, FLIGHT, path) == 0
    assert path.read_text().count(",") > 200


def test_mcap_has_every_message_as_json(tmp_path):
    reader = pytest.importorskip("mcap.reader")
    path = tmp_path / "t.mcap"
    assert run(log_export, FLIGHT, path, "STATUSTEXT", "DARKO_HYBRID_STATE") == 0
    with path.open("rb") as file:
        found = [(c.topic, json.loads(m.data)) for _, c, m in reader.make_reader(file).iter_messages()]
    states = [body for topic, body in found if topic == "/1/1/DARKO_HYBRID_STATE"]
    assert len(states) == len(read_tlog(FLIGHT).rows("DARKO_HYBRID_STATE"))
    assert states[0]["v_attitude"] is None
    assert "Armed" in {body["text"] for topic, body in found if topic == "/1/1/STATUSTEXT"}


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("x.txt",), "the name must end in .csv"),
        (("x.csv",), "a table needs the fields"),
        (("x.kml", "ATTITUDE.roll"), "a path has no fields"),
    ],
)
def test_an_export_that_makes_no_sense_is_refused(tmp_path, words, said):
    with pytest.raises(GroundError, match=said):
        run(log_export, FLIGHT, tmp_path / words[0], *words[1:])


def test_a_time_outside_the_flight_has_no_values(tmp_path):
    with pytest.raises(FileError, match="has no value from 900"):
        run(log_export, FLIGHT, tmp_path / "t.csv", "ATTITUDE.roll", "--from", "900")
