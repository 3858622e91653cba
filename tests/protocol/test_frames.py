"""Coordinate frames: those the vehicle computes in, those on the wire, and the conversions."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocol import frames, names
from protocol.dialect import mavlink
from protocol.errors import LocalProtocolError
from protocol.frames import Geodetic, LocalFrame

SQRT_HALF = math.sqrt(0.5)
HOME = Geodetic(43.5648, 1.4811, 150.0)
angles = st.floats(-math.pi, math.pi)
pitches = st.floats(-1.5, 1.5)


def same_rotation(p, q):
    return abs(abs(np.dot(p, q)) - 1.0) < 1e-12


def test_north_west_up_becomes_north_east_down():
    assert frames.flip((1.0, 2.0, 3.0)) == (1.0, -2.0, -3.0)


@given(st.tuples(*[st.floats(-1e6, 1e6)] * 3))
def test_flipping_twice_is_the_identity(v):
    assert frames.flip(frames.flip(v)) == v


@given(angles, pitches, angles, st.tuples(*[st.floats(-10, 10)] * 3))
def test_flipping_the_attitude_is_flipping_both_of_its_frames(roll, pitch, yaw, v):
    """R_NED,FRD = F R_NWU,FLU F with F = diag(1, -1, -1)."""
    q = frames.quaternion_from_euler(roll, pitch, yaw)
    through = frames.flip(frames.rotate(frames.flip_quaternion(q), frames.flip(v)))
    assert frames.rotate(q, v) == pytest.approx(through, abs=1e-9)


def test_a_nose_up_hover_has_pitch_plus_ninety():
    """The report's hover attitude (1, 0, -1, 0)/sqrt 2 in NWU/FLU."""
    roll, pitch, yaw = frames.euler_from_quaternion(frames.flip_quaternion((SQRT_HALF, 0.0, -SQRT_HALF, 0.0)))
    assert (roll, yaw) == (0.0, 0.0)
    assert math.degrees(pitch) == pytest.approx(90.0)


@pytest.mark.parametrize("heading_deg", [0.0, 35.0, 170.0, 200.0, 359.0])
def test_hover_turned_about_the_vertical_shows_that_heading(heading_deg):
    psi = math.radians(heading_deg)
    about_up = (math.cos(psi / 2), 0.0, 0.0, -math.sin(psi / 2))  # NWU: up, so clockwise is negative
    q = frames.flip_quaternion(frames.multiply(about_up, (SQRT_HALF, 0.0, -SQRT_HALF, 0.0)))
    assert math.degrees(frames.heading(q)) % 360.0 == pytest.approx(heading_deg, abs=1e-9)
    _, pitch, yaw = frames.euler_from_quaternion(q)
    assert math.degrees(pitch) == pytest.approx(90.0, abs=1e-5)
    assert math.degrees(yaw) % 360.0 == pytest.approx(heading_deg, abs=1e-5)


def test_a_hover_is_shown_level_in_the_hover_frame_and_upright_in_the_flying_one():
    q = frames.flip_quaternion((SQRT_HALF, 0.0, -SQRT_HALF, 0.0))
    assert frames.displayed(q, frames.SHOW_PITCHED_DOWN) == pytest.approx((1.0, 0.0, 0.0, 0.0))
    assert frames.displayed(q, frames.SHOW_AS_TOLD) == pytest.approx(q)
    assert frames.displayed(q, (0.0, 0.0, 0.0, 0.0)) == pytest.approx(q)


def test_flying_frame_is_what_a_hover_frame_attitude_shows_with_the_field_s_offset():
    """The specification's example: attitude in the hover frame, offset (0.7071, 0, 0.7071, 0) in forward flight."""
    flying = frames.quaternion_from_euler(0.1, 0.2, 0.3)
    hover = frames.displayed(flying, frames.SHOW_PITCHED_DOWN)
    assert frames.displayed(hover, (SQRT_HALF, 0.0, SQRT_HALF, 0.0)) == pytest.approx(flying)


@given(angles, pitches, angles)
def test_the_two_body_frames_lead_to_each_other(roll, pitch, yaw):
    q, v = frames.quaternion_from_euler(roll, pitch, yaw), (roll, pitch, yaw)
    assert frames.flying_attitude(frames.hover_attitude(q)) == pytest.approx(q, abs=1e-12)
    assert frames.flying_axes(frames.hover_axes(v)) == v
    in_hover = frames.rotate(frames.hover_attitude(q), frames.hover_axes(v))
    assert in_hover == pytest.approx(frames.rotate(q, v), abs=1e-9)


@given(angles, pitches, angles)
def test_euler_angles_and_quaternions_are_each_other_s_inverse(roll, pitch, yaw):
    q = frames.quaternion_from_euler(roll, pitch, yaw)
    assert same_rotation(q, frames.quaternion_from_euler(*frames.euler_from_quaternion(q)))


@given(angles, st.sampled_from([-math.pi / 2, math.pi / 2]), angles)
def test_at_pitch_plus_minus_ninety_roll_is_zero_and_the_rotation_is_kept(roll, pitch, yaw):
    q = frames.quaternion_from_euler(roll, pitch, yaw)
    shown = frames.euler_from_quaternion(q)
    assert np.allclose(np.abs(np.dot(q, frames.quaternion_from_euler(*shown))), 1.0, atol=1e-9)


def test_roll_right_pitch_up_and_yaw_right_are_positive():
    right_wing = frames.rotate(frames.quaternion_from_euler(0.1, 0.0, 0.0), (0.0, 1.0, 0.0))
    nose_up = frames.rotate(frames.quaternion_from_euler(0.0, 0.1, 0.0), (1.0, 0.0, 0.0))
    nose_right = frames.rotate(frames.quaternion_from_euler(0.0, 0.0, 0.1), (1.0, 0.0, 0.0))
    assert right_wing[2] > 0.0 > nose_up[2]
    assert nose_right[1] > 0.0


@given(st.floats(-1.55, 1.55), angles)
def test_without_roll_the_heading_does_not_depend_on_pitch(pitch, yaw):
    q = frames.quaternion_from_euler(0.0, pitch, yaw)
    assert abs(math.remainder(frames.heading(q) - yaw, 2 * math.pi)) < 1e-6


@pytest.mark.parametrize(
    ("pitch_deg", "heading_deg"),
    [(44.9, 0.0), (45.1, 270.0), (60.0, 270.0), (-44.9, 0.0), (-45.1, 90.0), (-60.0, 90.0)],
)
def test_above_45_degrees_the_heading_is_that_of_the_belly_and_nose_down_that_of_the_back(pitch_deg, heading_deg):
    """Rolled right by 90 degrees with the nose north: the belly is west, the back east."""
    q = frames.quaternion_from_euler(math.pi / 2, math.radians(pitch_deg), 0.0)
    turn = frames.heading(q) - math.radians(heading_deg)
    assert math.remainder(turn, 2.0 * math.pi) == pytest.approx(0.0, abs=1e-9)


@given(angles, pitches, angles)
def test_a_heading_is_from_zero_to_a_full_turn(roll, pitch, yaw):
    assert 0.0 <= frames.heading(frames.quaternion_from_euler(roll, pitch, yaw)) <= 2.0 * math.pi


@given(*[st.floats(-2000.0, 2000.0)] * 3)
def test_local_to_geodetic_and_back_loses_less_than_a_millimetre_within_two_kilometres(north, east, down):
    frame = LocalFrame(HOME)
    assert math.dist(frame.to_ned(frame.to_geodetic((north, east, down))), (north, east, down)) < 1e-3


def test_north_is_latitude_east_is_longitude_and_up_is_altitude():
    frame = LocalFrame(HOME)
    north, east, up = (frame.to_geodetic(v) for v in ((100.0, 0.0, 0.0), (0.0, 100.0, 0.0), (0.0, 0.0, -100.0)))
    assert north.lat_deg > HOME.lat_deg
    assert north.lon_deg == HOME.lon_deg
    assert east.lon_deg > HOME.lon_deg
    assert up == Geodetic(HOME.lat_deg, HOME.lon_deg, 250.0)


def test_a_degree_has_the_length_of_the_ellipsoid():
    """WGS84: 111 132.954 - 559.822 cos 2 phi + 1.175 cos 4 phi m of latitude per degree; at sea level."""
    phi = math.radians(45.0)
    series = 111132.954 - 559.822 * math.cos(2 * phi) + 1.175 * math.cos(4 * phi)
    north, east, _ = LocalFrame(Geodetic(45.0, 0.0, 0.0)).to_ned(Geodetic(46.0, 1.0, 0.0))
    assert north == pytest.approx(series, rel=1e-5)
    assert east == pytest.approx(78846.8, rel=1e-5)  # one degree of longitude at 45 deg


def test_longitude_wraps_at_the_date_line():
    frame = LocalFrame(Geodetic(0.0, 179.9999, 0.0))
    _, east, _ = frame.to_ned(Geodetic(0.0, -179.9999, 0.0))
    assert 0.0 < east < 30.0
    assert frame.to_geodetic((0.0, east, 0.0)).lon_deg == pytest.approx(-179.9999)


@pytest.mark.parametrize("origin", [Geodetic(90.0, 0.0, 0.0), Geodetic(math.nan, 0.0, 0.0), Geodetic(0.0, 200.0, 0.0)])
def test_no_local_frame_at_the_poles_or_off_the_globe(origin):
    with pytest.raises(LocalProtocolError):
        LocalFrame(origin)


ALTITUDES = (names.ABSOLUTE_ALTITUDE_FRAMES, names.RELATIVE_ALTITUDE_FRAMES)


@pytest.mark.parametrize(
    "name", [entry.name for entry in mavlink.enums["MAV_FRAME"].values() if "_GLOBAL" in entry.name]
)
def test_every_global_frame_has_latitude_and_longitude(name):
    assert names.is_global_frame(getattr(mavlink, name))


@pytest.mark.parametrize("name", ["LOCAL_NED", "LOCAL_ENU", "MISSION", "BODY_NED", "LOCAL_OFFSET_NED", "BODY_FRD"])
def test_no_other_frame_has(name):
    assert not names.is_global_frame(getattr(mavlink, f"MAV_FRAME_{name}"))


def test_an_altitude_counts_from_one_level_only():
    assert ALTITUDES[0].isdisjoint(ALTITUDES[1])
    assert ALTITUDES[0] | ALTITUDES[1] < names.GLOBAL_FRAMES


def test_a_frame_with_int_in_its_name_means_the_same():
    numbers = {entry.name: number for number, entry in mavlink.enums["MAV_FRAME"].items()}
    pairs = [(numbers[name], numbers[f"{name}_INT"]) for name in numbers if f"{name}_INT" in numbers]
    assert len(pairs) == 3
    for plain, integer in pairs:
        assert [plain in group for group in ALTITUDES] == [integer in group for group in ALTITUDES]
