"""The simulated camera: when it takes images, where it looks, and what it keeps."""

import math
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocol.frames import euler_from_quaternion
from sitl.autopilot import camera as device
from sitl.autopilot.camera import Camera, Mount, YawFrom
from sitl.guidance.view import VehicleView

TICK = 0.02  # [s]
FACING_NORTH_UPRIGHT = (math.sqrt(0.5), 0.0, -math.sqrt(0.5), 0.0)  # nose up, belly to the north; FLU -> NWU
FLYING_NORTH = (1.0, 0.0, 0.0, 0.0)


def view(time, p=(0.0, 0.0, 30.0), v=(0.0, 0.0, 0.0), heading=0.0, attitude=FLYING_NORTH):
    return VehicleView(time, p, v, heading, 0.0, False, 1.0, attitude=attitude)


def fly(camera, seconds, speed=15.0, start=0.0):
    """Straight north; gives the places of the images."""
    for tick in range(round(seconds / TICK) + 1):
        time = start + tick * TICK
        camera.update(view(time, (speed * time, 0.0, 30.0), (speed, 0.0, 0.0)))
    return [capture.p[0] for capture in camera.captures]


@given(distance=st.floats(2.5, 60.0), speed=st.floats(0.5, 22.0), at_once=st.booleans())
def test_images_by_distance_are_that_far_apart(distance, speed, at_once):
    camera = Camera()
    camera.trigger_by_distance(distance, at_once=at_once)
    seconds = 3.5 * distance / speed
    norths = fly(camera, seconds, speed)
    expected = [k * distance for k in range(0 if at_once else 1, 4)]
    assert norths == pytest.approx(expected, abs=0.01)


def test_images_nearer_than_the_camera_can_are_taken_as_fast_as_it_can():
    camera = Camera()
    camera.trigger_by_distance(0.5, at_once=True)
    assert len(fly(camera, 2.0, 10.0)) in {20, 21}  # the last is due at the last tick
    times = [capture.time for capture in camera.captures]
    assert min(b - a for a, b in pairwise(times)) >= device.MIN_INTERVAL - 1e-6


def test_distance_nought_ends_the_images():
    camera = Camera()
    camera.trigger_by_distance(10.0, at_once=True)
    fly(camera, 1.0)
    camera.trigger_by_distance(0.0, at_once=False)
    assert len(fly(camera, 5.0, start=1.02)) == 2


@given(interval=st.floats(0.1, 5.0), count=st.integers(2, 6))
def test_images_by_time_come_at_their_times_and_end(interval, count):
    camera = Camera()
    camera.capture(interval, count)
    fly(camera, (count + 1) * interval)
    assert [capture.time for capture in camera.captures] == pytest.approx(
        [k * interval for k in range(count)], abs=1e-6
    )
    assert camera.remaining == 0


def test_images_by_time_without_a_number_go_on_until_they_are_stopped():
    camera = Camera()
    camera.capture(0.5, 0)
    fly(camera, 10.0)
    assert len(camera.captures) == 21
    camera.stop_capture()
    assert len(fly(camera, 5.0, start=10.02)) == 21


def test_one_image_disturbs_no_series():
    camera = Camera()
    camera.trigger_by_distance(20.0, at_once=False)
    fly(camera, 1.0)
    camera.take_image()
    assert fly(camera, 1.0, start=1.02) == pytest.approx([15.3, 20.0], abs=0.4)


def test_what_a_mission_triggers_waits_while_that_is_left():
    camera = Camera()
    camera.trigger_by_distance(10.0, at_once=False, by_mission=True)
    camera.leave_mission()
    assert fly(camera, 4.0) == []
    camera.resume_mission()
    assert fly(camera, 1.0, start=4.02) == pytest.approx([70.3], abs=0.1)
    camera.begin_mission()
    assert camera.distance == 0.0


def test_what_an_operator_triggers_goes_on_without_the_mission():
    camera = Camera()
    camera.trigger_by_distance(10.0, at_once=False)
    camera.leave_mission()
    camera.begin_mission()
    assert len(fly(camera, 1.0)) == 1


@pytest.mark.parametrize(
    ("attitude", "pitch"), [(FACING_NORTH_UPRIGHT, 0.0), (FLYING_NORTH, -math.pi / 2)], ids=["hover", "forward"]
)
def test_it_looks_out_of_the_belly(attitude, pitch):
    looking = euler_from_quaternion(Camera().attitude((0.0, 0.0, 5.0), view(0.0, attitude=attitude)))
    assert looking == pytest.approx((0.0, pitch, 0.0), abs=1e-9)


@pytest.mark.parametrize(("base", "yaw"), [(YawFrom.HEADING, -20.0), (YawFrom.COURSE, 100.0), (YawFrom.NORTH, 10.0)])
def test_a_mount_holds_its_angles_level(base, yaw):
    camera = Camera(mount=Mount(math.radians(-45.0), math.radians(10.0), base))
    seen = view(0.0, v=(0.0, -5.0, 0.0), heading=math.radians(30.0))  # flying east, the heading 30 deg anticlockwise
    roll, pitch, looking = map(math.degrees, euler_from_quaternion(camera.attitude(seen.p, seen)))
    assert (roll, pitch, looking) == pytest.approx((0.0, -45.0, yaw))


def test_it_looks_at_a_place():
    camera = Camera(mount=Mount(0.0, 0.0))
    angles = euler_from_quaternion(camera.attitude((0.0, 0.0, 30.0), view(0.0), (0.0, -30.0, 0.0)))
    assert tuple(map(math.degrees, angles)) == pytest.approx((0.0, -45.0, 90.0))


def test_a_full_storage_keeps_nothing_and_says_so():
    camera = Camera(count=int(device.STORAGE_SIZE / device.IMAGE_SIZE) - 1)
    camera.capture(1.0, 3)
    fly(camera, 4.0)
    assert [capture.is_stored for capture in camera.captures] == [True, False, False]
    assert camera.free == 0.0


def test_only_the_latest_images_are_kept():
    camera = Camera()
    camera.capture(0.1, 0)
    fly(camera, 0.1 * (device.MAX_KEPT + 10))
    assert len(camera.kept) == device.MAX_KEPT
    assert max(camera.kept) == camera.count - 1
