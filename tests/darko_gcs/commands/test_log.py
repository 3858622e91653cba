"""``darko-gcs log`` and its subcommands from the command line."""

import argparse
import csv
import json

import numpy as np
import pytest

from darko_gcs.commands import log
from darko_gcs.commands.log import downloads_as_json, downloads_as_text
from darko_gcs.errors import GroundError
from darko_gcs.state.chart_views import ChartView, ChartViews
from darko_gcs.tasks.log_download import DownloadedLogs
from protocol.dialect import mavlink
from protocol.errors import FileError
from protocol.events import RemoteLog
from protocol.tlog import read_tlog
from tests.support.gcs.sample_logs import hover_log
from tests.support.logs import T0, bare, log_of, record, unknown_frame
from tests.support.paths import DATA

FLIGHT = DATA / "square-flight.tlog"
NOBODY = "udpout:127.0.0.1:9"  # the port discard, which no program has
LOGS = (RemoteLog(0, 1_790_000_000, 100), RemoteLog(1, 0, 200), RemoteLog(2, 0, 0))


def run(command, *words):
    parser = argparse.ArgumentParser()
    getattr(log, f"configure_{command}")(parser)
    return getattr(log, f"run_{command}")(parser.parse_args([str(word) for word in words]))


def test_the_summary_is_printed_as_text_or_json(tmp_path, capsys):
    path = tmp_path / "flight.tlog"
    path.write_bytes(hover_log())
    assert run("info", str(path)) == 0
    assert capsys.readouterr().out.startswith(f"{path}: 17 messages")
    assert run("info", str(path), "--json") == 0
    assert json.loads(capsys.readouterr().out)["records"] == 17


def test_a_file_that_is_no_log_is_an_error(tmp_path):
    path = tmp_path / "notes.txt"
    path.write_text("no log\n")
    with pytest.raises(FileError, match=r"notes\.txt: not a telemetry log: it is a text file"):
        run("info", str(path))


@pytest.mark.long
def test_the_page_has_every_chart_and_needs_no_other_file(tmp_path, capsys):
    pytest.importorskip("plotly")
    page = tmp_path / "flight.html"
    assert run("report", str(FLIGHT), "--out", str(page)) == 0
    assert "34.5 s recorded, 3 jumps" in capsys.readouterr().out
    text = page.read_text()
    for heading in ("Path", "Lyapunov values and jumps", "Actuators", "Energy by law", "Tracking", "Events"):
        assert f"<h2>{heading}" in text
    assert "hover zero-moment to hover linear: V below threshold" in text
    assert "<script src" not in text


def test_a_log_without_a_vehicle_is_an_error_and_writes_nothing(tmp_path):
    pytest.importorskip("plotly")
    empty, page = tmp_path / "empty.tlog", tmp_path / "page.html"
    empty.write_bytes(b"")
    with pytest.raises(FileError, match="the file is empty"):
        run("report", str(empty), "--out", str(page))
    assert not page.exists()


def test_a_page_that_cannot_be_written_is_an_error(tmp_path):
    pytest.importorskip("plotly")
    with pytest.raises(FileError, match="cannot be written"):
        run("report", str(FLIGHT), "--out", str(tmp_path / "nowhere" / "page.html"))


@pytest.fixture
def views(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    views = ChartViews()
    views.save(ChartView("mine", (("LOCAL_POSITION_NED.x", "deg(ATTITUDE.roll)"), ("VFR_HUD.climb", "WIND.speed"))))
    return views


def test_a_view_that_the_screens_keep_is_plotted_without_what_the_log_lacks(views, capsys):
    pytest.importorskip("plotext")
    assert run("plot", FLIGHT, "--view", "mine") == 0
    told = capsys.readouterr()
    for label in ("LOCAL_POSITION_NED.x [m]", "deg(ATTITUDE.roll) [deg]", "VFR_HUD.climb [m/s]"):
        assert label in told.out
    assert told.out.count("time [s]") == 3  # degrees and metres have a plot each
    assert "left out: WIND.speed: the log has no WIND" in told.err


def test_a_view_is_on_the_page_and_an_unknown_one_is_refused(views, tmp_path):
    pytest.importorskip("plotly")
    page = tmp_path / "flight.html"
    assert run("report", FLIGHT, "--out", page, "--view", "mine") == 0
    assert page.read_text().count("<h2>View mine") == 2
    with pytest.raises(FileError, match="no view other: there is mine, attitude"):
        run("report", FLIGHT, "--out", page, "--view", "other")


@pytest.mark.parametrize("words", [(), ("VFR_HUD.alt", "--view", "attitude")])
def test_a_plot_is_of_fields_or_of_a_view(words):
    with pytest.raises(GroundError, match="name the fields to plot, or a --view"):
        run("plot", FLIGHT, *words)


def test_a_plot_in_the_terminal_names_its_lines(capsys, monkeypatch):
    pytest.importorskip("plotext")
    monkeypatch.setenv("COLUMNS", "70")
    assert run("plot", FLIGHT, "--", "-LOCAL_POSITION_NED.z", "DARKO_ACTUATORS.elevon[0]") == 0
    shown = capsys.readouterr().out
    assert "-LOCAL_POSITION_NED.z" in shown
    assert max(map(len, shown.splitlines())) <= 70


@pytest.mark.long
@pytest.mark.parametrize("suffix", ["png", "svg"])
def test_a_picture(tmp_path, suffix):
    pytest.importorskip("matplotlib")
    picture = tmp_path / f"height.{suffix}"
    assert run("plot", FLIGHT, "LOCAL_POSITION_NED.z", "--out", picture) == 0
    assert picture.read_bytes()[:4] in {b"\x89PNG", b"<?xm"}


def test_a_picture_of_no_known_kind_is_refused(tmp_path):
    with pytest.raises(GroundError, match=r"height\.gif: the name must end in \.png"):
        run("plot", FLIGHT, "LOCAL_POSITION_NED.z", "--out", tmp_path / "height.gif")


def test_a_csv_has_its_columns_at_the_times_of_the_first(tmp_path):
    table = tmp_path / "t.csv"
    assert (
        run("export", FLIGHT, table, "LOCAL_POSITION_NED.z", "deg(ATTITUDE.yaw)", "--from", "0:10", "--to", "20") == 0
    )
    heading, *rows = csv.reader(table.read_text().splitlines())
    assert heading == ["time", "LOCAL_POSITION_NED.z", "deg(ATTITUDE.yaw)"]
    times = np.array([float(row[0]) for row in rows])
    assert (times[0] >= 10.0, times[-1] <= 20.0, len(rows) > 50) == (True, True, True)


def test_columns_of_codes_have_no_values_in_between_and_the_help_says_whose_times_the_rows_have(tmp_path, capsys):
    table = tmp_path / "t.csv"
    assert run("export", FLIGHT, table, "ATTITUDE.yaw", "DARKO_HYBRID_STATE.law", "HEARTBEAT.custom_mode") == 0
    _, *rows = csv.reader(table.read_text().splitlines())
    log = read_tlog(FLIGHT)
    for column, (message, field) in ((2, ("DARKO_HYBRID_STATE", "law")), (3, ("HEARTBEAT", "custom_mode"))):
        told = {float(value) for value in log.columns(message)[field]}
        assert {float(row[column]) for row in rows if row[column] != "nan"} <= told
        assert len(told) > 1
    with pytest.raises(SystemExit):
        run("export", "--help")
    assert "at the times of the first field" in " ".join(capsys.readouterr().out.split())


def test_parquet_has_the_same_columns(tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    path = tmp_path / "t.parquet"
    assert run("export", FLIGHT, path, "LOCAL_POSITION_NED.z") == 0
    table = parquet.read_table(path)
    assert table.column_names == ["time", "LOCAL_POSITION_NED.z"]
    assert table.num_rows == len(read_tlog(FLIGHT).rows("LOCAL_POSITION_NED"))


def test_kml_has_the_path(tmp_path):
    pytest.importorskip("simplekml")
    path = tmp_path / "t.kml"
    assert run("export", FLIGHT, path) == 0
    assert path.read_text().count(",") > 200


def test_mcap_has_every_message_as_json(tmp_path):
    reader = pytest.importorskip("mcap.reader")
    path = tmp_path / "t.mcap"
    assert run("export", FLIGHT, path, "STATUSTEXT", "DARKO_HYBRID_STATE") == 0
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
        run("export", FLIGHT, tmp_path / words[0], *words[1:])


def test_a_time_outside_the_flight_has_no_values(tmp_path):
    with pytest.raises(
        FileError, match=r"has no value from 15:00\.0 to the end; the log has some from 0:00\.\d to 0:34\.\d"
    ):
        run("export", FLIGHT, tmp_path / "t.csv", "ATTITUDE.roll", "--from", "900")


def test_a_picture_has_a_scale_with_its_unit_for_each_unit(tmp_path):
    pytest.importorskip("matplotlib")
    picture = tmp_path / "two.svg"
    fields = ("deg(ATTITUDE.roll)", "LOCAL_POSITION_NED.vx", "LOCAL_POSITION_NED.vy", "ATTITUDE.roll * 2")
    assert run("plot", FLIGHT, *fields, "--out", picture) == 0
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
        run("plot", FLIGHT, field)


def test_a_message_that_the_station_sent_is_told_as_its(tmp_path):
    path = tmp_path / "x.tlog"
    sticks = bare(mavlink.MAVLink_manual_control_message(1, 0, 0, 500, 0, 0), system=255, component=190)
    beat = bare(mavlink.MAVLink_heartbeat_message(2, 12, 81, 0, 4, 3))
    path.write_bytes(b"".join(record(T0 + k * 1000, frame) for k, frame in enumerate([beat, sticks, beat])))
    with pytest.raises(FileError, match="the vehicle sent no MANUAL_CONTROL, 255/190 did"):
        run("export", path, tmp_path / "t.csv", "MANUAL_CONTROL.x")


def test_between_messages_of_two_kinds_nothing_is_made_up_where_one_lacked(tmp_path):
    rows = []
    for k in range(600):
        attitude = mavlink.MAVLink_attitude_message(k * 100, k / 600, 0, 0, 0, 0, 0)
        rows.append((k * 100_000, attitude if k else mavlink.MAVLink_heartbeat_message(2, 12, 81, 0, 4, 3)))
        if not 200 < k < 400:
            rows.append((k * 100_000, mavlink.MAVLink_local_position_ned_message(k * 100, k, 0, 0, 0, 0, 0)))
    log, table = tmp_path / "gap.tlog", tmp_path / "t.csv"
    log.write_bytes(b"".join(record(T0 + at, bare(message)) for at, message in rows))
    assert run("export", log, table, "ATTITUDE.roll", "LOCAL_POSITION_NED.x") == 0
    _, *read = csv.reader(table.read_text().splitlines())
    values = {float(time): float(x) for time, _, x in read}
    assert values[10.0] == pytest.approx(100.0)
    assert values[50.0] == pytest.approx(500.0)
    assert np.isnan(values[30.0])


def test_it_says_what_was_sent(tmp_path, capsys):
    path = tmp_path / "flight.tlog"
    path.write_bytes(hover_log())
    assert run("play", path, "--to", NOBODY, "--speed", "1000") == 0
    out = capsys.readouterr().out
    assert "16 frames in 16.0 s; left out: 1 of ground stations" in out
    assert "16 frames sent" in out


def test_a_beginning_behind_the_end_is_an_error():
    with pytest.raises(GroundError, match=r"--at 540: the log ends after 34\.5 s"):
        run("play", DATA / "square-flight.tlog", "--to", NOBODY, "--at", "9:00")


def test_another_machine_is_refused_before_anything_is_sent():
    with pytest.raises(GroundError, match="not this machine"):
        run("play", DATA / "square-flight.tlog", "--to", "udpout:192.0.2.7:14550")


def test_a_log_without_a_vehicle_is_an_error(tmp_path):
    path = tmp_path / "flight.tlog"
    frame = bytearray(unknown_frame(77_000, b"ab"))
    frame[6] = 190  # of a ground station
    path.write_bytes(log_of([bytes(frame)] * 3))
    with pytest.raises(GroundError, match="nothing to send"):
        run("play", path, "--to", NOBODY)


def test_logs_are_listed_with_size_and_date():
    listing = downloads_as_text(DownloadedLogs(LOGS, {}))
    assert listing.splitlines()[0] == "log 0: 100 bytes, 2026-09-21 14:13:20 UTC"
    assert downloads_as_text(DownloadedLogs((), {})) == "the vehicle has no logs"


def test_downloaded_logs_are_printed_with_their_files(tmp_path):
    downloaded = DownloadedLogs(LOGS, {1: tmp_path / "a.tlog"})
    assert downloads_as_text(downloaded) == f"log 1 -> {tmp_path / 'a.tlog'}"
    logs = json.loads(downloads_as_json(downloaded))["logs"]
    assert logs[1] == {"number": 1, "began": None, "bytes": 200, "file": str(tmp_path / "a.tlog")}
    assert logs[0]["file"] is None


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("export f.tlog o.csv --from 1 A.x --to 9 B.y", {"begin": 1.0, "end": 9.0, "fields": ["A.x", "B.y"]}),
        ("export --from 1 f.tlog o.csv A.x", {"begin": 1.0, "fields": ["A.x"]}),
        ("export f.tlog o.csv A.x --from 2", {"begin": 2.0, "fields": ["A.x"]}),
        ("export f.tlog o.csv", {"fields": []}),
        ("plot f.tlog --out p.png A.x --from 1 B.y", {"begin": 1.0, "fields": ["A.x", "B.y"]}),
        ("fetch 1 --json 2", {"json": True, "which": ["1", "2"]}),
        ("fetch --json", {"which": ["last"]}),
    ],
)
def test_options_may_stand_anywhere_among_the_names(words, expected):
    args = vars(log.parser({"log": "logs"}).parse_args(words.split()))
    assert {name: args[name] for name in expected} == expected


def test_what_is_no_option_is_still_refused():
    with pytest.raises(SystemExit):
        log.parser({"log": "logs"}).parse_args(["export", "f.tlog", "o.csv", "A.x", "--form", "1"])
