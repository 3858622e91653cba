"""``darko-gcs log plot`` and ``log export`` from the command line."""

import argparse
import csv
import json

import numpy as np
import pytest

from darko_gcs.commands.log_commands import export as log_export
from darko_gcs.commands.log_commands import plot as log_plot
from darko_gcs.errors import GroundError
from protocol.dialect import mavlink
from protocol.errors import FileError
from protocol.tlog import read_tlog
from tests.support.logs import T0, bare, record
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


def test_a_picture_has_a_scale_with_its_unit_for_each_unit(tmp_path):
    pytest.importorskip("matplotlib")
    picture = tmp_path / "two.svg"
    fields = ("deg(ATTITUDE.roll)", "LOCAL_POSITION_NED.vx", "LOCAL_POSITION_NED.vy", "ATTITUDE.roll * 2")
    assert run(log_plot, FLIGHT, *fields, "--out", picture) == 0
    drawn = picture.read_text()
    comments = [line for line in drawn.splitlines() if line.strip().startswith("<!--")]
    assert [line.strip() for line in comments if "[" in line or "as expressed" in line] == [
        "<!-- [deg] -->", "<!-- [m/s] -->", "<!-- time [s] -->", "<!-- as expressed -->",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("field", "said"),
    [
        ("ATTITUDE.rol", "ATTITUDE has no field rol; it has time_boot_ms, roll, pitch, yaw"),
        ("ATITUDE.roll", "the dialect has no message ATITUDE; did you mean ATTITUDE"),
        ("RC_CHANNELS.chan1_raw", "the log has no RC_CHANNELS; "),
    ],
)
def test_an_unknown_field_is_answered_with_those_that_there_are(field, said):
    with pytest.raises(FileError, match=said):
        run(log_plot, FLIGHT, field)


def test_between_messages_of_two_kinds_nothing_is_made_up_where_one_lacked(tmp_path):
    rows = []
    for k in range(600):
        attitude = mavlink.MAVLink_attitude_message(k * 100, k / 600, 0, 0, 0, 0, 0)
        rows.append((k * 100_000, attitude if k else mavlink.MAVLink_heartbeat_message(2, 12, 81, 0, 4, 3)))
        if not 200 < k < 400:
            rows.append((k * 100_000, mavlink.MAVLink_local_position_ned_message(k * 100, k, 0, 0, 0, 0, 0)))
    log, table = tmp_path / "gap.tlog", tmp_path / "t.csv"
    log.write_bytes(b"".join(record(T0 + at, bare(message)) for at, message in rows))
    assert run(log_export, log, table, "ATTITUDE.roll", "LOCAL_POSITION_NED.x") == 0
    _, *read = csv.reader(table.read_text().splitlines())
    values = {float(time): float(x) for time, _, x in read}
    assert values[10.0] == pytest.approx(100.0)
    assert values[50.0] == pytest.approx(500.0)
    assert np.isnan(values[30.0])
