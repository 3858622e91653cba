r"""Hierarchical zero-moment law (report, section 3.2 and appendix D, corrected).

The thrust direction d of a desired attitude q_d is steered so that R(q_d) d f becomes the force f_r that the
position loop wants; the attitude loop makes q follow q_d. With f_D = R(q_d) d f - f_r:

.. math::
    \nu = \dot f_r - k_\Delta f_\Delta, \quad
    \omega_d = \tfrac1f [d]_\times R(q_d)^\top \nu - k_q d d^\top \epsilon'_\Delta, \quad
    \dot f = d^\top R(q_d)^\top \nu

For the linear gamma this nu is the report's; written so, it holds for every governor. The rate of f_r is taken
along (e_v, a): with a the acceleration that q_d promises it is the report's nu, with the one that q gives it
is nu', which makes f_D a first-order lag. The feed-forward is the derivative of omega_d along the same flow:
for nu' that is appendix D's; for nu it leaves out the terms in R(q) - R(q_d), which brings the report's hover case
home 0.06 s sooner and costs nothing in recoveries from afar.
"""

from typing import NamedTuple

from sitl.compiled import kernel
from sitl.control.allocation import Virtual, allocate
from sitl.control.attitude_loop import NOT_CHOSEN, kept
from sitl.control.estimate import Estimate, air_ahead
from sitl.control.governor import GovernorParameters, gamma
from sitl.control.handover import Handover, smoothed
from sitl.control.reference import Reference
from sitl.model.aerodynamics import thrusts
from sitl.model.airframe import Airframe
from sitl.model.arithmetic import clipped
from sitl.model.quaternions import (
    Quaternion,
    conjugate,
    hover,
    multiply,
    normalised,
    rotate,
    rotate_inverse,
    small_rotation,
)
from sitl.model.state import Actuators, Body
from sitl.model.vectors import Vector, add_scaled, cross, dot, scaled, subtract

AHEAD = 1e-4  # step of the directional derivatives [s]
PER_AHEAD = 1.0 / AHEAD


class ZeroMomentGains(NamedTuple):
    """Gains, and what the law must know of the plant it flies."""

    governor: GovernorParameters
    k_delta: float  # convergence of f_D [1/s]
    lam: float  # attitude bandwidth [rad/s]
    zeta: float  # attitude damping ratio [-]
    k_q: float  # heading convergence [rad/s]
    nu_prime: bool  # nu' instead of nu
    m: float  # mass [kg]
    g: float  # gravity [m/s2]
    J: Vector  # principal inertias [kg m2]
    d: Vector  # thrust direction in the body frame: x_b for DarkO, z_b for a quadrotor
    M_pinv: tuple[Vector, Vector, Vector, Vector]  # rows of the pseudo-inverse of M_b (4, 3)
    u_bar: Virtual  # commands of a unit force without moment
    f_min: float  # bounds of f: it must stay positive, and within what the motors give [N]
    f_max: float


class Pointing(NamedTuple):
    """State of the law: what the attitude loop follows."""

    attitude: Quaternion  # q_d
    force: float  # f, along d [N]
    side: float = NOT_CHOSEN  # of q about q_d
    turn_side: float = NOT_CHOSEN  # of q_d about the attitude with the wanted heading


class ZeroMomentState(NamedTuple):
    """State slots of the law."""

    pointing: Pointing
    handover: Handover


class HoverGoal(NamedTuple):
    """A place to hover at, and how."""

    position: Vector  # world NWU [m]
    heading: float  # of the belly [rad]
    speed: float  # horizontal speed limit for the velocity governor [m/s]


class AttitudeTarget(NamedTuple):
    """An attitude to follow, with its motion in its own frame."""

    attitude: Quaternion  # q_d
    rates: Vector  # [rad/s]
    acceleration: Vector  # the derivative of those [rad/s2]


@kernel
def start(estimate: Estimate, gains: ZeroMomentGains, a: Airframe) -> Pointing:
    """Jump map on entering the law: q_d = q and f = the force given, so that nothing steps."""
    return pointing_at(estimate.attitude, axial_force(estimate.actuators, air_ahead(estimate), a), gains)


@kernel
def pointing_at(attitude: Quaternion, force: float, gains: ZeroMomentGains) -> Pointing:
    """The state of the law at an attitude with a force along d [N]."""
    return Pointing(attitude, clipped(force, gains.f_min, gains.f_max), NOT_CHOSEN, NOT_CHOSEN)


@kernel
def axial_force(actuators: Actuators, inflow: float, a: Airframe) -> float:
    """Thrust of both motors along the nose with the air from ahead [N]."""
    T1, T2 = thrusts(actuators, inflow, a)
    return (1.0 - a.S_ratio * a.C_d0) * (T1 + T2)


@kernel
def step(
    estimate: Estimate,
    reference: Reference,
    gains: ZeroMomentGains,
    a: Airframe,
    state: ZeroMomentState,
    dt: float,
) -> tuple[Actuators, int, ZeroMomentState]:
    """One tick: actuator commands, DARKO_SATURATION bits, and the state after it."""
    goal = HoverGoal(reference.position, reference.heading, reference.speed)
    u, pointing = fly_to(estimate, goal, gains, state.pointing, dt)
    inflow = air_ahead(estimate)
    u, handover = smoothed(u, estimate.actuators, a, state.handover, dt, inflow)
    command, saturation = allocate(u, a, inflow)
    return command, saturation, ZeroMomentState(pointing, handover)


@kernel
def fly_to(
    estimate: Estimate, goal: HoverGoal, gains: ZeroMomentGains, pointing: Pointing, dt: float
) -> tuple[Virtual, Pointing]:
    """The law towards a place, with the nose up."""
    e = subtract(estimate.position, goal.position)
    seen = Body(e, estimate.velocity, estimate.attitude, estimate.rates)
    return control(seen, hover(goal.heading), goal.speed, gains, pointing, dt)


@kernel
def control(
    body: Body, q_ref: Quaternion, speed: float, gains: ZeroMomentGains, pointing: Pointing, dt: float
) -> tuple[Virtual, Pointing]:
    """One tick of the law for any plant with a thrust: commands of M_pinv and u_bar, and the state after ``dt``.

    Args:
        body: The plant, its position relative to the target.
        q_ref: An attitude with d up and the wanted heading.
        speed: Horizontal speed limit for the velocity governor [m/s].
        gains: Gains of the law.
        pointing: Its state.
        dt: Tick [s].
    """
    pointing = sided(pointing, body.attitude, q_ref)
    w_d, w_d_dot, f_dot = desired_motion(body, q_ref, speed, gains, pointing)
    target = AttitudeTarget(pointing.attitude, w_d, w_d_dot)
    torque = attitude_torque(body.attitude, body.rates, target, gains, pointing.side)
    after = moved(pointing, w_d, f_dot, gains, dt)
    return realise(torque, pointing.force, gains), Pointing(
        normalised(after.attitude), after.force, after.side, after.turn_side
    )


@kernel
def sided(pointing: Pointing, q: Quaternion, q_ref: Quaternion) -> Pointing:
    """The law's state after the jumps of its sides (see :mod:`sitl.control.attitude_loop`)."""
    off, turn = multiply(conjugate(pointing.attitude), q), multiply(conjugate(q_ref), pointing.attitude)
    return Pointing(pointing.attitude, pointing.force, kept(pointing.side, off.w), kept(pointing.turn_side, turn.w))


@kernel
def desired_motion(
    body: Body, q_ref: Quaternion, speed: float, gains: ZeroMomentGains, pointing: Pointing
) -> tuple[Vector, Vector, float]:
    """Rates at which the law's state is to move: omega_d [rad/s], its derivative along the flow [rad/s2], f' [N/s].

    The first two are in the frame of q_d. Three instants of the flow, AHEAD apart, give omega_d twice: as it is and as
    it will be. Arguments as for :func:`control`.
    """
    f_r = wanted_force(body, speed, gains)
    body_1 = ahead(body, pointing, gains)
    f_r_1 = wanted_force(body_1, speed, gains)
    w_d, f_dot = steer(nu(f_r, f_r_1, pointing, gains), pointing, q_ref, gains)
    guide_1 = moved(pointing, w_d, f_dot, gains, AHEAD)
    f_r_2 = wanted_force(ahead(body_1, guide_1, gains), speed, gains)
    w_d_1, _ = steer(nu(f_r_1, f_r_2, guide_1, gains), guide_1, q_ref, gains)
    return w_d, scaled(subtract(w_d_1, w_d), PER_AHEAD), f_dot


@kernel
def wanted_force(body: Body, speed: float, gains: ZeroMomentGains) -> Vector:
    """Force f_r = m g e_3 + gamma(e_p, e_v) that the position loop wants, world [N]."""
    f = gamma(body.position, body.velocity, speed, gains.governor)
    return Vector(f.x, f.y, f.z + gains.m * gains.g)


@kernel
def ahead(body: Body, pointing: Pointing, gains: ZeroMomentGains) -> Body:
    """The plant AHEAD on, accelerated by the force that q_d promises or, for nu', that q gives."""
    q, w = body.attitude, body.rates
    pull = scaled(rotate(q if gains.nu_prime else pointing.attitude, gains.d), pointing.force * (1.0 / gains.m))
    return Body(
        add_scaled(body.position, body.velocity, AHEAD),
        add_scaled(body.velocity, Vector(pull.x, pull.y, pull.z - gains.g), AHEAD),
        multiply(q, small_rotation(scaled(w, AHEAD))) if gains.nu_prime else q,
        w,
    )


@kernel
def nu(f_r: Vector, f_r_ahead: Vector, pointing: Pointing, gains: ZeroMomentGains) -> Vector:
    """Rate at which R(q_d) d f is to change, world [N/s], of f_r now and AHEAD on [N]."""
    f_D = subtract(scaled(rotate(pointing.attitude, gains.d), pointing.force), f_r)
    return add_scaled(scaled(subtract(f_r_ahead, f_r), PER_AHEAD), f_D, -gains.k_delta)


@kernel
def steer(rate: Vector, pointing: Pointing, q_ref: Quaternion, gains: ZeroMomentGains) -> tuple[Vector, float]:
    """Rates by nu of the commanded attitude, omega_d in the frame of q_d [rad/s], and of the thrust, f' [N/s].

    f' stops at the bounds of f, so that omega_d, which divides by f, never meets zero.
    """
    pull = rotate_inverse(pointing.attitude, rate)
    off = multiply(conjugate(q_ref), pointing.attitude)
    along = dot(gains.d, Vector(off.x, off.y, off.z))
    turn = -gains.k_q * kept(pointing.turn_side, off.w) * along
    f_dot = dot(gains.d, pull)
    f_dot = max(f_dot, 0.0) if pointing.force <= gains.f_min else f_dot
    f_dot = min(f_dot, 0.0) if pointing.force >= gains.f_max else f_dot
    return add_scaled(scaled(cross(gains.d, pull), 1.0 / pointing.force), gains.d, turn), f_dot


@kernel
def moved(pointing: Pointing, w_d: Vector, f_dot: float, gains: ZeroMomentGains, dt: float) -> Pointing:
    """The state of the law ``dt`` later; q_d moves by the exponential map."""
    after = pointing_at(
        multiply(pointing.attitude, small_rotation(scaled(w_d, dt))), pointing.force + dt * f_dot, gains
    )
    return Pointing(after.attitude, after.force, pointing.side, pointing.turn_side)


@kernel
def attitude_torque(q: Quaternion, w: Vector, target: AttitudeTarget, gains: ZeroMomentGains, side: float) -> Vector:
    """Torque that makes q follow the attitude of a target, body frame [N m].

    Args:
        q: Attitude.
        w: Body rates [rad/s].
        target: What is followed.
        gains: Gains of the law.
        side: Of q about the target's attitude, or NOT_CHOSEN.
    """
    off = multiply(conjugate(target.attitude), q)
    w_r = rotate_inverse(off, target.rates)
    w_off = subtract(w, w_r)
    stiffness = -2.0 * gains.lam * gains.lam * kept(side, off.w)
    damping = -2.0 * gains.zeta * gains.lam
    follow = subtract(rotate_inverse(off, target.acceleration), cross(w_off, w_r))
    J = gains.J
    spin = cross(w, Vector(J.x * w.x, J.y * w.y, J.z * w.z))
    return Vector(
        J.x * (stiffness * off.x + damping * w_off.x + follow.x) + spin.x,
        J.y * (stiffness * off.y + damping * w_off.y + follow.y) + spin.y,
        J.z * (stiffness * off.z + damping * w_off.z + follow.z) + spin.z,
    )


@kernel
def realise(torque: Vector, f: float, gains: ZeroMomentGains) -> Virtual:
    """Commands of a torque, body frame [N m], and a force along d [N]."""
    M_pinv, u_bar = gains.M_pinv, gains.u_bar
    return Virtual(
        dot(M_pinv[0], torque) + u_bar.T1 * f,
        dot(M_pinv[1], torque) + u_bar.T2 * f,
        dot(M_pinv[2], torque) + u_bar.dT1 * f,
        dot(M_pinv[3], torque) + u_bar.dT2 * f,
    )
