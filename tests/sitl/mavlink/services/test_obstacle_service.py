"""OBSTACLE_DISTANCE stops the vehicle in time, whatever flies it, and is checked.

https://mavlink.io/en/messages/common.html#OBSTACLE_DISTANCE
"""

import math

import pytest

from protocol.dialect import mavlink
from protocol.names.modes import Mode
from sitl.autopilot.path_watch import MAX_SOURCES, LiveObstacles, Scan
from sitl.autopilot.settings import Settings
from tests.support.vehicle.fake_station import FakeStation, make_aircraft

FRD, GLOBAL = mavlink.MAV_FRAME_BODY_FRD, mavlink.MAV_FRAME_GLOBAL
WALL = 20.0  # north of the origin [m]


def message(distances, *, frame=GLOBAL, increment=5, increment_f=0.0, offset=0.0, sensor=0, far=4000):
    padded = [*distances, *[0xFFFF] * (72 - len(distances))]
    return mavlink.MAVLink_obstacle_distance_message(0, sensor, padded, increment, 20, far, increment_f, offset, frame)


def station(folder, up=10.0, **settings):
    ground = FakeStation.with_vehicle(folder, aircraft=make_aircraft(up=up, settings=Settings(**settings)))
    ground.beat()
    return ground


def seeing_the_wall(ground):
    """Message of a scanner that sees a wall to the north, 40 m far at most."""
    p = ground.vehicle.truth.body.position
    seen = []
    for k in range(72):
        ahead = math.cos(math.radians(5.0 * k))
        distance = (WALL - p.x) / ahead if ahead > 0.1 else math.inf
        seen.append(round(100.0 * distance) if 0.2 < distance < 40.0 else 4001)
    return message(seen)


def fly_to_the_wall(ground, seconds=15.0):
    nearest = math.inf
    for _ in range(round(seconds / 0.1)):
        ground.send(seeing_the_wall(ground))
        ground.advance(0.1)
        nearest = min(nearest, WALL - ground.vehicle.truth.body.position.x)
    return nearest


def test_a_go_to_is_stopped_before_a_wall_that_nobody_knew(tmp_path):
    ground = station(tmp_path, collision_distance=3.0)
    assert ground.autopilot.guided.go_to((60.0, 0.0, 10.0)).result == 0
    assert 2.0 < fly_to_the_wall(ground) < 4.5
    assert ground.autopilot.mode is Mode.HOLD
    assert "keep 3 m: holding" in ground.texts()


def test_the_same_in_a_return_and_again_after_another_request(tmp_path):
    ground = station(tmp_path, collision_distance=3.0, leg_mode=1)
    ground.autopilot.relocate(ground.autopilot.world.frame, (60.0, 0.0, 0.0))
    assert ground.autopilot.guided.return_to_launch().result == 0
    assert fly_to_the_wall(ground, 20.0) > 2.0
    assert ground.autopilot.mode is Mode.HOLD
    ground.autopilot.guided.go_to((60.0, 0.0, 10.0))
    assert fly_to_the_wall(ground, 10.0) > 1.5
    assert ground.autopilot.mode is Mode.HOLD


def test_forward_flight_is_stopped_by_its_stopping_distance(tmp_path):
    ground = station(tmp_path, up=60.0, collision_distance=3.0, leg_mode=2)
    far = 120.0

    def scan():
        p = ground.vehicle.truth.body.position
        return message([round(100.0 * min(far - p.x, 600.0))], far=60000)

    assert ground.autopilot.guided.go_to((400.0, 0.0, 60.0)).result == 0
    nearest, forward = math.inf, False
    for _ in range(160):
        ground.send(scan())
        ground.advance(0.1)
        nearest = min(nearest, far - ground.vehicle.truth.body.position.x)
        forward |= ground.autopilot.view.forward
    assert forward
    assert "keep 3 m: holding" in ground.texts()
    assert nearest > 0.5
    assert abs(ground.vehicle.truth.body.velocity.x) < 0.5


def test_without_the_parameter_scans_are_ignored(tmp_path):
    ground = station(tmp_path)
    ground.autopilot.guided.go_to((25.0, 0.0, 10.0))
    fly_to_the_wall(ground)
    assert ground.vehicle.truth.body.position.x > WALL


@pytest.mark.parametrize(
    ("sent", "place"),
    [
        (message([1000]), (10.0, 0.0)),
        (message([0xFFFF, 1000], increment=90), (0.0, -10.0)),  # east
        (message([1000], offset=180.0), (-10.0, 0.0)),
        (message([0xFFFF, 1000], increment=1, increment_f=90.0), (0.0, -10.0)),
        (message([1000], frame=FRD), (10.0, 0.0)),  # it heads north
        (message([1000], frame=FRD, offset=-90.0), (0.0, 10.0)),
    ],
)
def test_directions(tmp_path, sent, place):
    ground = station(tmp_path)
    ground.send(sent)
    scans = list(ground.autopilot.failsafes.obstacles.scans.values())
    assert [one for scan in scans for one in scan.places] == [pytest.approx(place, abs=0.05)]


def test_unknown_and_too_far_is_no_obstacle(tmp_path):
    ground = station(tmp_path)
    ground.send(message([0xFFFF, 4001, 10]))
    assert [scan.places for scan in ground.autopilot.failsafes.obstacles.scans.values()] == [()]


@pytest.mark.parametrize(
    ("sent", "reason"),
    [
        (message([1000], frame=mavlink.MAV_FRAME_MISSION), "frame 2 is not supported"),
        (message([1000], increment=0), "directions 0 deg apart from 0 deg"),
        (message([1000], offset=math.nan), "directions 5 deg apart from nan deg"),
    ],
)
def test_what_makes_no_sense_is_refused(tmp_path, sent, reason):
    ground = station(tmp_path)
    ground.send(sent)
    assert f"OBSTACLE_DISTANCE refused: {reason}" in ground.texts()
    assert ground.autopilot.failsafes.obstacles.scans == {}


def test_scans_grow_old_and_sources_are_few():
    obstacles = LiveObstacles()
    assert all(obstacles.take(name, Scan(1.0, ())) for name in range(MAX_SOURCES))
    assert not obstacles.take("another", Scan(1.2, ()))
    assert obstacles.take(3, Scan(1.2, ()))
    assert obstacles.take("another", Scan(2.0, ()))
    assert set(obstacles.scans) == {"another"}
