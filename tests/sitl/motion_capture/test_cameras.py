"""The cameras: exact where nothing is wrong, and wrong as the instrument's specification says."""

import itertools
import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from protocol.natnet import CLOCK
from sitl.errors import SitlError
from sitl.model.airframe_files import load
from sitl.motion_capture.cameras import SIDES, Disturbances, HallAxes, Trouble, read_disturbance
from sitl.simulation.avionics import Avionics, Navigation
from tests.support.motion_capture.hall import cameras, frames_of, motion, sensors

NORTH_WEST = HallAxes("z", "right", 0.0, "far")  # the stream's axes are the vehicle's world, north, west, up


def turned(frame):
    return Rotation.from_quat(frame.body.attitude)


def curve(t):
    """A circle at 3 m/s that turns and rolls."""
    where = (2 * math.cos(1.5 * t), 2 * math.sin(1.5 * t), 1.0)
    speed = (-3 * math.sin(1.5 * t), 3 * math.cos(1.5 * t), 0.0)
    return motion(t, where, Rotation.from_rotvec((0.0, 4.0 * t, 0.0)), speed, (0.0, 4.0, 0.0))


def test_without_errors_frames_between_true_states_are_of_the_true_motion():
    frames = frames_of(cameras(NORTH_WEST, ideal=True, rate=240.0), 1.0, curve)
    made = Rotation.from_euler("y", -90, degrees=True)
    assert len(frames) == 240
    for frame in frames:
        true = curve(frame.exposed / CLOCK)
        assert frame.body.position == pytest.approx(true.position, abs=1e-5)
        assert (turned(frame) * made * true.attitude.inv()).magnitude() < 1e-4


@pytest.mark.long(after=1)
@pytest.mark.parametrize("rate", [100.0, 120.0, 200.0, 240.0])
def test_frames_are_numbered_and_exposed_at_their_rate(rate):
    frames = frames_of(cameras(ideal=True, rate=rate), 1.0)
    assert [frame.number for frame in frames] == list(range(1, round(rate) + 1))
    assert [frame.exposed for frame in frames] == [round(frame.number / rate * CLOCK) for frame in frames]


def test_equal_seeds_give_equal_frames_and_others_others():
    a, b, c = (frames_of(cameras(seed=seed), 0.2) for seed in (3, 3, 4))
    assert a == b != c


@pytest.mark.long
def test_poses_are_as_noisy_as_the_specification_says():
    frames = frames_of(cameras(NORTH_WEST, misalignment=0.0, step=1e-9), 5.0)
    spec = sensors().motion_capture
    places = np.array([frame.body.position for frame in frames])
    mean = Rotation.concatenate([turned(frame) for frame in frames]).mean()
    turns = np.array([(turned(frame) * mean.inv()).as_rotvec() for frame in frames])
    assert places.std(axis=0) == pytest.approx([spec.noise] * 3, rel=0.15)
    assert turns.std(axis=0) == pytest.approx([spec.attitude_noise] * 3, rel=0.2)
    assert places.mean(axis=0) == pytest.approx((0.0, 0.0, 1.0), abs=1e-4)
    errors = [frame.body.marker_error for frame in frames]
    assert 0.5 * spec.noise < np.mean(errors) < 3.0 * spec.noise


def test_the_body_is_misaligned_as_for_the_vehicle_s_own_cameras_of_that_seed():
    quiet = {"noise": 0.0, "attitude_noise": 0.0}
    own = Avionics(Navigation.MOCAP, sensors(), load("nominal").parameters, 7).instruments["errors"]["misalignment"]
    frame = frames_of(cameras(NORTH_WEST, seed=7, **quiet), 0.1)[-1]
    made = Rotation.from_euler("y", -90, degrees=True)
    assert (made.inv() * turned(frame) * made).as_rotvec() == pytest.approx(list(own.item()), abs=1e-6)


def test_positions_come_in_steps():
    frames = frames_of(cameras(NORTH_WEST, step=0.01), 0.5)
    assert {round(100 * x, 6) % 1 for frame in frames for x in frame.body.position} <= {0.0, 1.0}
    assert len({frame.body.position for frame in frames}) < 5


def test_frames_are_late_and_in_order():
    frames = frames_of(cameras(delay=0.02, jitter=0.004, dropout=0.0), 3.0)
    late = np.array([frame.transmitted - frame.exposed for frame in frames]) / CLOCK
    assert late.min() >= 0.02
    assert 0.022 < late.mean() < 0.027
    assert all(a.transmitted <= b.transmitted for a, b in itertools.pairwise(frames))
    assert all(frame.exposed < frame.received <= frame.transmitted for frame in frames)


@pytest.mark.long
def test_the_share_of_frames_that_is_dropped_is_missing_by_number():
    frames = frames_of(cameras(dropout=0.3, delay=0.0), 5.0)
    assert len(frames) / 1000.0 == pytest.approx(0.7, abs=0.05)
    assert [frame.number for frame in frames] == sorted({frame.number for frame in frames})


def test_lost_tracking_shows_the_last_pose_without_markers_and_says_so():
    frames = frames_of(cameras(events=["lost@0.3+0.2"], dropout=0.0, delay=0.0), 1.0)
    lost = [frame for frame in frames if not frame.body.is_tracked]
    assert len(lost) == 40
    assert {frame.body.position for frame in lost} == {frames[frames.index(lost[0]) - 1].body.position}
    assert all(frame.markers == () for frame in lost)
    assert frames[-1].body.is_tracked


def test_swapped_markers_turn_the_body_while_they_last():
    frames = frames_of(cameras(events=["swap@0.3+0.2"], dropout=0.0, delay=0.0), 1.0)
    flipped = [frame for frame in frames if turned(frame).magnitude() > math.radians(80.0)]
    assert len(flipped) == 40
    assert all(frame.body.is_tracked for frame in flipped)
    usual = np.mean([frame.body.marker_error for frame in frames if frame not in flipped])
    assert np.mean([frame.body.marker_error for frame in flipped]) > 1.5 * usual


def test_dropped_frames_do_not_arrive():
    frames = frames_of(cameras(events=["dropped@0.3+0.2"], dropout=0.0, delay=0.0, jitter=0.0), 1.0)
    assert len(frames) == 160


def test_a_gap_in_the_truth_is_not_bridged_and_a_reboot_begins_anew():
    made = cameras(ideal=True)
    frames_of(made, 1.0)
    made.look(motion(3.0))
    assert list(made.frames(3.0)) == []
    made.look(motion(3.05))
    assert [frame.exposed / CLOCK > 3.0 for frame in made.frames(3.05)] == [True] * 10
    time = made.time
    assert [frame.number for frame in frames_of(made, 0.1)] == list(range(1, 21))
    assert made.time == pytest.approx(time + 0.1)


# Axes of the stream, from the calibration of Motive.


NORTH, WEST, UP = np.eye(3)
ALL = [HallAxes(*each) for each in itertools.product("yz", SIDES, (0.0, 90.0, 180.0, -23.0), SIDES)]


def test_as_enac_calibrates_the_stream_is_east_north_up():
    to_stream = HallAxes("z", "near", 0.0, "far").to_stream()
    assert to_stream.apply(-WEST) == pytest.approx((1, 0, 0), abs=1e-12)
    assert to_stream.apply(NORTH) == pytest.approx((0, 1, 0), abs=1e-12)


def test_as_delft_calibrates_x_is_far_y_up_and_z_right():
    to_stream = HallAxes("y", "right", 0.0, "far").to_stream()
    assert to_stream.apply(NORTH) == pytest.approx((1, 0, 0), abs=1e-12)
    assert to_stream.apply(UP) == pytest.approx((0, 1, 0), abs=1e-12)
    assert to_stream.apply(-WEST) == pytest.approx((0, 0, 1), abs=1e-12)


def test_up_is_the_axis_that_was_chosen_and_the_body_stands_on_its_tail():
    for axes in ALL:
        up = {"y": (0, 1, 0), "z": (0, 0, 1)}[axes.up_axis]
        assert axes.to_stream().apply(UP) == pytest.approx(up, abs=1e-12), axes
        assert np.linalg.det(axes.to_stream().as_matrix()) == pytest.approx(1.0)
        nose = axes.attitude_when_made().apply((1.0, 0.0, 0.0))
        assert nose == pytest.approx(UP, abs=1e-12), axes


def test_the_belly_points_to_the_side_that_was_chosen():
    belly = np.array((0.0, 0.0, -1.0))
    assert HallAxes(front="far").attitude_when_made().apply(belly) == pytest.approx(NORTH, abs=1e-12)
    assert HallAxes(front="left").attitude_when_made().apply(belly) == pytest.approx(WEST, abs=1e-12)
    assert HallAxes(east=90.0, front="far").attitude_when_made().apply(belly) == pytest.approx(-WEST, abs=1e-12)


# Disturbances that a person orders, by the command line and while it runs.


def test_it_lasts_from_its_start_to_its_end():
    planned = Disturbances((read_disturbance("lost@2+1.5"), read_disturbance("swap@3")))
    assert [planned.now(t) for t in (1.99, 2.0, 3.2, 3.5)] == [
        set(), {Trouble.LOST}, {Trouble.LOST, Trouble.SWAP}, {Trouble.SWAP}
    ]  # fmt: skip


@pytest.mark.parametrize(
    "text",
    ["", "lost", "lost@", "gone@1", "lost@-1", "lost@1+", "lost@1+2+3", "lost@1.2.3", "lost@9e9", "lost@2000000"],
)
def test_what_is_none_is_refused_and_shown(text):
    with pytest.raises(SitlError) as caught:
        read_disturbance(text)
    assert repr(text) in str(caught.value)


def test_a_line_that_is_typed_begins_and_ends_them():
    ordered = Disturbances()
    assert ordered.order("dropped 2", 10.0) == "dropped for 2 s"
    assert ordered.order("lost", 11.0) == "lost until ok"
    assert ordered.now(11.5) == {Trouble.DROPPED, Trouble.LOST}
    assert ordered.order("ok", 12.0) == "all disturbances ended"
    assert ordered.now(12.0) == set()


@pytest.mark.parametrize("words", ["what", "lost x", "lost -1", "@@@"])
def test_a_line_that_says_nothing_is_answered(words):
    ordered = Disturbances()
    assert "type lost, swap or dropped" in ordered.order(words, 1.0)
    assert ordered.now(1.0) == set()
