r"""Non-linear forward law: line of sight -> acceleration -> attitude and thrust -> moment -> actuators.

The structure is the report's (section 4.2); three of its links are others. The force wanted fixes the attitude
exactly: with :math:`C_{l,e} = C_l (1 - \xi_f / \xi_m)` the normal force of the trimmed wing, and the span square to the
air stream,

.. math::
    x_d \parallel m (a + g e_3) + \tfrac12 \rho S |v_a| C_{l,e} (v_a - (v_a \cdot y) y)

is right in quasi-steady flight at any incidence and without an airspeed is the zero-moment law's thrust direction, so
the same law flies the front transition, cruise, turns (banking) and the back transition. The moment follows an attitude
that moves, and the allocation inverts the model in closed form.
"""

from __future__ import annotations

from typing import NamedTuple

from sitl.compiled import kernel
from sitl.control.attitude_loop import NOT_CHOSEN, kept, momentum, observe_moment, observer_start
from sitl.control.braking import Stop, brake
from sitl.control.estimate import Estimate
from sitl.control.flatness import View, from_axes, nose, span
from sitl.control.forward_flight.forward_allocation import ModelPoint, invert
from sitl.control.forward_flight.forward_guidance import GuidanceGains, Guided, MotionInAir, air_course, cruise
from sitl.control.reference import Reference
from sitl.model.aerodynamics import side_force, slopes, thrusts, trimmed_slope, wrench
from sitl.model.airframe import Airframe
from sitl.model.arithmetic import clipped, decay, wrapped
from sitl.model.quaternions import Quaternion, conjugate, multiply, rotate, rotate_inverse, x_axis
from sitl.model.state import Actuators
from sitl.model.vectors import Vector, add, add_scaled, cross, dot, level_norm, scaled, shortened, subtract

TURN_BELOW = 3.0  # over the ground, in the transition to the hover [m/s]
TURN_RATE = 1.0  # there [rad/s]


class LineOfSight(NamedTuple):
    """The law's state."""

    acceleration: Vector  # wanted in the last tick, world [m/s2]
    attitude: Quaternion  # q_d of the last tick
    turning: Vector  # filtered rate of q_d, in its own frame [rad/s]
    integral: Vector  # of the velocity error along the course, to its left and upwards [m/s2]
    observer: Vector  # state of the moment's disturbance observer [N m s]
    side: float = NOT_CHOSEN  # of the attitude about q_d


class LineOfSightGains(NamedTuple):
    """Gains of the law."""

    guidance: GuidanceGains
    attitude: Vector  # bandwidth of the attitude loop about x, y, z_b [rad/s]
    rate: Vector  # bandwidth of the rate loop [rad/s]
    max_rate: float  # body rate asked for [rad/s]
    observer: float  # bandwidth of the moment's disturbance observer [rad/s]
    turn_filter: float  # bandwidth of the feed-forward of q_d's own rate [rad/s]
    blend_from: float  # airspeeds between which the heading gives way to the air stream [m/s]
    blend_to: float


class LineOfSightState(NamedTuple):
    """State slots of the law."""

    sight: LineOfSight
    course: float  # where the belly points while there is no airspeed to point it [rad]


@kernel
def start(estimate: Estimate, a: Airframe) -> LineOfSight:
    """Jump map on entering the law: from the attitude and the acceleration as they are, with nothing accumulated."""
    none = Vector(0.0, 0.0, 0.0)
    observer = observer_start(estimate, a)
    return LineOfSight(
        acceleration=estimate.acceleration,
        attitude=estimate.attitude,
        turning=none,
        integral=none,
        observer=observer,
        side=NOT_CHOSEN,
    )


@kernel
def cruise_step(
    estimate: Estimate, reference: Reference, gains: LineOfSightGains, a: Airframe, state: LineOfSightState, dt: float
) -> tuple[Actuators, int, LineOfSightState]:
    """One tick of following the path.

    Args:
        estimate: What the vehicle believes of itself.
        reference: With the path.
        gains: Gains of the law.
        a: The airframe as the law knows it.
        state: The law's state.
        dt: Tick [s].

    Returns:
        Commands, DARKO_SATURATION bits and the next state.
    """
    v = estimate.velocity
    flown = MotionInAir(estimate.position, v, estimate.wind)
    course = air_course(estimate, reference, state.course)
    wanted, integral = cruise(flown, reference.path, state.sight.integral, dt, gains.guidance)
    return _follow(estimate, Guided(guarded(v, wanted), integral), gains, a, LineOfSightState(state.sight, course), dt)


@kernel
def brake_step(
    estimate: Estimate, reference: Reference, gains: LineOfSightGains, a: Airframe, state: LineOfSightState, dt: float
) -> tuple[Actuators, int, LineOfSightState]:
    """One tick of the climbing stop at the end of the path; at its end the heading goes over to that of the hover.

    Arguments and results as for :func:`cruise_step`.
    """
    v, course = estimate.velocity, state.course
    turn = clipped(wrapped(reference.heading - course), -TURN_RATE * dt, TURN_RATE * dt)
    course += turn if level_norm(v.x, v.y) < TURN_BELOW else 0.0
    flown, stop = MotionInAir(estimate.position, v, estimate.wind), Stop(reference.path, reference.speed)
    guided = brake(flown, stop, travel(estimate, a), state.sight.integral, dt, gains.guidance)
    return _follow(estimate, guided, gains, a, LineOfSightState(state.sight, course), dt)


@kernel
def travel(estimate: Estimate, a: Airframe) -> float:
    """Share of the elevons' travel that pitch uses now."""
    return 0.5 * abs(estimate.actuators.left_elevon + estimate.actuators.right_elevon) / a.delta_max


@kernel
def guarded(v: Vector, wanted: Vector) -> Vector:
    """The acceleration wanted, or a pull-up where the vehicle dives."""
    dives = v.z < -4.5 and -v.z > 0.404 * level_norm(v.x, v.y)  # steeper than 22 deg
    return Vector(0.0, 0.0, min(2.0 * (1.0 - v.z), 8.0)) if dives else wanted


@kernel
def _follow(
    estimate: Estimate, guided: Guided, gains: LineOfSightGains, a: Airframe, state: LineOfSightState, dt: float
) -> tuple[Actuators, int, LineOfSightState]:
    """From the acceleration wanted, and the course, to commands, DARKO_SATURATION bits and the law's next state."""
    limits, q, w, sight = gains.guidance, estimate.attitude, estimate.rates, state.sight
    change = shortened(subtract(guided.acceleration, sight.acceleration), limits.max_jerk * dt)
    x, y, z = add(sight.acceleration, change)
    wanted = Vector(x, y, clipped(z, -limits.max_down, limits.max_up))
    force = Vector(a.m * x, a.m * y, a.m * wanted.z + a.m * a.g)
    v_a = subtract(estimate.velocity, estimate.wind)
    v_b = rotate_inverse(q, v_a)
    if a.k_h > 0.0:
        force = subtract(force, rotate(q, Vector(0.0, side_force(v_b, estimate.actuators, a), 0.0)))
    T1, T2 = thrusts(estimate.actuators, v_b.x, a)
    carried = trimmed_slope(slopes(rotate_inverse(sight.attitude, v_a), T1, T2, a), a)
    view = View(state.course, sight.attitude, gains.blend_from, gains.blend_to)
    q_d = attitude(force, v_a, view, carried, a)
    turning = _turning(sight, q_d, gains, dt)
    F, M = wrench(v_b, w, estimate.actuators, a)
    disturbance, observer = observe_moment(estimate, M, sight.observer, gains.observer, a, dt)
    side = kept(sight.side, multiply(conjugate(q_d), q).w)
    moment = subtract(_moment(estimate, q_d, turning, side, gains, a), disturbance)
    stream = slopes(v_b, T1, T2, a)
    present = ModelPoint(F, M, stream, v_b.x, estimate.actuators)
    command, saturation = invert(dot(force, x_axis(q)), moment, present, a)
    after = LineOfSight(
        acceleration=wanted, attitude=q_d, turning=turning, integral=guided.integral, observer=observer, side=side
    )
    return command, saturation, LineOfSightState(after, state.course)


@kernel
def attitude(force: Vector, v_a: Vector, view: View, carried: float, a: Airframe) -> Quaternion:
    """The attitude that gives a force in quasi-steady flight.

    Args:
        force: Aerodynamic force wanted, world [N].
        v_a: Velocity through the air, world [m/s].
        view: Where the belly looks.
        carried: Normal force of the trimmed wing by the velocity along z_b [N s/m].
        a: The airframe as the law knows it.
    """
    y = span(force, v_a, view, a.m * a.g)
    return from_axes(nose(force, v_a, y, carried), y, view.last)


@kernel
def _turning(sight: LineOfSight, q_d: Quaternion, gains: LineOfSightGains, dt: float) -> Vector:
    """Filtered rate of q_d, in its own frame [rad/s]."""
    moved = multiply(conjugate(sight.attitude), q_d)
    k, most = (2.0 if moved.w >= 0.0 else -2.0) / dt, gains.max_rate
    rate = Vector(
        clipped(k * moved.x, -most, most), clipped(k * moved.y, -most, most), clipped(k * moved.z, -most, most)
    )
    keep = decay(gains.turn_filter * dt)
    return add_scaled(scaled(sight.turning, keep), rate, 1.0 - keep)


@kernel
def _moment(
    estimate: Estimate, q_d: Quaternion, turning: Vector, side: float, gains: LineOfSightGains, a: Airframe
) -> Vector:
    """Moment that makes the attitude follow q_d and its rate, body [N m]."""
    w, off = estimate.rates, multiply(conjugate(q_d), estimate.attitude)
    k = -2.0 * side
    loop = gains.attitude
    turn = shortened(Vector(k * loop.x * off.x, k * loop.y * off.y, k * loop.z * off.z), gains.max_rate)
    rate = subtract(add(turn, rotate_inverse(off, turning)), w)
    wanted = momentum(Vector(gains.rate.x * rate.x, gains.rate.y * rate.y, gains.rate.z * rate.z), a)
    return add(wanted, cross(w, momentum(w, a)))
