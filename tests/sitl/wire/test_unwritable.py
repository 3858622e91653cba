"""A disk that fills, and a folder that goes away, in the middle of a flight: it goes on, and both ends are said."""

import math
import shutil

import pytest

from protocol.dialect.vocabulary import Way
from protocol.tlog import TlogReader
from sitl.autopilot.settings import Settings
from sitl.wire import blackbox as recorder
from sitl.wire.blackbox import Blackbox
from sitl.wire.node import Node
from tests.support.disk import full_disk
from tests.support.station import Sky

WALL = 1_790_000_000.0
POINT = (120.0, 0.0, 25.0)


@pytest.fixture
def sky(tmp_path, monkeypatch):
    """On its way to a point on the wing, recorded."""
    monkeypatch.setattr(recorder, "AGAIN", 2.0)
    sky = Sky(tmp_path, up=25.0, settings=Settings(way=Way.FORWARD))
    sky.node = Node(sky.craft, sky.node.memory, ["main"], None, Blackbox(tmp_path / "logs", lambda: WALL))
    sky.ground = sky.station()
    sky.advance(2.0)
    assert sky.autopilot.go_to(POINT).accepted
    return sky


def arrives(sky):
    sky.advance_until(lambda: math.dist(sky.craft.vehicle.truth.body.position, POINT) < 1.0, 40.0)
    return True


def logs(tmp_path):
    return sorted((tmp_path / "logs").glob("*.tlog"))


def test_a_disk_that_fills_and_is_emptied_costs_the_log_its_middle_and_the_flight_nothing(sky, tmp_path):
    with full_disk():
        sky.advance(7.6)  # several attempts to go on
    texts = sky.ground.texts()
    assert texts.count("recording stopped") == 1
    assert "recorded again" not in texts
    assert len(logs(tmp_path)) == 1  # what was begun in vain is not left behind
    sky.advance(4.0)
    first, second = logs(tmp_path)
    assert sky.ground.texts().count(f"Flight recorded again: {second.name}") == 1
    assert arrives(sky)
    assert all(len(TlogReader(path.read_bytes())) > 10 for path in (first, second))


def test_a_folder_that_goes_away_is_said_and_the_flight_is_recorded_when_there_is_one_again(sky, tmp_path):
    shutil.rmtree(tmp_path / "logs")
    (tmp_path / "logs").write_text("a file where the folder was")
    sky.advance(5.0)
    assert sky.ground.texts().count("is gone") == 1
    assert "Flight not recorded" not in sky.ground.texts()  # which is the same news
    (tmp_path / "logs").unlink()
    sky.advance(4.0)
    (log,) = logs(tmp_path)
    assert sky.ground.texts().count(f"Flight recorded again: {log.name}") == 1
    assert arrives(sky)


def test_a_log_that_somebody_deletes_is_begun_anew(sky, tmp_path):
    logs(tmp_path)[0].unlink()
    sky.advance(4.0)
    assert len(logs(tmp_path)) == 1
    assert sky.ground.texts().count("is gone") == sky.ground.texts().count("recorded again") == 1
