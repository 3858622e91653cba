r"""Attitude law: a commanded attitude and a force along the nose, followed by the zero-moment law's attitude loop.

The position loop is gone. In its place a reference (q_r, omega_r) goes from where the vehicle is to the command q_c as
a critically damped second-order system of bandwidth :math:`\omega_n`, its acceleration and rate bounded by what the
elevons can follow; omega_c is the command's own body rate:

.. math::
    \dot\omega_r = 2 \omega_n^2 \, \mathrm{sgn}(\eta) \epsilon + 2 \omega_n (R \omega_c - \omega_r),
    \quad (\eta, \epsilon) = q_r^{-1} \otimes q_c

The attitude loop makes q follow q_r with omega_r and its derivative fed forward. What the air stream does to the wing
is in no model of the hover: a disturbance observer finds it, so that a tilt is held in a wind and at speed.

With q_e = q_r^{-1} q and omega_e the rate of one against the other, the loop makes V of :func:`lyapunov` fall at
2 zeta / lambda |omega_e|^2 as long as the allocation gives the torque and the disturbance is the one observed.
"""

from typing import NamedTuple

from sitl.compiled import kernel
from sitl.control.allocation import allocate
from sitl.control.attitude_loop import NOT_CHOSEN, kept, observer_start, observer_update
from sitl.control.estimate import Estimate, air_ahead
from sitl.control.handover import Handover, smoothed
from sitl.control.hover_zero_moment import AttitudeTarget, ZeroMomentGains, attitude_torque, axial_force, realise
from sitl.control.reference import AttitudeReference, Reference
from sitl.model.airframe import Airframe
from sitl.model.arithmetic import clipped
from sitl.model.quaternions import (
    Quaternion,
    conjugate,
    multiply,
    normalised,
    rotate,
    rotate_inverse,
    small_rotation,
)
from sitl.model.state import Actuators
from sitl.model.vectors import Vector, add, add_scaled, dot, scaled, shortened, subtract


class AttitudeGains(NamedTuple):
    """Gains of the law and of the attitude loop in it."""

    bandwidth: float  # of the reference [rad/s]
    max_rate: float  # of the reference [rad/s]
    max_acceleration: float  # of the reference [rad/s2]
    force_rate: float  # bandwidth of the force [1/s]
    observer: float  # bandwidth of the moment's disturbance observer [rad/s]; 0: none
    loop: ZeroMomentGains  # of the attitude loop, with the bounds of the force


class Steering(NamedTuple):
    """State of the law: what the attitude loop follows, and its observer's."""

    attitude: Quaternion  # q_r
    rates: Vector  # omega_r, in the frame of q_r [rad/s]
    force: float  # along the nose [N]
    observer: Vector  # of the disturbance observer [N m s]
    side: float = NOT_CHOSEN  # of the attitude about the reference
    command_side: float = NOT_CHOSEN  # of the command about the reference


class AttitudeState(NamedTuple):
    """State slots of the law."""

    steering: Steering
    handover: Handover


@kernel
def start(estimate: Estimate, gains: AttitudeGains, a: Airframe) -> Steering:
    """Jump map on entering the law: the reference is where the vehicle is, the force what it gives."""
    force = clipped(axial_force(estimate.actuators, air_ahead(estimate), a), gains.loop.f_min, gains.loop.f_max)
    observer = observer_start(estimate, a)
    return Steering(
        attitude=estimate.attitude,
        rates=estimate.rates,
        force=force,
        observer=observer,
        side=NOT_CHOSEN,
        command_side=NOT_CHOSEN,
    )


@kernel
def full_force(a: Airframe) -> float:
    """Force along the nose with both motors at their limit, at rest [N]."""
    return axial_force(Actuators(a.omega_max, a.omega_max, 0.0, 0.0), 0.0, a)


@kernel
def step(
    estimate: Estimate,
    reference: Reference,
    gains: AttitudeGains,
    a: Airframe,
    state: AttitudeState,
    dt: float,
) -> tuple[Actuators, int, AttitudeState]:
    """One tick: actuator commands, DARKO_SATURATION bits, and the state after it."""
    loop, wanted, steering = gains.loop, reference.attitude, state.steering
    q, w, q_r, w_r = estimate.attitude, estimate.rates, steering.attitude, steering.rates
    side = kept(steering.side, multiply(conjugate(q_r), q).w)
    command_side = kept(steering.command_side, multiply(conjugate(q_r), wanted.attitude).w)
    w_r_dot = _reference_acceleration(steering, wanted, gains)
    torque = attitude_torque(q, w, AttitudeTarget(q_r, w_r, w_r_dot), loop, side)
    disturbance, observer = observer_update(_drifting(estimate), steering.observer, gains.observer, a, dt)
    u = realise(subtract(torque, disturbance), steering.force, loop)
    inflow = air_ahead(estimate)
    u, handover = smoothed(u, estimate.actuators, a, state.handover, dt, inflow)
    command, saturation = allocate(u, a, inflow)
    force = steering.force + min(gains.force_rate * dt, 1.0) * (wanted.thrust * full_force(a) - steering.force)
    after = Steering(
        attitude=normalised(multiply(q_r, small_rotation(scaled(w_r, dt)))),
        rates=shortened(add_scaled(w_r, w_r_dot, dt), gains.max_rate),
        force=clipped(force, loop.f_min, loop.f_max),
        observer=observer,
        side=side,
        command_side=command_side,
    )
    return command, saturation, AttitudeState(after, handover)


@kernel
def lyapunov(estimate: Estimate, gains: AttitudeGains, steering: Steering) -> float:
    r"""V = 4 (1 - |eta|) + |omega_e|^2 / (2 lambda^2) of the error against the reference [rad2].

    For a small error by an angle theta it is (theta^2 + |omega_e|^2 / lambda^2) / 2.
    """
    off = multiply(conjugate(steering.attitude), estimate.attitude)
    rate = subtract(estimate.rates, rotate_inverse(off, steering.rates))
    return 4.0 * (1.0 - abs(off.w)) + 0.5 * dot(rate, rate) / (gains.loop.lam * gains.loop.lam)


@kernel
def _reference_acceleration(steering: Steering, wanted: AttitudeReference, gains: AttitudeGains) -> Vector:
    off = multiply(conjugate(steering.attitude), wanted.attitude)
    stiffness = 2.0 * gains.bandwidth * gains.bandwidth * kept(steering.command_side, off.w)
    lag = subtract(rotate(off, wanted.rates), steering.rates)
    pull = add(scaled(Vector(off.x, off.y, off.z), stiffness), scaled(lag, 2.0 * gains.bandwidth))
    return shortened(pull, gains.max_acceleration)


@kernel
def _drifting(estimate: Estimate) -> Estimate:
    """As if the air went along: what the stream does to the wing is then part of what is observed."""
    return Estimate(
        position=estimate.position,
        velocity=estimate.velocity,
        acceleration=estimate.acceleration,
        attitude=estimate.attitude,
        rates=estimate.rates,
        wind=estimate.velocity,
        actuators=estimate.actuators,
        on_ground=estimate.on_ground,
        age=estimate.age,
    )
