"""Other systems tell where they are: kept for a plan that follows one."""

import math

import pytest

from protocol.dialect import mavlink
from protocol.frames import euler_from_quaternion
from protocol.names import Mode
from protocol.plans.plan import Refusal
from protocol.wire.codec import Codec
from sitl.autopilot.path_watch import MAX_SOURCES, LiveObstacles, Scan
from sitl.autopilot.settings import Settings
from sitl.mavlink.services.peer_inputs import pose_of
from sitl.mavlink.telemetry.navigation import attitude_on_wire
from sitl.model.quaternions import from_euler
from sitl.sensors.instruments import EXTERNAL_POSE, FIRST_DELAYED
from sitl.simulation.avionics import Navigation
from sitl.vehicle.parameters import WorldSettings
from tests.support.vehicle.fake_station import FakeStation, make_aircraft
from tests.support.vehicle.pose_source import EPOCH_US, PoseSource, odometry


@pytest.fixture
def station(tmp_path):
    return FakeStation.with_vehicle(tmp_path, up=2.0)


def follow_target(lat, lon, alt, velocity=(1.0, 2.0, 0.5)):
    zeros = [0.0] * 3
    return mavlink.MAVLink_follow_target_message(0, 3, lat, lon, alt, velocity, zeros, [1.0, *zeros], zeros, zeros, 0)


def heard(station):
    return station.node.aircraft.autopilot.flight_plan.others.heard


def test_a_target_is_kept_in_the_vehicles_frame(station):
    world = station.node.aircraft.autopilot.world
    place = world.frame.to_geodetic((30.0, 40.0, -5.0))
    station.send(follow_target(round(1e7 * place.lat_deg), round(1e7 * place.lon_deg), place.alt))
    (aircraft,) = heard(station).values()
    assert aircraft.p == pytest.approx((30.0, -40.0, 5.0), abs=0.05)
    assert aircraft.v == pytest.approx((1.0, -2.0, -0.5))
    assert math.degrees(aircraft.course) == pytest.approx(math.degrees(math.atan2(2.0, 1.0)))


def test_the_stream_of_an_aircraft_is_kept_too(station):
    place = station.node.aircraft.autopilot.world.frame.to_geodetic((30.0, 40.0, -5.0))
    lat, lon, alt = round(1e7 * place.lat_deg), round(1e7 * place.lon_deg), round(1e3 * place.alt)
    station.send(mavlink.MAVLink_global_position_int_message(0, lat, lon, alt, 0, 100, -200, 50, 0))
    (aircraft,) = heard(station).values()
    assert aircraft.p == pytest.approx((30.0, -40.0, 5.0), abs=0.05)
    assert aircraft.v == pytest.approx((1.0, 2.0, -0.5))


@pytest.mark.parametrize(
    "message",
    [
        follow_target(950_000_000, 0, 10.0),
        follow_target(0, 1_900_000_000, 10.0),
        follow_target(0, 0, math.nan),
        follow_target(0, 0, 10.0, (1e9, 0.0, 0.0)),
    ],
)
def test_places_that_cannot_be_are_not_believed(station, message):
    station.send(message)
    assert heard(station) == {}


def test_a_velocity_that_is_not_told_is_none(station):
    station.send(follow_target(0, 0, 10.0, (math.nan, 0.0, 0.0)))
    (aircraft,) = heard(station).values()
    assert aircraft.v == (0.0, 0.0, 0.0)


# Poses from a peer: fused with their own time, one source at a time, and refused with a reason.


LINE = EXTERNAL_POSE - FIRST_DELAYED
OTHERS_ONLY = WorldSettings(motion_capture=0)
TAKE_OFF, ARM = mavlink.MAV_CMD_NAV_TAKEOFF, mavlink.MAV_CMD_COMPONENT_ARM_DISARM


def boot(folder, **options):
    options = {"navigation": Navigation.MOCAP, "aligned": False, "world_settings": OTHERS_ONLY, **options}
    return FakeStation.with_vehicle(folder, **options)


def taken(tracked):
    """The control period of the newest pose that the vehicle has taken."""
    return int(tracked.vehicle.avionics.instruments["sampled"][LINE].max())


@pytest.fixture
def tracked(tmp_path):
    return boot(tmp_path)


@pytest.fixture
def source(tracked):
    source = PoseSource(tracked)
    source.fly(0.1)
    return source


@pytest.fixture
def truth(source):
    source.station.command(mavlink.MAV_CMD_REQUEST_MESSAGE, mavlink.MAVLINK_MSG_ID_DARKO_TRUTH)
    return source.station.last("DARKO_TRUTH")


@pytest.mark.long
@pytest.mark.parametrize("epoch", [0, EPOCH_US], ids=["by the vehicle's time", "by an unknown clock"])
def test_it_boots_takes_off_and_hovers_on_poses_alone_that_come_20_ms_late(tracked, epoch):
    source, off = PoseSource(tracked, epoch=epoch), []

    def compare():
        off.append(math.dist(tracked.vehicle.estimate.position, tracked.vehicle.truth.body.position))

    assert tracked.command(ARM, 1) == mavlink.MAV_RESULT_TEMPORARILY_REJECTED
    assert "waiting for poses of motion capture" in tracked.texts()
    source.fly(3.0)
    assert tracked.command(ARM, 1) == mavlink.MAV_RESULT_ACCEPTED
    assert tracked.command(TAKE_OFF) == mavlink.MAV_RESULT_ACCEPTED
    source.fly(6.5, compare)
    assert math.dist(tracked.vehicle.truth.body.position, (0.0, 0.0, 2.5)) < 0.5
    assert max(off) < 0.05
    assert tracked.vehicle.avionics.filter["late"][LINE] < 10


@pytest.mark.long
def test_without_poses_in_flight_it_lands(tmp_path):
    tracked = boot(tmp_path, up=3.0, aligned=True)
    PoseSource(tracked).fly(2.0)
    tracked.advance(2.5)
    assert "No position for 2 s: landing" in tracked.texts()


@pytest.mark.long
def test_the_arena_s_cameras_are_back_when_the_parameter_says_so(tracked):
    tracked.set_parameter("SIM_MOCAP", 1.0)
    tracked.advance(2.0)
    assert tracked.bench.aircraft.view().awaited == ()


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


@pytest.mark.long
def test_a_pose_that_is_too_late_or_older_than_the_last_is_refused(source, truth):
    source.fly(0.3)
    source.send(odometry(truth))
    assert "ms late, the filter looks back 70 ms" in source.station.texts()
    source.station.set_parameter("EKF2_EV_DELAY", 50.0)
    source.send(odometry(truth, epoch=EPOCH_US))
    assert "older than the one before" in source.station.texts()


@pytest.mark.long
def test_poses_come_from_one_source_until_it_is_silent(source, truth):
    before, other = taken(source.station), FakeStation(source.station.bench, 245, "other")
    later = odometry(truth, epoch=EPOCH_US)
    other.send(later)
    assert "poses come from another source" in source.station.texts()
    assert taken(source.station) == before
    source.station.advance(1.1)
    other.send(later)
    assert taken(source.station) > before


@pytest.mark.long
def test_another_vehicle_s_odometry_is_not_taken(source, truth):
    source.codec = Codec(2, mavlink.MAV_COMP_ID_AUTOPILOT1)
    source.station.advance(1.1)
    source.send(odometry(truth, epoch=EPOCH_US))
    assert "it is of another vehicle" in source.station.texts()


@pytest.mark.long
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
    tracked = FakeStation.with_vehicle(tmp_path)
    PoseSource(tracked).fly(0.1)
    assert "ODOMETRY refused: the vehicle flies on the exact state" in tracked.texts()
    assert taken(tracked) == 0


# The three messages in which peers send poses say the same, in the vehicle's frames.


PLACE, WIRE_PLACE = (1.0, 2.0, 3.0), (1.0, -2.0, -3.0)
Q = from_euler(0.2, -1.4, 0.7)  # nearly nose up
WIRE_Q = attitude_on_wire(Q)
NO_COVARIANCE = [math.nan] * 21
VISION_COVARIANCE = [0.0] * 21
VISION_COVARIANCE[0], VISION_COVARIANCE[6], VISION_COVARIANCE[11] = 1e-4, 4e-4, 2e-4
VISION_COVARIANCE[15], VISION_COVARIANCE[18], VISION_COVARIANCE[20] = 1e-5, 1e-5, 3e-5
STAMP = 12_345_678


def sent_odometry(covariance, q=WIRE_Q):
    return mavlink.MAVLink_odometry_message(
        STAMP, mavlink.MAV_FRAME_LOCAL_NED, mavlink.MAV_FRAME_BODY_FRD, *WIRE_PLACE, list(q), *[0.0] * 6, covariance,
        NO_COVARIANCE,
    )  # fmt: skip


def vision(covariance):
    angles = euler_from_quaternion(WIRE_Q)
    return mavlink.MAVLink_vision_position_estimate_message(STAMP, *WIRE_PLACE, *angles, covariance)


def mocap(covariance):
    return mavlink.MAVLink_att_pos_mocap_message(STAMP, list(WIRE_Q), *WIRE_PLACE, covariance)


KINDS = pytest.mark.parametrize("make", [sent_odometry, vision, mocap], ids=lambda make: make.__name__)


@KINDS
def test_position_and_attitude_come_into_the_vehicle_s_frames(make):
    pose = pose_of(make(NO_COVARIANCE))
    assert pose.position == pytest.approx(PLACE)
    assert abs(sum(a * b for a, b in zip(pose.attitude, Q, strict=True))) == pytest.approx(1.0, abs=1e-9)
    assert pose.time_stamp == pytest.approx(12.345678)


@KINDS
def test_the_worst_axis_s_variance_counts_and_an_unknown_one_is_not_told(make):
    told = pose_of(make(VISION_COVARIANCE))
    assert (told.position_variance, told.attitude_variance) == (4e-4, 3e-5)
    for unknown in (NO_COVARIANCE, [0.0] * 21):
        pose = pose_of(make(unknown))
        assert (pose.position_variance, pose.attitude_variance) == (None, None)


def test_a_quaternion_is_normalised():
    pose = pose_of(sent_odometry(NO_COVARIANCE, q=[1.05 * part for part in WIRE_Q]))
    assert math.hypot(*pose.attitude) == pytest.approx(1.0, abs=1e-12)
    long = sent_odometry(NO_COVARIANCE, q=[1.2 * part for part in WIRE_Q])
    assert pose_of(long) == Refusal("quaternion has norm 1.20, not 1")


@KINDS
def test_what_is_not_a_number_is_refused(make):
    message = make(NO_COVARIANCE)
    message.y = math.nan
    assert pose_of(message) == Refusal("not a number")


# OBSTACLE_DISTANCE stops the vehicle in time, whatever flies it, and is checked.
#
# https://mavlink.io/en/messages/common.html#OBSTACLE_DISTANCE


FRD, GLOBAL = mavlink.MAV_FRAME_BODY_FRD, mavlink.MAV_FRAME_GLOBAL
WALL = 20.0  # north of the origin [m]


def message(distances, *, frame=GLOBAL, increment=5, increment_f=0.0, offset=0.0, sensor=0, far=4000):
    padded = [*distances, *[0xFFFF] * (72 - len(distances))]
    return mavlink.MAVLink_obstacle_distance_message(0, sensor, padded, increment, 20, far, increment_f, offset, frame)


def sighted(folder, up=10.0, **settings):
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


@pytest.mark.long
@pytest.mark.parametrize(("leg_mode", "least"), [(1, 1.9), (0, 1.2)], ids=["hovered", "in the front transition"])
def test_a_go_to_is_stopped_before_a_wall_that_nobody_knew(tmp_path, leg_mode, least):
    ground = sighted(tmp_path, collision_distance=3.0, leg_mode=leg_mode)
    assert ground.autopilot.guided.go_to((60.0, 0.0, 10.0)).result == 0
    assert least < fly_to_the_wall(ground) < 4.5
    assert ground.autopilot.mode is Mode.HOLD
    assert "keep 3 m: holding" in ground.texts()


@pytest.mark.long
def test_the_same_in_a_return_and_again_after_another_request(tmp_path):
    ground = sighted(tmp_path, collision_distance=3.0, leg_mode=1)
    ground.autopilot.relocate(ground.autopilot.world.frame, (60.0, 0.0, 0.0))
    assert ground.autopilot.guided.return_to_launch().result == 0
    assert fly_to_the_wall(ground, 20.0) > 1.9
    assert ground.autopilot.mode is Mode.HOLD
    ground.autopilot.guided.go_to((60.0, 0.0, 10.0))
    assert fly_to_the_wall(ground, 10.0) > 1.0
    assert ground.autopilot.mode is Mode.HOLD


@pytest.mark.long
def test_forward_flight_is_stopped_by_its_stopping_distance(tmp_path):
    ground = sighted(tmp_path, up=60.0, collision_distance=3.0, leg_mode=2)
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
    assert nearest > 3.0  # told again on the way, it aims no farther
    assert abs(ground.vehicle.truth.body.velocity.x) < 0.5


@pytest.mark.long
def test_without_the_parameter_scans_are_ignored(tmp_path):
    ground = sighted(tmp_path)
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
    ground = sighted(tmp_path)
    ground.send(sent)
    scans = list(ground.autopilot.failsafes.obstacles.scans.values())
    assert [one for scan in scans for one in scan.places] == [pytest.approx(place, abs=0.05)]


def test_unknown_and_too_far_is_no_obstacle(tmp_path):
    ground = sighted(tmp_path)
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
    ground = sighted(tmp_path)
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
