"""The law of a vehicle that stands: carried upright after the touch, then idle."""

import math

import pytest

from sitl.control import landed
from sitl.control.hover_zero_moment import Pointing
from sitl.model.quaternions import from_euler, hover, multiply
from sitl.model.vectors import Vector
from tests.sitl.control.test_align import DT, GAINS, A, estimate

WEIGHT = GAINS.m * GAINS.g
IDLE = (0.0, 0.0, 0.0, 0.0)


def _step(force, *, velocity=(0.0, 0.0, 0.0), attitude=None, on_ground=True):
    seen = estimate((0.0, 0.0, 0.1), velocity, attitude or hover(0.0))._replace(on_ground=on_ground)
    return landed.step(seen, GAINS, A, Pointing(hover(0.0), force), DT)


def test_after_the_touch_most_of_the_weight_is_carried_for_a_moment():
    force, ticks = landed.CARRIED * WEIGHT, 0
    while (tick := _step(force))[0] != IDLE:
        force, ticks = tick[2].force, ticks + 1
    assert ticks * DT == pytest.approx(landed.CARRYING_TIME, abs=2 * DT)


def test_what_bounces_is_carried_for_longer():
    on, off = (_step(landed.CARRIED * WEIGHT, on_ground=touches)[2].force for touches in (True, False))
    lost, lost_in_the_air = landed.CARRIED * WEIGHT - on, landed.CARRIED * WEIGHT - off
    assert lost > 0.0
    assert lost_in_the_air == pytest.approx(landed.BOUNCE_RATE * lost)


def test_a_vehicle_that_stands_stays_idle():
    assert _step(0.0)[0] == IDLE


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_it_leans_against_the_drift_and_back_from_a_tilt(sign):
    # At heading 0 the belly looks north: nose to the north is a pitch forward, which the elevons' mean makes.
    drifting, _, _ = _step(0.85 * WEIGHT, velocity=(0.5 * sign, 0.0, 0.0))
    tilted, _, _ = _step(0.85 * WEIGHT, attitude=multiply(from_euler(0.0, 0.1 * sign, 0.0), hover(0.0)))
    assert math.copysign(1.0, drifting[2]) == math.copysign(1.0, tilted[2]) != 0.0
    assert drifting[2] == pytest.approx(drifting[3])


def test_the_lean_is_bounded():
    slow, fast = (_step(0.85 * WEIGHT, velocity=(0.0, speed, 0.0))[0] for speed in (0.4, 40.0))
    assert slow == fast


def test_what_lies_is_let_go():
    assert _step(0.85 * WEIGHT, attitude=(1.0, 0.0, 0.0, 0.0))[0] == IDLE


def test_a_broken_vehicle_commands_nothing():
    assert landed.lie() == (IDLE, 0)


def test_the_torque_turns_the_nose_and_stops_a_spin():
    torque = landed.torque_to(Vector(1.0, 0.1, -0.2), Vector(0.0, 0.0, 0.0), GAINS)
    assert torque.x == 0.0
    assert torque.y > 0.0
    assert torque.z > 0.0
    assert landed.torque_to(Vector(1.0, 0.0, 0.0), Vector(2.0, 0.0, 0.0), GAINS).x < 0.0
