"""Poses of a rigid body: from Motive's axes to the vehicle's, its track, and the MAVLink messages that carry it."""

import itertools
import math

import pytest
from scipy.spatial.transform import Rotation

from darko_gcs.motion_capture.poses import (
    AXES_OF_LABS,
    HALL_SIDES,
    MESSAGE_MAKERS,
    ArenaAxes,
    AxesSettings,
    Pose,
    PoseAccuracy,
    PoseTrack,
    TrackedPose,
)
from protocol.dialect import mavlink
from protocol.frames import flip, flip_quaternion, hover_attitude, quaternion_from_euler, rotate
from protocol.wire.codec import Codec
from sitl.mavlink.services.peer_inputs import pose_of
from sitl.motion_capture.cameras import HallAxes
from tests.support.motion_capture.hall import cameras, frames_of, motion

SIDES = tuple(HALL_SIDES)
ANGLES = (*HALL_SIDES.values(), -23.0, 57.3)
by_every_edge = pytest.mark.parametrize(("up_axis", "edge"), list(itertools.product("yz", SIDES)))
AS_MADE = (1.0, 0.0, 0.0, 0.0)
FACING = {"far": 0.0, "right": 90.0, "near": 180.0, "left": -90.0}  # azimuth from far, clockwise [deg]


def every(up_axis, edge):
    """All settings with these two: each angle, and each side of the nose."""
    return [AxesSettings(up_axis, edge, *each) for each in itertools.product(ANGLES, SIDES)]


def hall_place(settings, right, far, up):
    """A place of the hall in Motive's axes, by the words of the manual: where each axis points."""
    edge = {"right": (1, 0), "left": (-1, 0), "far": (0, 1), "near": (0, -1)}[settings.long_edge]
    along_edge = right * edge[0] + far * edge[1]
    beside = right * -edge[1] + far * edge[0]  # 90 degrees anticlockwise of the edge
    return (beside, up, along_edge) if settings.up_axis == "y" else (beside, -along_edge, up)


def about_down(degrees):
    return math.cos(math.radians(degrees) / 2), 0.0, 0.0, math.sin(math.radians(degrees) / 2)


def same_attitude(p, q):
    return abs(sum(a * b for a, b in zip(p, q, strict=True))) == pytest.approx(1.0, abs=1e-6)


@by_every_edge
def test_a_place_of_the_hall_is_where_its_east_and_north_are(up_axis, edge):
    for settings in every(up_axis, edge):
        east = math.radians(settings.x_angle)
        right, far, up = 3.0, 1.0, 2.0
        north, east_of_it, down = ArenaAxes(settings).pose(hall_place(settings, right, far, up), AS_MADE).position
        assert east_of_it == pytest.approx(right * math.cos(east) + far * math.sin(east))
        assert north == pytest.approx(-right * math.sin(east) + far * math.cos(east))
        assert down == pytest.approx(-up)


@by_every_edge
def test_as_it_was_made_the_body_is_level_and_faces_the_side_that_was_told(up_axis, edge):
    for settings in every(up_axis, edge):
        attitude = ArenaAxes(settings).pose((0.0, 0.0, 0.0), AS_MADE).attitude
        # north is x_angle left of far
        assert same_attitude(attitude, about_down(FACING[settings.nose] + settings.x_angle))


@pytest.mark.long(after=1)
@by_every_edge
def test_a_vehicle_in_any_attitude_is_seen_as_it_is(up_axis, edge):
    """The simulated Motive finds its axes by vectors, not by angles."""
    for settings in every(up_axis, edge):
        axes = HallAxes(settings.up_axis, settings.long_edge, settings.x_angle, settings.nose)
        true = motion(0.0, (1.0, -2.0, 0.7), Rotation.from_euler("zyx", (0.4, -1.1, 2.3)))
        frame = frames_of(cameras(axes, ideal=True, rate=100.0), 0.02, lambda t, at=true: at._replace(time=t))[0]
        x, y, z, w = frame.body.attitude
        pose = ArenaAxes(settings).pose(frame.body.position, (w, x, y, z))
        assert pose.position == pytest.approx(flip(true.position), abs=1e-5)
        x, y, z, w = true.attitude.as_quat()
        assert same_attitude(pose.attitude, hover_attitude(flip_quaternion((w, x, y, z))))


ENAC, DELFT = AXES_OF_LABS["enac"], AXES_OF_LABS["delft"]
TILT = math.sin(math.radians(5.0)), math.cos(math.radians(5.0))


@pytest.mark.parametrize(
    ("settings", "seen", "ned"),
    [
        (ENAC, (1.0, 2.0, 3.0), (2.0, 1.0, -3.0)),  # right, far, up are east, north, up
        (DELFT, (2.0, 3.0, 1.0), (2.0, 1.0, -3.0)),  # far, up, right
        (ENAC._replace(x_angle=90.0), (1.0, 2.0, 3.0), (-1.0, 2.0, -3.0)),  # east is far, north left
    ],
)
def test_the_settings_of_the_labs_by_hand(settings, seen, ned):
    assert ArenaAxes(settings).pose(seen, AS_MADE).position == pytest.approx(ned)


@pytest.mark.parametrize(
    ("settings", "turned", "frd"),
    [
        (ENAC, (TILT[1], TILT[0], 0.0, 0.0), (TILT[1], 0.0, TILT[0], 0.0)),  # about the right: the front, far, comes up
        (ENAC, (TILT[1], 0.0, TILT[0], 0.0), (TILT[1], TILT[0], 0.0, 0.0)),  # about far: the right side goes down
        (
            ENAC,
            (TILT[1], 0.0, 0.0, TILT[0]),
            (TILT[1], 0.0, 0.0, -TILT[0]),
        ),  # anticlockwise from above: yaw is negative
        (DELFT, (TILT[1], 0.0, TILT[0], 0.0), (TILT[1], 0.0, 0.0, -TILT[0])),  # the same about Motive's y
        (DELFT, (TILT[1], 0.0, 0.0, TILT[0]), (TILT[1], 0.0, TILT[0], 0.0)),  # about z, right
    ],
)
def test_turns_come_about_the_vehicle_s_axes(settings, turned, frd):
    assert ArenaAxes(settings).pose((0.0, 0.0, 0.0), turned).attitude == pytest.approx(frd)


LEVEL, HALF_ROUND = (1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)


def follow(track, times, place=lambda t: (2.0 * t, -t, 0.0), attitude=LEVEL):
    return [track.follow(t, Pose(place(t), attitude), 0.001) for t in times]


def times(first, last):
    return [0.005 * k for k in range(first, last)]


def test_the_velocity_is_the_mean_of_the_differences_of_four_positions():
    track = PoseTrack()
    tracked = follow(track, times(0, 6))
    assert [t.velocity is None for t in tracked] == [True, True, True, False, False, False]
    assert tracked[-1].velocity == pytest.approx((2.0, -1.0, 0.0))


def test_after_a_gap_the_velocity_is_not_told_until_four_positions_are_near():
    tracked = follow(PoseTrack(), [*times(0, 4), 1.0, 1.005, 1.01, 1.015])
    assert [t.velocity is None for t in tracked] == [True, True, True, False, True, True, True, False]


def test_a_pose_that_is_not_newer_is_none():
    assert follow(PoseTrack(), [1.0, 1.0, 0.9, 1.005])[1:3] == [None, None]


def test_what_is_lost_begins_a_new_track():
    track = PoseTrack()
    follow(track, times(0, 5))
    track.lose()
    track.lose()
    found = follow(track, times(5, 6))[0]
    assert (found.resets, found.velocity) == (1, None)


def test_a_body_that_turns_at_once_is_held_back_until_it_turns_back():
    track = PoseTrack()
    assert None not in follow(track, times(0, 10))
    assert follow(track, times(10, 100), attitude=HALF_ROUND) == [None] * 90
    assert track.is_held
    back = follow(track, times(100, 105))
    assert None not in back
    assert (track.is_held, back[0].resets, back[0].velocity) == (False, 0, None)


def test_a_body_that_moves_at_once_is_held_back_too_and_a_loss_ends_it():
    track = PoseTrack()
    follow(track, times(0, 10))
    assert follow(track, times(10, 12), place=lambda _t: (5.0, 0.0, 0.0)) == [None, None]
    track.lose()
    assert follow(track, times(12, 13), place=lambda _t: (5.0, 0.0, 0.0))[0].resets == 1


def test_the_fastest_motion_is_no_jump():
    track = PoseTrack()
    spinning = [
        track.follow(t, Pose((25.0 * t, 0, 0), (math.cos(9 * t), 0, 0, math.sin(9 * t))), 0) for t in times(0, 99)
    ]
    assert None not in spinning


MESSAGE_ANGLES = (0.1, -0.3, 2.0)
Q = quaternion_from_euler(*MESSAGE_ANGLES)
TRACKED = TrackedPose(5.0, Pose((1.0, -2.0, -3.0), Q), (0.5, 0.4, -0.3), 0.0, 3)
ACCURACY = PoseAccuracy(0.002, 0.02)
STAMP = 7_000_001


def sent(name, tracked=TRACKED, accuracy=ACCURACY):
    """The message as it arrives."""
    return Codec(1, 1).decode(Codec(1, 197).encode(MESSAGE_MAKERS[name](tracked, STAMP, accuracy)))[0]


@pytest.mark.parametrize("name", MESSAGE_MAKERS)
def test_the_vehicle_reads_the_same_pose_from_each(name):
    pose = pose_of(sent(name), in_arena=True)
    assert pose.position == pytest.approx((1.0, 2.0, 3.0))
    assert pose.position_variance == pytest.approx(4e-6)
    assert pose.attitude_variance == pytest.approx(4e-4)
    assert pose.time_stamp == pytest.approx(7.000001)
    assert pose.attitude == pytest.approx(pose_of(sent("mocap")).attitude, abs=1e-6)


def test_odometry_has_frames_velocity_in_the_body_estimator_and_resets():
    message = sent("odometry")
    assert (message.frame_id, message.child_frame_id) == (mavlink.MAV_FRAME_LOCAL_FRD, mavlink.MAV_FRAME_BODY_FRD)
    assert rotate(Q, (message.vx, message.vy, message.vz)) == pytest.approx(TRACKED.velocity, abs=1e-6)
    assert (message.estimator_type, message.reset_counter) == (mavlink.MAV_ESTIMATOR_TYPE_MOCAP, 3)
    assert math.isnan(message.rollspeed)


def test_an_unknown_velocity_is_not_told():
    message = sent("odometry", TRACKED._replace(velocity=None))
    assert all(map(math.isnan, (message.vx, message.vy, message.vz, *message.velocity_covariance)))


def test_vision_has_angles_and_resets():
    message = sent("vision")
    assert (message.roll, message.pitch, message.yaw) == pytest.approx(MESSAGE_ANGLES)
    assert message.reset_counter == 3


def test_the_reset_counter_goes_round():
    assert sent("odometry", TRACKED._replace(resets=258)).reset_counter == 2


@pytest.mark.parametrize(("error", "quality", "deviation"), [(0.0, 100, 0.002), (0.01, 50, 0.01), (0.5, 1, 0.5)])
def test_markers_that_do_not_fit_lower_the_quality_and_raise_the_variance(error, quality, deviation):
    message = sent("odometry", TRACKED._replace(marker_error=error))
    assert message.quality == quality
    assert message.pose_covariance[0] == pytest.approx(deviation**2)
