"""The commands about logs on those of PX4, ArduPilot and Paparazzi."""

import argparse
import csv
import json

import numpy as np
import pytest

from darko_gcs.commands import log
from darko_gcs.feed.replay_feed import ReplayFeed
from protocol.foreign_logs import read_log
from protocol.frames import flying_attitude
from tests.support import foreign_logs as logs


def run(command, *words):
    parser = argparse.ArgumentParser()
    getattr(log, f"configure_{command}")(parser)
    return getattr(log, f"run_{command}")(parser.parse_args([str(word) for word in words]))


@pytest.fixture(params=["PX4 ULog", "ArduPilot DataFlash log", "Paparazzi log"])
def kind(request):
    return request.param


@pytest.fixture
def path(kind, tmp_path):
    if kind == "Paparazzi log":
        return logs.write_pair(tmp_path)
    path = tmp_path / "flight.log"
    path.write_bytes(logs.ulog() if kind == "PX4 ULog" else logs.dataflash())
    return path


def test_info_says_what_it_is(path, kind, capsys):
    assert run("info", path) == 0
    told = capsys.readouterr()
    assert f"{kind}, told as MAVLink messages" in told.out
    assert ("no damage" in told.out, told.err) == (True, "")
    assert run("info", path, "--json") == 0
    assert json.loads(capsys.readouterr().out)["format"] == kind


@pytest.mark.long(after=1)
def test_a_page_and_a_table_are_made(path, tmp_path):
    pytest.importorskip("plotly")
    assert run("report", path, "--out", tmp_path / "page.html") == 0
    assert "<h2>Path" in (tmp_path / "page.html").read_text()
    table = tmp_path / "t.csv"
    assert run("export", path, table, "LOCAL_POSITION_NED.z", "deg(ATTITUDE.roll)") == 0
    heading, *rows = csv.reader(table.read_text().splitlines())
    values = np.array(rows, float)
    assert heading[1:] == ["LOCAL_POSITION_NED.z", "deg(ATTITUDE.roll)"]
    assert values[5] == pytest.approx((values[5, 0], -30.0, np.degrees(logs.ROLL)), abs=0.02)
    assert values[0, 0] == pytest.approx(0.0, abs=0.01)  # since the log began, not since boot


def test_replay_shows_the_flight(path, kind):
    feed = ReplayFeed(read_log(path), path.name)
    feed.seek(2.0)
    vehicle = feed.snapshot
    assert vehicle.status.armed
    assert vehicle.position.p == pytest.approx(logs.place(2.0)[0], abs=0.5)
    attitude = logs.quaternion(logs.ROLL, logs.PITCH, logs.yaw(2.0))
    if kind == "PX4 ULog":  # of a tail-sitter: its nose is told as it points in the hover frame
        attitude = flying_attitude(attitude)
    assert vehicle.attitude.q == pytest.approx(attitude, abs=0.02)
    assert vehicle.battery.system_status.voltage == pytest.approx(logs.VOLTAGE)
    assert feed.timeline.duration == pytest.approx(logs.SECONDS, abs=0.1)


def test_damage_is_said_beside_the_result(tmp_path, capsys):
    path = tmp_path / "cut.bin"
    path.write_bytes(logs.dataflash()[:-10])
    assert run("export", path, tmp_path / "t.csv", "LOCAL_POSITION_NED.z") == 0
    said = capsys.readouterr().err
    assert said.startswith(f"{path}: damaged once at byte ")
    assert said.endswith(": the file was cut\n")
