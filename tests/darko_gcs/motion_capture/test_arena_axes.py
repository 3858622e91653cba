"""From Motive's axes to the vehicle's: every combination of the options, by hand and against the simulated Motive."""

import itertools
import math

import pytest
from scipy.spatial.transform import Rotation

from darko_gcs.motion_capture.arena_axes import AXES_OF_LABS, HALL_SIDES, ArenaAxes, AxesSettings
from protocol.frames import flip, flip_quaternion, hover_attitude
from sitl.motion_capture.cameras import HallAxes
from tests.support.motion_capture.hall import cameras, frames_of, motion

SIDES = tuple(HALL_SIDES)
ANGLES = (*HALL_SIDES.values(), -23.0, 57.3)
EVERY = [AxesSettings(*each) for each in itertools.product("yz", SIDES, ANGLES, SIDES)]
AS_MADE = (1.0, 0.0, 0.0, 0.0)
FACING = {"far": 0.0, "right": 90.0, "near": 180.0, "left": -90.0}  # azimuth from far, clockwise [deg]


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


@pytest.mark.parametrize("settings", EVERY, ids=str)
def test_a_place_of_the_hall_is_where_its_east_and_north_are(settings):
    east = math.radians(settings.x_angle)
    right, far, up = 3.0, 1.0, 2.0
    north, east_of_it, down = ArenaAxes(settings).pose(hall_place(settings, right, far, up), AS_MADE).position
    assert east_of_it == pytest.approx(right * math.cos(east) + far * math.sin(east))
    assert north == pytest.approx(-right * math.sin(east) + far * math.cos(east))
    assert down == pytest.approx(-up)


@pytest.mark.parametrize("settings", EVERY, ids=str)
def test_as_it_was_made_the_body_is_level_and_faces_the_side_that_was_told(settings):
    attitude = ArenaAxes(settings).pose((0.0, 0.0, 0.0), AS_MADE).attitude
    assert same_attitude(attitude, about_down(FACING[settings.nose] + settings.x_angle))  # north is x_angle left of far


@pytest.mark.parametrize("settings", EVERY, ids=str)
def test_a_vehicle_in_any_attitude_is_seen_as_it_is(settings):
    """The simulated Motive finds its axes by vectors, not by angles."""
    axes = HallAxes(settings.up_axis, settings.long_edge, settings.x_angle, settings.nose)
    true = motion(0.0, (1.0, -2.0, 0.7), Rotation.from_euler("zyx", (0.4, -1.1, 2.3)))
    frame = frames_of(cameras(axes, ideal=True, rate=100.0), 0.02, lambda t: true._replace(time=t))[0]
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
