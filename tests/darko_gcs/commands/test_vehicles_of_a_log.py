"""A log with several vehicles: the one that is asked for is taken, and which one is said."""

import json

import pytest

from darko_gcs.__main__ import main
from darko_gcs.feed.replay_feed import ReplayFeed
from protocol.dialect import mavlink
from protocol.errors import FileError
from protocol.flight_log.flight_summary import of_vehicle
from protocol.tlog import read_tlog
from tests.support.logs import T0, bare, record


@pytest.fixture
def two(tmp_path, monkeypatch):
    """A log of vehicles 1 and 2, whose roll is a tenth of their number."""
    monkeypatch.chdir(tmp_path)
    records = []
    for k in range(100):
        for system in (1, 2):
            attitude = mavlink.MAVLink_attitude_message(k * 100, system / 10, 0, 0, 0, 0, 0)
            message = attitude if k % 10 else mavlink.MAVLink_heartbeat_message(2, 12, 81, 0, 4, 3)
            records.append(record(T0 + k * 100_000, bare(message, system=system)))
    (tmp_path / "two.tlog").write_bytes(b"".join(records))
    return tmp_path


def last_value(file):
    return float(file.read_text().splitlines()[-1].split(",")[1])


def test_without_a_word_the_first_is_taken_and_the_others_are_named(two, capsys):
    assert main(["log", "export", "two.tlog", "out.csv", "ATTITUDE.roll"]) == 0
    assert last_value(two / "out.csv") == pytest.approx(0.1)
    said = capsys.readouterr().err
    assert said == "two.tlog: vehicle 1/1 is taken; the log also has vehicle 2/1 (--vehicle ID)\n"


def test_the_one_that_is_asked_for_is_taken(two, capsys):
    assert main(["log", "export", "two.tlog", "out.csv", "ATTITUDE.roll", "--vehicle", "2", "--json"]) == 0
    assert last_value(two / "out.csv") == pytest.approx(0.2)
    told = json.loads(capsys.readouterr().out)
    assert (told["ok"], told["rows"], told["columns"]) == (True, 90, ["time", "ATTITUDE.roll"])
    assert told["vehicle"] == {"system": 2, "component": 1}
    assert told["other_vehicles"] == [{"system": 1, "component": 1}]


def test_figures_and_unit_of_what_is_plotted_are_of_this_vehicle(two, capsys):
    assert main(["log", "plot", "two.tlog", "deg(ATTITUDE.roll)", "--vehicle", "2", "--json"]) == 0
    (plotted,) = json.loads(capsys.readouterr().out)["plotted"]
    assert (plotted["unit"], plotted["count"]) == ("deg", 90)
    assert plotted["min"] == plotted["max"] == pytest.approx(11.459, abs=1e-3)


def test_a_summary_of_one_vehicle_counts_its_messages_alone(two, capsys):
    assert main(["log", "info", "two.tlog", "--vehicle", "2", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert [flight["system"] for flight in told["flights"]] == [2]
    assert {message["system"] for message in told["messages"]} == {2}
    assert told["stations"] == []


def test_a_page_is_about_this_vehicle(two, capsys):
    pytest.importorskip("plotly")
    assert main(["log", "report", "two.tlog", "--vehicle", "2", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["file"], told["vehicle"]["system"]) == ("two.html", 2)
    assert "vehicle 2/1" in (two / "two.html").read_text("utf-8")


def test_its_frames_alone_are_played(two, capsys):
    command = ["log", "play", "two.tlog", "--to", "udpout:127.0.0.1:9", "--speed", "1000", "--vehicle", "2", "--json"]
    assert main(command) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["sent"], told["left_out"]["of other vehicles"]) == (100, 100)


def test_an_mcap_has_its_messages_alone(two):
    reader = pytest.importorskip("mcap.reader")
    assert main(["log", "export", "two.tlog", "out.mcap", "--vehicle", "2"]) == 0
    with (two / "out.mcap").open("rb") as file:
        topics = {channel.topic for _, channel, _ in reader.make_reader(file).iter_messages()}
    assert topics == {"/2/1/ATTITUDE", "/2/1/HEARTBEAT"}


@pytest.mark.parametrize(
    "words", [["info"], ["report"], ["plot", "ATTITUDE.roll"], ["export", "x.csv", "ATTITUDE.roll"]]
)
def test_one_that_is_not_there_is_an_error_that_names_those_that_are(two, words, capsys):
    assert main(["log", words[0], "two.tlog", *words[1:], "--vehicle", "3"]) == 2
    assert "no vehicle 3 in this log; it has vehicles 1/1, 2/1" in capsys.readouterr().err


def test_a_replay_shows_the_vehicle_that_is_asked_for(two):
    reader = read_tlog(two / "two.tlog")
    feed = ReplayFeed(of_vehicle(reader, "two", 2), "two")
    feed.seek(feed.timeline.duration)
    assert (feed.snapshot.identity.source, len(feed.reader)) == ((2, 1), 100)
    both = ReplayFeed(reader, "two")
    assert any("vehicles 1/1, 2/1" in line.text for line in both.snapshot.log.lines)
    with pytest.raises(FileError, match="no vehicle 3"):
        of_vehicle(reader, "two", 3)


def test_a_span_of_a_log_with_a_restart_comes_with_how_its_times_go_on(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    boots = [*range(100_000, 150_000, 100), *range(2_000, 302_000, 100)]  # [ms]
    rolls = [mavlink.MAVLink_attitude_message(boot, 0.1, 0, 0, 0, 0, 0) for boot in boots]
    beats = [record(T0, bare(mavlink.MAVLink_heartbeat_message(2, 12, 81, 0, 4, 3)))]
    records = [record(T0 + k * 100_000, bare(message)) for k, message in enumerate(rolls)]
    (tmp_path / "log.tlog").write_bytes(b"".join([*beats, *records]))
    assert main(["log", "export", "log.tlog", "out.csv", "ATTITUDE.roll", "--from", "2:00", "--to", "2:10"]) == 0
    note = "log.tlog: the vehicle restarted: 0:00.0 of its clock since then is 0:48.0 of the log's times"
    assert note in capsys.readouterr().err
    assert main(["log", "export", "log.tlog", "out.csv", "ATTITUDE.roll"]) == 0
    assert "restarted" not in capsys.readouterr().err
