"""Poses and satellites that tell a wrong place: what is still believed of them, and when they are again."""

import numpy as np
import pytest

from sitl.estimation.arrivals import LANDED_TIME, REFUSED_TIME
from sitl.estimation.filter import put_nominal
from sitl.estimation.fusion import RIGHT_AGAIN, SATELLITE_VELOCITY
from sitl.estimation.nominal_state import ATTITUDE_ERROR, POSITION_ERROR, VELOCITY_ERROR
from sitl.estimation.observations import (
    NO_POSE_TIME,
    STANDING_SPEED_DEVIATION,
    STANDING_VERTICAL_SPEED,
    observe_standing,
)
from sitl.model.quaternions import hover, multiply, small_rotation
from sitl.model.vectors import Vector
from sitl.sensors.draws import PERIOD
from sitl.sensors.instruments import FIRST_DELAYED, GNSS, MOTION_CAPTURE
from sitl.storage import value_of
from tests.sitl.estimation.test_arrivals import BEGIN, EVERY, flown, heard

POSE, SATELLITES = MOTION_CAPTURE - FIRST_DELAYED, GNSS - FIRST_DELAYED
STEPS = round(REFUSED_TIME / PERIOD / EVERY) + 2  # readings until what is refused is judged


def indoors():
    """Instruments and a filter whose poses were right just before, in the air."""
    i, f = flown(arena=True)
    put_nominal(f, value_of(f.nominal)._replace(attitude=hover(0.0)))
    f["covariance"][:] *= 1e-4
    f["on_ground"], f["fused_at"][POSE] = False, BEGIN - EVERY
    return i, f


def posed(i, f, k, x, *, turn=0.0):
    """A pose ``x`` ahead of the belief and turned from it."""
    q = multiply(value_of(f.nominal).attitude, small_rotation(Vector(turn, 0.0, 0.0)))
    heard(i, f, MOTION_CAPTURE, BEGIN + EVERY * k, x + 1e-5 * (k % 3), 0.0, 0.0, *q, 1e-6, 1e-5, 1.0)


def test_an_attitude_alone_is_no_help_with_the_place_and_is_believed_beside_a_place_that_leapt():
    i, f = indoors()
    for k in range(STEPS):
        posed(i, f, k, 12.0, turn=1e-4)
    assert f["fused_at"][POSE] == BEGIN - EVERY
    assert np.diag(f["covariance"])[ATTITUDE_ERROR] < 0.9e-6
    assert f["failed"][MOTION_CAPTURE] == 1.0
    assert f["resets"] == 0


def test_a_place_that_leapt_is_not_let_in_by_a_belief_that_becomes_less_sure():
    i, f = indoors()
    for k in range(STEPS):
        posed(i, f, k, 12.0)
    f["covariance"][POSITION_ERROR, POSITION_ERROR] = 100.0
    again = round(RIGHT_AGAIN / PERIOD / EVERY)
    for k in range(STEPS, STEPS + again):
        posed(i, f, k, 12.0)
        assert value_of(f.nominal).position.x == 0.0
    posed(i, f, STEPS + again, 12.0)
    assert value_of(f.nominal).position.x == pytest.approx(12.0, abs=0.1)
    assert f["failed"][MOTION_CAPTURE] == 0.0


def test_its_attitude_has_to_agree_as_long():
    i, f = indoors()
    for k in range(STEPS):
        posed(i, f, k, 12.0)
    f["covariance"][POSITION_ERROR, POSITION_ERROR] = 100.0
    for k in range(STEPS, STEPS + round(1.5 * RIGHT_AGAIN / PERIOD / EVERY)):
        posed(i, f, k, 12.0, turn=0.3)
    assert value_of(f.nominal).position.x == 0.0


@pytest.mark.parametrize(("place_from", "turn_from", "failed"), [(0, 3, True), (3, 0, False), (0, 99, False)])
def test_poses_are_wrong_whose_places_go_astray_before_their_attitudes(place_from, turn_from, failed):
    i, f = indoors()
    f["fused_at"][POSE] = BEGIN - 1000.0  # nothing leaps
    for k in range(STEPS + 3):
        posed(i, f, k, 0.015 * (k >= place_from), turn=0.05 * (k >= turn_from))
    assert bool(f["failed"][MOTION_CAPTURE]) == failed
    assert bool(f["resets"]) != failed


def test_while_it_is_not_known_which_of_them_is_wrong_a_pose_does_not_turn_the_belief():
    i, f = indoors()
    f["fused_at"][POSE] = BEGIN - 1000.0
    before = value_of(f.nominal).attitude
    for k in range(5):
        posed(i, f, k, 0.2, turn=0.005)
    assert value_of(f.nominal).attitude == before
    posed(i, f, 30, 0.0, turn=0.005)
    assert value_of(f.nominal).attitude != before


def test_on_the_ground_poses_are_believed_that_were_not_in_the_air():
    i, f = indoors()
    for k in range(STEPS):
        posed(i, f, k, 12.0)
    f["standing_time"] = LANDED_TIME
    posed(i, f, STEPS, 12.0)
    assert value_of(f.nominal).position.x == pytest.approx(12.0, abs=0.1)
    assert (f["failed"][MOTION_CAPTURE], f["resets"]) == (0.0, 1)


@pytest.mark.parametrize(("speed", "failed"), [(0.0, False), (5.0, True)])
def test_a_receiver_whose_place_leapt_is_believed_by_its_velocity_until_that_is_refused(speed, failed):
    i, f = flown()
    f["fused_at"][SATELLITES] = BEGIN - EVERY
    for k in range(STEPS):
        heard(i, f, GNSS, BEGIN + EVERY * k, 60.0 + 0.01 * k, 0.0, 0.0, speed, 0.01 * (k % 2), 0.0)
    assert bool(f["failed"][GNSS]) == failed
    now = BEGIN + EVERY * STEPS
    f["refused_at"][SATELLITE_VELOCITY] = now - round(5.0 / PERIOD)  # it has agreed since
    heard(i, f, GNSS, now, 60.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    assert (f["fused_at"][SATELLITES] == now) != failed


def standing(*, untold=NO_POSE_TIME, arena=True, speed=STANDING_VERTICAL_SPEED, on_ground=True, doubt=0.1):
    """Upward speed that is believed after a second on the ground, or of what is none."""
    _, f = flown(arena=arena)
    put_nominal(f, value_of(f.nominal)._replace(velocity=Vector(0.3, 0.0, speed)))
    for k in range(VELOCITY_ERROR, VELOCITY_ERROR + 3):
        f["covariance"][k, k] = doubt * doubt
    f["on_ground"], f["fused_at"][:] = on_ground, BEGIN - untold / PERIOD
    for _ in range(100):
        observe_standing(f, BEGIN)
    assert f["standing_time"] == pytest.approx(1.0 if on_ground else 0.0)
    return value_of(f.nominal).velocity.z


def test_what_the_ground_stops_and_nothing_has_told_its_place_stands_still():
    assert abs(standing()) < STANDING_VERTICAL_SPEED / 2.0
    assert abs(standing(speed=-1.9, doubt=1.0)) < STANDING_SPEED_DEVIATION / 5.0


@pytest.mark.parametrize(
    "other", [{"untold": NO_POSE_TIME - 0.1}, {"arena": False}, {"speed": 1.1}, {"speed": -1.1}, {"on_ground": False}]
)
def test_what_is_told_its_place_or_sinks_on_or_flies_outdoors_does_not(other):
    assert standing(**other) == other.get("speed", STANDING_VERTICAL_SPEED)
