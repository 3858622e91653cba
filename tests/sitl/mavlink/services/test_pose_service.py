"""Poses from a peer: fused with their own time, one source at a time, and refused with a reason."""

import math

import pytest

from protocol.dialect import mavlink
from protocol.wire.codec import Codec
from sitl.sensors.instruments import EXTERNAL_POSE, FIRST_DELAYED
from sitl.simulation.avionics import Navigation
from sitl.vehicle.parameters import WorldSettings
from tests.support.vehicle.fake_station import FakeStation
from tests.support.vehicle.pose_source import EPOCH_US, PoseSource, odometry

LINE = EXTERNAL_POSE - FIRST_DELAYED
OTHERS_ONLY = WorldSettings(motion_capture=0)
TAKE_OFF, ARM = mavlink.MAV_CMD_NAV_TAKEOFF, mavlink.MAV_CMD_COMPONENT_ARM_DISARM


def boot(folder, **options):
    options = {"navigation": Navigation.MOCAP, "aligned": False, "world_settings": OTHERS_ONLY, **options}
    return FakeStation.with_vehicle(folder, **options)


def taken(station):
    """The control period of the newest pose that the vehicle has taken."""
    return int(station.vehicle.avionics.instruments["sampled"][LINE].max())


@pytest.fixture
def station(tmp_path):
    return boot(tmp_path)


@pytest.fixture
def source(station):
    source = PoseSource(station)
    source.fly(0.1)
    return source


@pytest.fixture
def truth(source):
    source.station.command(mavlink.MAV_CMD_REQUEST_MESSAGE, mavlink.MAVLINK_MSG_ID_DARKO_TRUTH)
    return source.station.last("DARKO_TRUTH")


@pytest.mark.parametrize("epoch", [0, EPOCH_US], ids=["by the vehicle's time", "by an unknown clock"])
def test_it_boots_takes_off_and_hovers_on_poses_alone_that_come_20_ms_late(station, epoch):
    source, off = PoseSource(station, epoch=epoch), []

    def compare():
        off.append(math.dist(station.vehicle.estimate.position, station.vehicle.truth.body.position))

    assert station.command(ARM, 1) == mavlink.MAV_RESULT_TEMPORARILY_REJECTED
    assert "waiting for poses of motion capture" in station.texts()
    source.fly(3.0)
    assert station.command(ARM, 1) == mavlink.MAV_RESULT_ACCEPTED
    assert station.command(TAKE_OFF) == mavlink.MAV_RESULT_ACCEPTED
    source.fly(6.5, compare)
    assert math.dist(station.vehicle.truth.body.position, (0.0, 0.0, 2.5)) < 0.5
    assert max(off) < 0.05
    assert station.vehicle.avionics.filter["late"][LINE] < 10


def test_without_poses_in_flight_it_lands(tmp_path):
    station = boot(tmp_path, up=3.0, aligned=True)
    PoseSource(station).fly(2.0)
    station.advance(2.5)
    assert "No position for 2 s: landing" in station.texts()


def test_the_arena_s_cameras_are_back_when_the_parameter_says_so(station):
    station.set_parameter("SIM_MOCAP", 1.0)
    station.advance(2.0)
    assert station.bench.aircraft.view().awaited == ()


@pytest.mark.parametrize(
    ("changed", "reason"),
    [
        ({"x": math.nan}, "not a number"),
        ({"z": math.inf}, "not a number"),
        ({"y": -1e38}, "more than 10000 m away"),
        ({"q": [math.nan, 0.0, 0.0, 0.0]}, "not a number"),
        ({"q": [0.0, 0.0, 0.0, 0.0]}, "quaternion has norm 0.00, not 1"),
        ({"frame_id": mavlink.MAV_FRAME_LOCAL_FLU}, "frame 21 is not LOCAL_NED"),
        ({"quality": -1}, "its sender has lost track"),
    ],
)
def test_what_is_no_pose_is_refused_with_a_reason(source, truth, changed, reason):
    before = taken(source.station)
    source.send(odometry(truth, **changed))
    assert f"ODOMETRY refused: {reason}" in source.station.texts()
    assert taken(source.station) == before


def test_a_pose_that_is_too_late_or_older_than_the_last_is_refused(source, truth):
    source.fly(0.3)
    source.send(odometry(truth))
    assert "ms late, the filter looks back 70 ms" in source.station.texts()
    source.station.set_parameter("EKF2_EV_DELAY", 50.0)
    source.send(odometry(truth, epoch=EPOCH_US))
    assert "older than the one before" in source.station.texts()


def test_poses_come_from_one_source_until_it_is_silent(source, truth):
    before, other = taken(source.station), FakeStation(source.station.bench, 245, "other")
    later = odometry(truth, epoch=EPOCH_US)
    other.send(later)
    assert "poses come from another source" in source.station.texts()
    assert taken(source.station) == before
    source.station.advance(1.1)
    other.send(later)
    assert taken(source.station) > before


def test_another_vehicle_s_odometry_is_not_taken(source, truth):
    source.codec = Codec(2, mavlink.MAV_COMP_ID_AUTOPILOT1)
    source.station.advance(1.1)
    source.send(odometry(truth, epoch=EPOCH_US))
    assert "it is of another vehicle" in source.station.texts()


def test_a_pose_whose_forward_is_not_told_to_be_north_is_taken_where_no_compass_tells_north(source, truth, tmp_path):
    before = taken(source.station)
    source.send(odometry(truth, epoch=EPOCH_US, frame_id=mavlink.MAV_FRAME_LOCAL_FRD))
    assert taken(source.station) >= before
    assert "refused" not in source.station.texts()
    outdoors = PoseSource(boot(tmp_path / "outdoors", navigation=Navigation.SENSORS))
    outdoors.fly(0.1)
    outdoors.send(odometry(truth, epoch=EPOCH_US, frame_id=mavlink.MAV_FRAME_LOCAL_FRD))
    assert "ODOMETRY refused: frame 20 is not LOCAL_NED" in outdoors.station.texts()


def test_a_vehicle_on_the_exact_state_takes_none(tmp_path):
    station = FakeStation.with_vehicle(tmp_path)
    PoseSource(station).fly(0.1)
    assert "ODOMETRY refused: the vehicle flies on the exact state" in station.texts()
    assert taken(station) == 0
