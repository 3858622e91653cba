"""Increments of inertial readings: a group, exact where the motion is simple, and rebiased to first order."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sitl.estimation.strapdown import Increment, increment_of, joined, moved_by, no_increment, rebiased, without
from sitl.model.quaternions import Quaternion, from_euler, hover, normalised, rotate
from sitl.model.vectors import Vector
from sitl.sensors.draws import PERIOD

G = 9.81
STILL = Vector(0.0, 0.0, 0.0)
ONE = Quaternion(1.0, 0.0, 0.0, 0.0)
few = st.floats(-20.0, 20.0)
vectors = st.builds(Vector, few, few, few)
attitudes = st.builds(from_euler, st.floats(-3.0, 3.0), st.floats(-1.5, 1.5), st.floats(-3.0, 3.0))
increments = st.builds(Increment, attitudes, vectors, vectors, st.floats(0.0, 0.5))


def flat(i):
    """Numbers of an increment; the rotation's sign means nothing."""
    sign = 1.0 if np.dot(i.rotation, ONE) >= 0.0 else -1.0
    return [*(sign * x for x in i.rotation), *i.velocity, *i.position, i.time]


def after(rates, force, seconds, biases=(STILL, STILL)):
    """The increment of constant readings, biases taken off."""
    whole = no_increment()
    for _ in range(round(seconds / PERIOD)):
        gyro, accel = (Vector(*np.subtract(read, bias)) for read, bias in zip((rates, force), biases, strict=True))
        whole = joined(whole, increment_of(gyro, accel, PERIOD))
    return whole


@given(increments, increments)
def test_what_was_joined_first_is_taken_off_again(first, then):
    assert flat(without(first, joined(first, then))) == pytest.approx(flat(then), abs=1e-12, rel=1e-12)


@given(increments, increments, increments)
def test_it_does_not_matter_which_two_are_joined_first(a, b, c):
    assert flat(joined(joined(a, b), c)) == pytest.approx(flat(joined(a, joined(b, c))), abs=1e-11, rel=1e-11)


@given(increments)
def test_nothing_changes_nothing(i):
    assert flat(joined(i, no_increment())) == pytest.approx(flat(i))
    assert flat(joined(no_increment(), i)) == pytest.approx(flat(i))
    assert flat(without(i, i)) == pytest.approx(flat(no_increment()), abs=1e-11)


@given(increments, increments, vectors, vectors, attitudes)
def test_a_joined_increment_moves_as_its_parts_do_one_after_another(first, then, p, v, q):
    step = moved_by(then, *moved_by(first, p, v, q, G), G)
    whole = moved_by(joined(first, then), p, v, q, G)
    for one, other in zip(step, whole, strict=True):
        assert one == pytest.approx(other, abs=1e-10, rel=1e-11)


def test_in_free_fall_it_falls():
    p, v, q = moved_by(after(STILL, STILL, 1.0), Vector(1.0, 2.0, 50.0), Vector(3.0, 0.0, 1.0), hover(0.3), G)
    assert p == pytest.approx((4.0, 2.0, 51.0 - 0.5 * G))
    assert v == pytest.approx((3.0, 0.0, 1.0 - G))
    assert q == pytest.approx(hover(0.3))


def test_what_is_held_up_stays_where_it_is():
    q = from_euler(0.4, -1.1, 2.0)
    up = rotate(normalised(Quaternion(q.w, -q.x, -q.y, -q.z)), Vector(0.0, 0.0, G))
    p, v, _ = moved_by(after(STILL, up, 1.0), Vector(1.0, 2.0, 3.0), STILL, q, G)
    assert p == pytest.approx((1.0, 2.0, 3.0), abs=1e-9)
    assert v == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)


def test_a_constant_rate_turns_by_its_angle():
    i = after(Vector(0.0, 0.0, 1.5), STILL, 1.0)
    assert i.rotation == pytest.approx((math.cos(0.75), 0.0, 0.0, math.sin(0.75)))


def test_flown_round_a_circle_it_comes_back():
    """A force across that turns with the body: x = v / w sin(w t), y = v / w (1 - cos(w t)) with w v felt."""
    rate, speed, seconds = 2.0 * math.pi, 3.0, 1.0
    i = after(Vector(0.0, 0.0, rate), Vector(0.0, rate * speed, 0.0), seconds)
    p, v, _ = moved_by(i, STILL, Vector(speed, 0.0, 0.0), ONE, 0.0)
    # Steps of a period are wrong by its square: (2 pi 2 ms)^2 / 24 of 3 m/s.
    assert v == pytest.approx((speed, 0.0, 0.0), abs=1e-3)
    assert p == pytest.approx((0.0, 0.0, 0.0), abs=1e-3)
    half, _, _ = moved_by(
        after(Vector(0.0, 0.0, rate), Vector(0.0, rate * speed, 0.0), 0.5), STILL, Vector(speed, 0.0, 0.0), ONE, 0.0
    )
    assert half == pytest.approx((0.0, 2.0 * speed / rate, 0.0), abs=2e-3)


def test_biases_found_later_are_taken_off_to_first_order():
    """Against the same readings gathered anew: what is left shrinks with the square of the biases and the time."""
    rates, force = Vector(0.4, -0.7, 0.3), Vector(9.0, 1.0, -3.0)
    gyro, accel = Vector(0.02, -0.01, 0.015), Vector(0.1, -0.2, 0.15)
    gathered = after(rates, force, 0.01)
    exact = after(rates, force, 0.01, (gyro, accel))
    quick = rebiased(gathered, gyro, accel)
    assert np.subtract(flat(quick), flat(exact)) == pytest.approx(np.zeros(11), abs=2e-5)
    off = np.abs(np.subtract(flat(gathered), flat(exact)))
    assert off[1:4].max() > 5e-5  # what was taken off is more than what is left
    assert off[4:7].max() > 1e-3
    left = np.abs(np.subtract(flat(quick), flat(exact)))
    assert left[1:4].max() < 1e-6
    assert left[7:10].max() < 1e-6
