"""Axes of the stream, from the calibration of Motive."""

import itertools

import numpy as np
import pytest

from sitl.motion_capture.cameras import SIDES, HallAxes

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


@pytest.mark.parametrize("axes", ALL, ids=str)
def test_up_is_the_axis_that_was_chosen_and_the_body_stands_on_its_tail(axes):
    up = {"y": (0, 1, 0), "z": (0, 0, 1)}[axes.up_axis]
    assert axes.to_stream().apply(UP) == pytest.approx(up, abs=1e-12)
    assert np.linalg.det(axes.to_stream().as_matrix()) == pytest.approx(1.0)
    nose = axes.attitude_when_made().apply((1.0, 0.0, 0.0))
    assert nose == pytest.approx(UP, abs=1e-12)


def test_the_belly_points_to_the_side_that_was_chosen():
    belly = np.array((0.0, 0.0, -1.0))
    assert HallAxes(front="far").attitude_when_made().apply(belly) == pytest.approx(NORTH, abs=1e-12)
    assert HallAxes(front="left").attitude_when_made().apply(belly) == pytest.approx(WEST, abs=1e-12)
    assert HallAxes(east=90.0, front="far").attitude_when_made().apply(belly) == pytest.approx(-WEST, abs=1e-12)
