"""A disk that fills up and a folder that disappears during a flight: the flight goes on, and the pilot is told."""

import math
import shutil

import pytest

from protocol.dialect.vocabulary import LegMode
from protocol.tlog import TlogReader
from sitl.autopilot.settings import Settings
from sitl.mavlink import flight_recorder
from sitl.mavlink.flight_recorder import FlightRecorder
from tests.support.disk import full_disk
from tests.support.vehicle.fake_station import Bench

WALL = 1_790_000_000.0
POINT = (120.0, 0.0, 25.0)


@pytest.fixture
def bench(tmp_path, monkeypatch):
    """On its way to a point in forward flight, recorded."""
    monkeypatch.setattr(flight_recorder, "RETRY_INTERVAL", 2.0)
    recorder = FlightRecorder(tmp_path / "logs", lambda: WALL)
    bench = Bench(tmp_path, up=25.0, settings=Settings(leg_mode=LegMode.FORWARD), node_options={"recorder": recorder})
    bench.ground = bench.station()
    bench.advance(2.0)
    assert bench.autopilot.guided.go_to(POINT).accepted
    return bench


def arrives(bench):
    bench.advance_until(lambda: math.dist(bench.aircraft.vehicle.truth.body.position, POINT) < 1.0, 40.0)
    return True


def logs(tmp_path):
    return sorted((tmp_path / "logs").glob("*.tlog"))


def test_a_full_disk_that_is_emptied_again_costs_the_log_its_middle_and_the_flight_nothing(bench, tmp_path):
    with full_disk():
        bench.advance(7.6)  # several attempts to go on
    texts = bench.ground.texts()
    assert texts.count("recording stopped") == 1
    assert "recorded again" not in texts
    assert len(logs(tmp_path)) == 1  # files of failed attempts are deleted
    bench.advance(4.0)
    first, second = logs(tmp_path)
    assert bench.ground.texts().count(f"Flight recorded again: {second.name}") == 1
    assert arrives(bench)
    assert all(len(TlogReader(path.read_bytes())) > 10 for path in (first, second))


def test_a_folder_that_disappears_is_reported_and_recording_begins_again_once_it_is_back(bench, tmp_path):
    shutil.rmtree(tmp_path / "logs")
    (tmp_path / "logs").write_text("a file where the folder was")
    bench.advance(5.0)
    assert bench.ground.texts().count("is gone") == 1
    assert "Flight not recorded" not in bench.ground.texts()  # which would say the same
    (tmp_path / "logs").unlink()
    bench.advance(4.0)
    (log,) = logs(tmp_path)
    assert bench.ground.texts().count(f"Flight recorded again: {log.name}") == 1
    assert arrives(bench)


def test_a_deleted_log_is_begun_anew(bench, tmp_path):
    logs(tmp_path)[0].unlink()
    bench.advance(4.0)
    assert len(logs(tmp_path)) == 1
    assert bench.ground.texts().count("is gone") == bench.ground.texts().count("recorded again") == 1
