r"""INDI: one law for hover, transition and cruise, which measures with the accelerometer what the model lacks.

After Tal and Karaman (Global incremental flight control for agile maneuvering of a tailsitter flying wing, 2022), on
this vehicle's phi-theory. The model makes a force f_m and a moment M_m of actuators, air and attitude. One low-pass
filter, written as a bar, passes what is measured and what is modelled, so that both are equally late; the commands are
increments over what is measured:

.. math::
    f_c = \bar f_m + m (a_c - \bar a), \quad
    M_c = \bar M_m + J (\dot\omega_c - \bar{\dot\omega}) + \omega \times J \omega - \overline{\omega \times J \omega}

If the measurement equals the command, nothing changes; gusts, wrong coefficients and a bent wing are in the
measurement. :mod:`sitl.control.flatness` makes an attitude of f_c, an attitude loop the angular acceleration, and
:func:`sitl.control.forward_flight.forward_allocation.invert` motors and elevons, as increments over where they are.

An elevon that raises the nose first pushes the vehicle down. So neither the velocity that is governed nor the force
that counts as unmodelled is that of the centre of mass, but of the point :math:`J_2 / (m l)` ahead of it, l being the
elevons' arm: there their force and the turn that it makes cancel (the centre of percussion).
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sitl.compiled import kernel, subroutine
from sitl.control import flatness
from sitl.control.attitude_loop import NOT_CHOSEN, kept, momentum
from sitl.control.estimate import Estimate
from sitl.control.forward_flight.forward_allocation import ModelPoint, invert
from sitl.control.forward_flight.forward_guidance import FAST, air_course
from sitl.control.hover_attitude import full_force
from sitl.control.indi_guidance import IndiGuidanceGains, turns_edge_on, wanted_acceleration
from sitl.control.reference import Reference
from sitl.model.aerodynamics import Slopes, slopes, thrusts, trimmed_slope
from sitl.model.airframe import Airframe, elevon_arm
from sitl.model.arithmetic import arctangent, clipped, decay, wrapped
from sitl.model.propeller import torque_difference
from sitl.model.quaternions import Quaternion, conjugate, multiply, rotate, rotate_inverse, x_axis, z_axis
from sitl.model.state import Actuators
from sitl.model.vectors import Vector, add, add_scaled, cross, dot, level_norm, norm, scaled, shortened, subtract

HEADING_BELOW = 3.0  # over the ground: faster, a hover that is flown to leaves the heading alone [m/s]
EDGE_ON = 100.0  # added to the airspeeds of the blend: no air stream takes the heading over [m/s]
MIN_LIFT = 0.3  # of the weight: with less, in an updraught, the attitude would be any [-]
MOST_TAKEN_OVER = 3.0  # of the acceleration at the jump: that of a catch or a knock would go on [m/s2]
DAMPED = math.sqrt(2.0)  # twice the damping ratio of the low-pass filters: Butterworth's


class IndiGains(NamedTuple):
    """Gains of the law."""

    guidance: IndiGuidanceGains
    attitude: Vector  # bandwidth of the attitude loop about x, y, z_b [rad/s]
    rate: Vector  # bandwidth of the rate loop [rad/s]
    max_rate: float  # body rate asked for [rad/s]
    turn_filter: float  # bandwidth of the feed-forward of the attitude's own rate [rad/s]
    turn_filter_fast: float  # the same where the wing carries, from 12 m/s of airspeed on [rad/s]
    elevon_lead: float  # times the change that is wanted of the elevons, which lag [-]
    force_filter: float  # bandwidth of the unmodelled force [rad/s]
    moment_filter: float  # and of the unmodelled moment [rad/s]
    course_rate: float  # at which the belly turns to the course without airspeed [rad/s]
    blend_from: float  # airspeeds between which the heading gives way to the air stream [m/s]
    blend_to: float


class LowPass(NamedTuple):
    """Second-order low pass of a vector: what it gives, and the derivative of that."""

    value: Vector
    rate: Vector


class IndiState(NamedTuple):
    """The law's state."""

    acceleration: Vector  # wanted in the last tick, world [m/s2]
    attitude: Quaternion  # q_d of the last tick
    turning: Vector  # filtered rate of q_d, in its own frame [rad/s]
    force: LowPass  # that the model does not know of, world [N]
    moment: LowPass  # that the model knows of, body [N m]
    rates: LowPass  # body rates; its derivative is the angular acceleration [rad/s]
    course: float  # where the belly points while there is no airspeed to point it [rad]
    side: float = NOT_CHOSEN  # of the attitude about q_d


class Modelled(NamedTuple):
    """The model's slopes and moment at the present airspeed and actuator positions."""

    v: Vector  # velocity through the air, body [m/s]
    T1: float  # [N]
    T2: float
    slopes: Slopes
    moment: Vector  # body [N m]


@kernel
def start(estimate: Estimate, a: Airframe) -> IndiState:
    """Jump map on entering the law: from the attitude as it is, with nothing unmodelled."""
    none = Vector(0.0, 0.0, 0.0)
    known = LowPass(modelled(estimate, a).moment, none)
    unknown, turned = LowPass(none, none), LowPass(estimate.rates, none)
    return IndiState(
        acceleration=shortened(estimate.acceleration, MOST_TAKEN_OVER),
        attitude=estimate.attitude,
        turning=none,
        force=unknown,
        moment=known,
        rates=turned,
        course=facing(estimate),
        side=NOT_CHOSEN,
    )


@kernel
def facing(estimate: Estimate) -> float:
    """Azimuth of the belly while upright, of the nose else [rad]."""
    x, z = x_axis(estimate.attitude), z_axis(estimate.attitude)
    upright = abs(x.z) > level_norm(x.x, x.y)
    return arctangent(-z.y if upright else x.y, -z.x if upright else x.x)


@subroutine
def step(
    estimate: Estimate, reference: Reference, gains: IndiGains, a: Airframe, increment: IndiState, dt: float
) -> tuple[Actuators, int, IndiState]:
    """One tick: actuator commands, DARKO_SATURATION bits, and the state after it.

    Args:
        estimate: What the vehicle believes of itself.
        reference: A position to hover at, a path to fly, or an attitude.
        gains: Gains of the law.
        a: The airframe as the law knows it.
        increment: The law's state.
        dt: Tick [s].
    """
    q, w, now, guidance = estimate.attitude, estimate.rates, estimate.actuators, gains.guidance
    by_model = modelled(estimate, a)
    rates = passed(increment.rates, w, gains.moment_filter, dt)
    known = passed(increment.moment, by_model.moment, gains.moment_filter, dt)
    unmodelled = passed(increment.force, unmodelled_force(estimate, by_model, rates.rate, a), gains.force_filter, dt)
    edge_on = turns_edge_on(estimate, reference, guidance)
    course = turned_course(increment.course, estimate, reference, edge_on, gains.course_rate * dt)
    asked = wanted_acceleration(estimate, at_percussion(estimate, a), reference, course, guidance, a)
    asked = add(increment.acceleration, shortened(subtract(asked, increment.acceleration), guidance.max_jerk * dt))
    force = subtract(Vector(a.m * asked.x, a.m * asked.y, a.m * (asked.z + a.g)), unmodelled.value)
    force = Vector(force.x, force.y, max(force.z, MIN_LIFT * a.m * a.g))
    v_a = subtract(estimate.velocity, estimate.wind)
    raised = EDGE_ON if edge_on else 0.0
    view = flatness.View(course, increment.attitude, gains.blend_from + raised, gains.blend_to + raised)
    q_d = flatness.transform(force, v_a, view, by_model.T1 + by_model.T2, a).attitude
    axial = dot(force, x_axis(q))
    turning = _turning(increment, q_d, norm(v_a), gains, dt)
    if reference.steered:
        q_d, turning = reference.attitude.attitude, reference.attitude.rates
        axial = reference.attitude.thrust * full_force(a)
    side = kept(increment.side, multiply(conjugate(q_d), q).w)
    turned = subtract(_angular_acceleration(q, w, q_d, turning, side, gains), rates.rate)
    moment = add(known.value, momentum(turned, a))
    moment = add(moment, subtract(cross(w, momentum(w, a)), cross(rates.value, momentum(rates.value, a))))
    along = Vector(axial_force(by_model, a), 0.0, 0.0)
    present = ModelPoint(along, by_model.moment, by_model.slopes, by_model.v.x, now)
    command, saturation = invert(axial, moment, present, a)
    command = _leading(command, now, gains.elevon_lead, a.delta_max)
    return (
        command,
        saturation,
        IndiState(
            acceleration=asked,
            attitude=q_d,
            turning=turning,
            force=unmodelled,
            moment=known,
            rates=rates,
            course=course,
            side=side,
        ),
    )


@kernel
def _leading(command: Actuators, now: Actuators, lead: float, limit: float) -> Actuators:
    """The commands, those of the elevons moved on from where they are."""
    if lead == 1.0:
        return command
    left = now.left_elevon + lead * (command.left_elevon - now.left_elevon)
    right = now.right_elevon + lead * (command.right_elevon - now.right_elevon)
    return Actuators(
        command.left_motor, command.right_motor, clipped(left, -limit, limit), clipped(right, -limit, limit)
    )


@kernel
def modelled(estimate: Estimate, a: Airframe) -> Modelled:
    """The model's slopes and moment at the present airspeed and actuator positions."""
    v, now = rotate_inverse(estimate.attitude, subtract(estimate.velocity, estimate.wind)), estimate.actuators
    T1, T2 = thrusts(now, v.x, a)
    s = slopes(v, T1, T2, a)
    E1, E2 = s.left_elevon * now.left_elevon, s.right_elevon * now.right_elevon
    moment = Vector(
        torque_difference(now.left_motor, now.right_motor, v.x, a) - a.a_y * (E1 - E2),
        -elevon_arm(a) * (E1 + E2) - s.moment * v.z,
        -(a.p_y - a.S_ratio * a.a_y * a.C_d0) * (T1 - T2),
    )
    return Modelled(v=v, T1=T1, T2=T2, slopes=s, moment=moment)


@kernel
def axial_force(by_model: Modelled, a: Airframe) -> float:
    """Of propellers and free stream along the nose [N]."""
    return (1.0 - a.S_ratio * a.C_d0) * (by_model.T1 + by_model.T2) - by_model.slopes.drag * by_model.v.x


@kernel
def passed(filtered: LowPass, value: Vector, bandwidth: float, dt: float) -> LowPass:
    """The low pass a tick later."""
    rate = add_scaled(
        filtered.rate,
        add_scaled(scaled(subtract(value, filtered.value), bandwidth), filtered.rate, -DAMPED),
        bandwidth * dt,
    )
    return LowPass(add_scaled(filtered.value, rate, dt), rate)


@kernel
def unmodelled_force(estimate: Estimate, by_model: Modelled, turned: Vector, a: Airframe) -> Vector:
    """The force that the model does not know of, world [N]; on the ground, whose force it is, none.

    Args:
        estimate: With the acceleration.
        by_model: What the model makes of it.
        turned: Angular acceleration, body [rad/s2].
        a: The airframe as the law knows it.
    """
    # Elevons in trim balance the wing's moment; what they push besides is seen in what turns.
    turning = -momentum(turned, a).y / elevon_arm(a)
    across = -trimmed_slope(by_model.slopes, a) * by_model.v.z - turning
    force = rotate(estimate.attitude, Vector(axial_force(by_model, a), 0.0, across))
    felt = estimate.acceleration
    flies = 0.0 if estimate.on_ground else 1.0
    return scaled(Vector(a.m * felt.x - force.x, a.m * felt.y - force.y, a.m * (felt.z + a.g) - force.z), flies)


@kernel
def at_percussion(estimate: Estimate, a: Airframe) -> Vector:
    """Velocity of the point where the elevons' force and the turn that it makes cancel, world [m/s]."""
    ahead = a.J2 / (a.m * elevon_arm(a))
    return add_scaled(estimate.velocity, z_axis(estimate.attitude), -ahead * estimate.rates.y)


@kernel
def turned_course(course: float, estimate: Estimate, reference: Reference, edge_on: bool, most: float) -> float:
    """The course a tick later, at most so far from what it was [rad]."""
    slow = level_norm(estimate.velocity.x, estimate.velocity.y) < HEADING_BELOW
    wanted = reference.heading if slow else course
    wanted = air_course(estimate, reference, course) if reference.forward else wanted
    wanted = reference.heading if edge_on else wanted
    return course + clipped(wrapped(wanted - course), -most, most)


@kernel
def _turning(increment: IndiState, q_d: Quaternion, airspeed: float, gains: IndiGains, dt: float) -> Vector:
    """Filtered rate of q_d, in its own frame [rad/s]."""
    share = min(airspeed / FAST, 1.0)
    bandwidth = gains.turn_filter + share * share * (gains.turn_filter_fast - gains.turn_filter)
    moved = multiply(conjugate(increment.attitude), q_d)
    k = (2.0 if moved.w >= 0.0 else -2.0) / dt
    rate = shortened(Vector(k * moved.x, k * moved.y, k * moved.z), gains.max_rate)
    keep = decay(bandwidth * dt)
    return add_scaled(scaled(increment.turning, keep), rate, 1.0 - keep)


@kernel
def _angular_acceleration(
    q: Quaternion, w: Vector, q_d: Quaternion, turning: Vector, side: float, gains: IndiGains
) -> Vector:
    """Angular acceleration set-point with which q follows q_d and its rate, body [rad/s2]."""
    off = multiply(conjugate(q_d), q)
    k, loop = -2.0 * side, gains.attitude
    turn = shortened(Vector(k * loop.x * off.x, k * loop.y * off.y, k * loop.z * off.z), gains.max_rate)
    rate = subtract(add(turn, rotate_inverse(off, turning)), w)
    return Vector(gains.rate.x * rate.x, gains.rate.y * rate.y, gains.rate.z * rate.z)
