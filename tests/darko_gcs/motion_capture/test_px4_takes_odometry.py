"""A vehicle that only knows ODOMETRY gets what PX4 needs: frames, signs, times, variances, quality and resets."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from darko_gcs.motion_capture.pose_bridge import BridgeSettings
from darko_gcs.motion_capture.poses import ESTIMATORS, PoseAccuracy
from sitl.motion_capture.cameras import TrueMotion
from tests.support.motion_capture.px4_vehicle import Px4Vehicle
from tests.support.motion_capture.stream import BEGAN, Stream

SPEED, SPIN = np.array((1.0, 0.5, 0.2)), 0.6  # world NWU [m/s], about up [rad/s]
UPRIGHT = Rotation.from_euler("y", -90, degrees=True)


def climbing(t):
    """North-west and up, turning to the left on its tail."""
    return TrueMotion(t, SPEED * t, SPEED, Rotation.from_euler("z", SPIN * t) * UPRIGHT, np.array((SPIN, 0.0, 0.0)))


@pytest.fixture(scope="module")
def flown():
    vehicle = Px4Vehicle()
    stream = Stream(climbing, vehicle=vehicle, ideal=True, delay=0.02, jitter=0.002)
    stream.run(3.0)
    return stream, vehicle


@pytest.mark.long
def test_all_poses_arrive_for_the_mocap_topic_with_one_track(flown):
    _, vehicle = flown
    assert 570 < len(vehicle.samples) < 600
    assert {(s["topic"], s["resets"]) for s in vehicle.samples} == {("mocap", 0)}


@pytest.mark.long
def test_stamps_become_the_exposures_on_its_own_clock(flown):
    _, vehicle = flown
    synced = [s for s in vehicle.samples if s["is_synced"]]
    assert len(synced) > 300
    for sample in synced:
        exposed = sample["time"] - vehicle.ahead - BEGAN
        assert abs(exposed - round(200 * exposed) / 200) < 0.0015
        assert 0.018 < sample["arrived"] - sample["time"] < 0.035


def test_position_and_velocity_are_north_east_down(flown):
    _, vehicle = flown
    ned = SPEED * (1, -1, -1)
    for sample in [s for s in vehicle.samples if s["is_synced"]]:
        exposed = round(200 * (sample["time"] - vehicle.ahead - BEGAN)) / 200
        assert sample["position"] == pytest.approx(ned * exposed, abs=2e-3)
        assert sample["velocity"] == pytest.approx(ned, abs=0.02)


def test_the_attitude_is_that_of_the_hover_frame_level_and_turning_left(flown):
    _, vehicle = flown
    for sample in [s for s in vehicle.samples if s["is_synced"]]:
        exposed = round(200 * (sample["time"] - vehicle.ahead - BEGAN)) / 200
        yaw, pitch, roll = sample["attitude"].as_euler("ZYX")
        assert (roll, pitch) == pytest.approx((0.0, 0.0), abs=1e-3)
        assert yaw == pytest.approx(-SPIN * exposed, abs=2e-3)


def test_variances_and_quality_are_those_of_good_markers(flown):
    _, vehicle = flown
    sample = vehicle.samples[-1]
    assert sample["position_variance"] == pytest.approx([1e-6] * 3)
    assert sample["attitude_variance"] == pytest.approx([1e-4] * 3)
    assert sample["velocity_variance"] == pytest.approx([(math.sqrt(2) * 0.001 / 0.015) ** 2] * 3)
    assert 95 <= sample["quality"] <= 100


def test_to_ekf2_it_says_that_it_is_vision():
    vehicle = Px4Vehicle()
    settings = BridgeSettings(accuracy=PoseAccuracy(estimator=ESTIMATORS["vision"]))
    Stream(vehicle=vehicle, settings=settings).run(0.5)
    assert {s["topic"] for s in vehicle.samples} == {"visual"}


def test_after_a_loss_the_reset_counter_says_that_the_pose_may_differ():
    vehicle = Px4Vehicle()
    Stream(vehicle=vehicle, events=["lost@0.5+0.3"]).run(1.2)
    assert [s["resets"] for s in vehicle.samples][:: len(vehicle.samples) - 1] == [0, 1]
    gaps = np.diff([s["arrived"] for s in vehicle.samples])
    assert max(gaps) == pytest.approx(0.3, abs=0.02)


def test_bad_markers_are_told_by_variance_and_quality():
    vehicle = Px4Vehicle()
    Stream(vehicle=vehicle, noise=0.005).run(0.5)
    assert min(s["position_variance"][0] for s in vehicle.samples) > 1e-6
    assert np.mean([s["quality"] for s in vehicle.samples]) < 75
