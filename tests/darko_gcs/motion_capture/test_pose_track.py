"""The track of a body: velocity from its last positions, and poses that cannot be."""

import math

import pytest

from darko_gcs.motion_capture.poses import Pose, PoseTrack

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
