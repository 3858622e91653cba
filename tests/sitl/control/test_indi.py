"""INDI: what is measured as commanded changes nothing, trims stay trims, left is the mirror of right."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl.control import indi
from sitl.control.allocation import THRUST
from sitl.control.forward_flight.forward_guidance import FAST
from sitl.control.hover_attitude import full_force
from sitl.control.reference import AttitudeReference, along, hover_at, leg, steer
from sitl.design.gains import indi_gains
from sitl.design.trim import level_trim
from sitl.model.airframe_files import load
from sitl.model.arithmetic import decay
from sitl.model.phi_theory import wrench
from sitl.model.quaternions import Quaternion, from_euler, hover, x_axis
from sitl.model.state import Actuators
from sitl.model.vectors import Vector, add_scaled, norm, scaled, subtract
from tests.support.flights.estimates import estimate, negated, turned, vector

SETS = {name: load(name).parameters for name in ("nominal", "collage")}
GAINS = indi_gains()
TICK, TICKS = 0.01, 300  # 3 s, in which the filters settle [s]
HIGH = 50.0
small = st.floats(-1.0, 1.0)


def flown(seen, reference, a, ticks=TICKS, course=0.0):
    """The law on an estimate that does not change: what measures the same again and again."""
    state = indi.start(seen, a)._replace(course=course)
    command, flags = seen.actuators, 0
    for _ in range(ticks):
        command, flags, state = indi.step(seen, reference, GAINS, a, state, TICK)
    return command, flags, state


def cruising(a, speed):
    """Level flight in trim, and the path it is on."""
    trim = level_trim(a, speed)
    acting = (trim.omega, trim.omega, trim.delta, trim.delta)
    seen = estimate((0.0, 0.0, HIGH), (speed, 0.0, 0.0), from_euler(0.0, -trim.theta, 0.0), actuators=acting)
    path = leg((0.0, 0.0, HIGH), (5000.0, 0.0, HIGH), speed, stop=False)
    return seen, along(hover_at((5000.0, 0.0, HIGH), 0.0), path, 0.0)


@pytest.mark.parametrize("name", SETS)
@pytest.mark.parametrize("speed", [5.0, 8.0, 13.0, 15.0, 20.0])
def test_a_trim_is_a_fixed_point(name, speed):
    a = SETS[name]
    seen, reference = cruising(a, speed)
    command, _, state = flown(seen, reference, a)
    assert norm(state.acceleration) < 1e-6
    assert norm(subtract(x_axis(state.attitude), x_axis(seen.attitude))) < 1e-6
    assert command[:2] == pytest.approx(seen.actuators[:2], rel=1e-4)
    assert command[2:] == pytest.approx(seen.actuators[2:], abs=1e-4)


@pytest.mark.long
@pytest.mark.parametrize("name", SETS)
@settings(max_examples=25)
@given(left=st.floats(450.0, 800.0), right=st.floats(450.0, 800.0), d1=st.floats(-0.3, 0.3), d2=st.floats(-0.3, 0.3))
def test_what_is_measured_as_commanded_changes_nothing(name, left, right, d1, d2):
    """It stands still where it shall, with whatever actuators: a bent wing, a weak propeller, a heavy nose."""
    a = SETS[name]
    seen = estimate((1.0, 2.0, HIGH), actuators=(left, right, d1, d2))
    command, _, _ = flown(seen, hover_at((1.0, 2.0, HIGH), 0.0), a)
    assert command[:2] == pytest.approx(seen.actuators[:2], rel=1e-3)
    assert command[2:] == pytest.approx(seen.actuators[2:], abs=2e-3)


def test_an_acceleration_that_is_not_felt_is_asked_for_more_and_more():
    """The integral that the law does not have: as long as it is felt too little, the force grows."""
    a = SETS["collage"]
    omega = level_trim(a, 0.0).omega
    seen = estimate((0.0, 0.0, HIGH), actuators=(omega, omega, 0.0, 0.0))
    reference = hover_at((0.0, 0.0, HIGH + 0.5), 0.0)
    command, _, _ = flown(seen, reference, a)
    faster = seen._replace(actuators=command)
    more, _, _ = flown(faster, reference, a)
    assert omega < command.left_motor < more.left_motor


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_motors_and_elevons_at_their_limits_keep_authority_over_the_attitude(axis):
    """Far below its reference it asks for more thrust than there is, and still turns each way."""
    a = SETS["collage"]
    full = (a.omega_max, a.omega_max, 0.0, 0.0)
    far = hover_at((0.0, 0.0, HIGH + 500.0), 0.0)
    sums, differences = [], []
    for sign in (1.0, -1.0):
        phi = [0.0, 0.0, 0.0]
        phi[axis] = 0.5 * sign
        seen = estimate((0.0, 0.0, HIGH), q=turned(hover(0.0), phi), actuators=full)
        sinking = seen._replace(acceleration=Vector(0.0, 0.0, -9.0))  # however much the motors give
        command, flags, _ = flown(sinking, far, a, ticks=60)
        assert flags & THRUST
        sums.append(command.left_elevon + command.right_elevon)
        differences.append((command.left_elevon - command.right_elevon, command.left_motor - command.right_motor))
    if axis == 0:
        assert differences[0][0] * differences[1][0] < 0.0
    elif axis == 1:
        assert sums[0] * sums[1] < 0.0
    else:
        assert differences[0][1] * differences[1][1] < 0.0


def mirrored(seen):
    """The other side of the plane of symmetry."""
    w1, w2, d1, d2 = seen.actuators
    q, w = seen.attitude, seen.rates
    return seen._replace(
        position=_flipped(seen.position),
        velocity=_flipped(seen.velocity),
        acceleration=_flipped(seen.acceleration),
        wind=_flipped(seen.wind),
        attitude=Quaternion(q.w, -q.x, q.y, -q.z),
        rates=Vector(-w.x, w.y, -w.z),
        actuators=Actuators(w2, w1, d2, d1),
    )


def _flipped(v):
    return Vector(v.x, -v.y, v.z)


@given(
    p=st.tuples(small, small, small), v=st.tuples(small, small, small), phi=st.tuples(small, small, small),
    w=st.tuples(small, small, small), heading=st.floats(-3.0, 3.0), forward=st.booleans(),
)  # fmt: skip
def test_left_is_the_mirror_of_right(p, v, phi, w, heading, forward):
    a = SETS["collage"]
    seen = estimate(
        scaled(vector(p), 20.0), scaled(vector(v), 8.0), turned(hover(0.3), phi), scaled(vector(w), 2.0),
        (2.0, 1.0, 0.0), (600.0, 550.0, 0.1, -0.05),
    )  # fmt: skip
    references = []
    for side in (1.0, -1.0):
        reference = hover_at((3.0, 4.0 * side, 5.0), heading * side)
        path = leg((0.0, 0.0, 0.0), (200.0, 90.0 * side, 8.0), 14.0)
        references.append(along(reference, path, heading * side) if forward else reference)
    one, _, state = flown(seen, references[0], a, ticks=3, course=0.4)
    other, _, reflection = flown(mirrored(seen), references[1], a, ticks=3, course=-0.4)
    assert one == pytest.approx((other[1], other[0], other[3], other[2]), rel=1e-6, abs=1e-6)
    assert state.acceleration == pytest.approx(_flipped(reflection.acceleration), abs=1e-9)


def test_the_ground_it_stands_on_is_no_force_to_learn():
    a = SETS["collage"]
    seen = estimate((0.0, 0.0, 0.1), actuators=(a.omega_min, a.omega_min, 0.0, 0.0))
    _, _, standing = flown(seen._replace(on_ground=True), hover_at((0.0, 0.0, 0.1), 0.0), a)
    _, _, hung = flown(seen, hover_at((0.0, 0.0, 0.1), 0.0), a)
    assert norm(standing.force.value) < 1e-12
    assert hung.force.value.z == pytest.approx(a.m * a.g, rel=0.3)


def test_an_attitude_with_its_thrust_is_followed_instead_of_a_position():
    a = SETS["collage"]
    q, thrust = turned(hover(0.0), (0.0, 0.4, 0.0)), 0.5
    reference = steer(hover_at((9.0, 9.0, 9.0), 0.0), AttitudeReference(q, Vector(0.0, 0.0, 0.0), thrust))
    omega = level_trim(a, 0.0).omega
    there = estimate(q=q, actuators=(omega, omega, 0.0, 0.0))
    command, _, state = flown(there, reference, a)
    assert state.attitude == q
    assert command[2:] == pytest.approx((0.0, 0.0), abs=1e-6)
    given_thrust = 2.0 * (1.0 - a.S_ratio * a.C_d0) * a.k_f * command.left_motor**2
    assert given_thrust == pytest.approx(thrust * full_force(a), rel=1e-6)
    off, _, _ = flown(there._replace(attitude=hover(0.0)), reference, a, ticks=5)
    assert off.left_elevon == pytest.approx(off.right_elevon)
    assert abs(off.left_elevon) > 0.05


def test_the_point_that_is_governed_does_not_move_as_the_elevons_turn_it():
    """An elevon's push over the mass, and its turn about the centre of mass, cancel there."""
    a = SETS["collage"]
    seen = estimate(v=(1.0, 2.0, 3.0), w=(0.0, 0.5, 0.0))
    push = 0.7  # of both elevons along z_b [N]
    sped = push / a.m * TICK
    turning = push * a.Delta_r * a.xi_m / a.xi_f / a.J2 * TICK
    z = Vector(-1.0, 0.0, 0.0)  # of hover(0)
    after = seen._replace(velocity=add_scaled(seen.velocity, z, sped), rates=Vector(0.0, seen.rates.y + turning, 0.0))
    assert indi.at_percussion(after, a) == pytest.approx(indi.at_percussion(seen, a), abs=1e-12)


def test_it_looks_where_the_belly_or_the_nose_does():
    assert indi.facing(estimate(q=hover(1.2))) == pytest.approx(1.2)
    assert indi.facing(estimate(q=from_euler(0.0, -0.2, -0.7))) == pytest.approx(-0.7)


def test_the_low_pass_settles_on_what_it_is_given_and_its_rate_is_the_derivative():
    filtered = indi.LowPass(Vector(0.0, 0.0, 0.0), Vector(0.0, 0.0, 0.0))
    for tick in range(2000):
        filtered = indi.passed(filtered, Vector(0.002 * tick, 1.0, 0.0), 40.0, 0.002)
    assert filtered.rate == pytest.approx((1.0, 0.0, 0.0), abs=1e-6)
    assert filtered.value.y == pytest.approx(1.0)
    assert filtered.value.x == pytest.approx(0.002 * 2000 - math.sqrt(2.0) / 40.0, abs=0.01)


@pytest.mark.parametrize("name", SETS)
def test_at_rest_in_still_air_its_moment_is_that_of_phi_theory(name):
    a = SETS[name]._replace(S_ratio=0.6, C_d0=0.15)
    acting = Actuators(650.0, 520.0, 0.2, -0.1)
    _, moment = wrench(Vector(0.0, 0.0, 0.0), Vector(0.0, 0.0, 0.0), acting, a)
    assert indi.modelled(estimate(actuators=acting), a).moment == pytest.approx(moment, rel=1e-9)


@pytest.mark.parametrize(("speed", "turns"), [(indi.HEADING_BELOW, False), (indi.HEADING_BELOW * (1 - 1e-12), True)])
def test_a_hover_that_is_flown_to_fast_leaves_the_heading_alone(speed, turns):
    seen = estimate((0.0, 0.0, HIGH), v=(0.6 * speed, -0.8 * speed, 9.0) if turns else (speed, 0.0, 9.0))
    _, _, state = flown(seen, hover_at((0.0, 0.0, HIGH), 1.0), SETS["collage"], ticks=1)
    assert (state.course > 0.0) == turns


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_attitude_s_own_rate_is_fed_forward_the_way_it_turns(sign):
    rate = Vector(0.2 * sign, -0.3 * sign, 0.1 * sign)
    state = indi.start(estimate(q=hover(0.7)), SETS["collage"])
    q_d = turned(hover(0.7), scaled(rate, TICK))
    wanted = scaled(rate, 1.0 - decay(GAINS.turn_filter * TICK))
    for either in (q_d, negated(q_d)):
        assert indi._turning(state, either, 0.0, GAINS, TICK) == pytest.approx(wanted, rel=1e-3)


def test_where_the_wing_carries_it_is_fed_forward_faster():
    gains = GAINS._replace(turn_filter_fast=5.0 * GAINS.turn_filter)
    state = indi.start(estimate(q=hover(0.7)), SETS["collage"])
    rate = Vector(0.0, -0.3, 0.0)
    q_d = turned(hover(0.7), scaled(rate, TICK))
    for airspeed, bandwidth in ((0.0, 1.0), (0.5 * FAST, 2.0), (FAST, 5.0), (2.0 * FAST, 5.0)):
        wanted = scaled(rate, 1.0 - decay(bandwidth * GAINS.turn_filter * TICK))
        assert indi._turning(state, q_d, airspeed, gains, TICK) == pytest.approx(wanted, rel=1e-3)


def test_elevons_that_lag_are_led_within_their_travel():
    now, command = Actuators(900.0, 910.0, 0.1, -0.1), Actuators(950.0, 960.0, 0.2, -0.4)
    assert indi._leading(command, now, 1.0, 0.5) == command
    assert indi._leading(command, now, 2.0, 0.5) == pytest.approx(Actuators(950.0, 960.0, 0.3, -0.5))
