"""The rigid body: the pose that fits its markers, what is taken for it, and files that are refused."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from sitl.motion_capture.rigid_body import RigidBodyError, load_rigid_body, pose_by_markers

BODY = load_rigid_body()
MARKER = '[markers.{}]\nvalue = {}\nunit = "m"\nsource = "measured"\n'
HEAD = '[body]\nname = "Kite"\nnumber = 7\n'
THREE = "".join(
    MARKER.format(name, place) for name, place in (("a", [0, 0, 0]), ("b", [0.1, 0, 0]), ("c", [0, 0.2, 0]))
)
angles = st.floats(-3.0, 3.0)


@given(angles, angles, angles, st.tuples(*[st.floats(-5.0, 5.0)] * 3))
def test_the_pose_of_markers_is_that_of_the_body_that_has_them(a, b, c, place):
    turned = Rotation.from_euler("zyx", (a, b, c))
    pose = pose_by_markers(turned.apply(BODY.markers) + place, BODY.markers)
    assert pose.position == pytest.approx(place, abs=1e-9)
    assert (pose.attitude * turned.inv()).magnitude() < 1e-6
    assert pose.marker_error < 1e-9


def test_the_marker_error_is_the_mean_distance_that_no_pose_explains():
    stretched = 1.1 * (BODY.markers - BODY.markers.mean(axis=0))
    expected = 0.1 / 1.1 * np.linalg.norm(stretched, axis=1).mean()
    assert pose_by_markers(stretched, BODY.markers).marker_error == pytest.approx(expected, rel=1e-3)


def test_markers_in_the_order_most_easily_confused_turn_the_shipped_body_half_round_and_hardly_tell():
    order = list(BODY.swapped())
    pose = pose_by_markers(BODY.markers[order], BODY.markers)
    assert order != sorted(order)
    assert pose.attitude.magnitude() > math.radians(175.0)
    assert 1e-3 < pose.marker_error < 2e-3


def test_the_attitude_s_spread_is_that_of_many_poses():
    draws, noise = np.random.default_rng(1), 1e-3
    seen = [BODY.markers + noise * draws.standard_normal(BODY.markers.shape) for _ in range(800)]
    turns = np.array([pose_by_markers(each, BODY.markers).attitude.as_rotvec() for each in seen])
    assert turns.std(axis=0) == pytest.approx(BODY.attitude_spread(noise), rel=0.15)


def test_a_file_states_another_body(tmp_path):
    (tmp_path / "kite.toml").write_text(HEAD + THREE)
    body = load_rigid_body(str(tmp_path / "kite.toml"))
    assert (body.name, body.number, body.marker_names) == ("Kite", 7, ("a", "b", "c"))


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("[body", "not a TOML file"),
        (HEAD, "must have the tables"),
        (HEAD.replace("Kite", "") + THREE, "must have name"),
        (HEAD.replace("7", "0") + THREE, "body.number = 0 is not from 1"),
        (HEAD.replace("7", "true") + THREE, "body.number = True is not from 1"),
        (HEAD + MARKER.format("a", [0, 0, 0]), "1 markers; from 3 to 8"),
        (HEAD + THREE.replace("[0, 0.2, 0]", "[0.3, 0, 0]"), "lie on a line"),
        (HEAD + THREE.replace("[0, 0.2, 0]", "[0.3, 0]"), "markers.c = [0.3, 0] is not three numbers"),
        (HEAD + THREE.replace("0.2", "nan"), "is not three numbers"),
        (HEAD + THREE.replace('"m"', '"mm"'), "markers.a is in 'mm'"),
        (HEAD + THREE.replace("measured", ""), "markers.a names no source"),
        (HEAD + THREE.replace("unit", "units"), "markers.a must be"),
    ],
)
def test_a_file_that_is_no_body_is_refused_with_its_reason(tmp_path, text, reason):
    file = tmp_path / "kite.toml"
    file.write_text(text)
    with pytest.raises(RigidBodyError) as caught:
        load_rigid_body(str(file))
    assert str(file) in str(caught.value)
    assert reason in str(caught.value)


def test_a_file_that_is_not_there_is_named():
    with pytest.raises(RigidBodyError, match="No such file"):
        load_rigid_body("/nowhere/kite.toml")
