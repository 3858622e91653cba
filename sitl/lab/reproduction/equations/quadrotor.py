"""A plain quadrotor, on which the report first flew the zero-moment law (section 3.2), under that law.

Without aerodynamics: m v' = R(q) F_b u - m g e_3, J w' = M_b u - w × J w, with u the thrusts of the front, left,
back and right rotor of a cross in the body frame FLU; neighbouring rotors turn opposite ways.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sitl import PERIOD, Array, Body, Quaternion, Vector, kernel
from sitl.compiled import entry
from sitl.control.allocation import Virtual
from sitl.control.governor import LINEAR, GovernorParameters
from sitl.control.hover_zero_moment import ZeroMomentGains, control, pointing_at, wanted_force
from sitl.model.quaternions import normalised, rotate, z_axis
from sitl.model.vectors import add_scaled, norm, scaled, subtract
from sitl.simulation.flight import SUBSTEPS

QUADROTOR_SPEED_LIMIT = 3.0  # horizontal speed limit of the velocity governor [m/s]


class Quadrotor(NamedTuple):
    """Constants of a quadrotor."""

    m: float  # mass [kg]
    J1: float  # principal inertia about x_b [kg m2]
    J2: float  # principal inertia about y_b [kg m2]
    J3: float  # principal inertia about z_b [kg m2]
    g: float  # gravity [m/s2]
    arm: float  # rotor axis to centre of mass [m]
    torque: float  # reaction torque per thrust [m]
    T_max: float  # largest thrust of a rotor [N]


QUADROTOR = Quadrotor(m=0.5, J1=3e-3, J2=3e-3, J3=5e-3, g=9.81, arm=0.17, torque=0.016, T_max=3.0)


class QuadrotorFlight(NamedTuple):
    """A flight, one row per control period."""

    time: Array  # (n,) [s]
    position: Array  # (n, 3) world NWU [m]
    f_delta: Array  # R(q_d) d f - f_r, (n, 3) [N]
    attitude: Array  # (n, 4)
    is_limited: Array  # whether a thrust was limited, 1 or 0, (n,)


def force_matrix() -> Array:
    """Input matrix F_b of the forces, (3, 4): all thrusts along z_b."""
    return np.vstack([np.zeros((2, 4)), np.ones((1, 4))])


def moment_matrix(a: Quadrotor) -> Array:
    """Input matrix M_b of the moments, (3, 4)."""
    lever, turn = a.arm, a.torque
    return np.array([[0.0, lever, 0.0, -lever], [-lever, 0.0, lever, 0.0], [turn, -turn, turn, -turn]])


def quadrotor_gains(a: Quadrotor = QUADROTOR, *, nu_prime: bool = False, governor: int = LINEAR) -> ZeroMomentGains:
    """The zero-moment law for a plain quadrotor; its thrust direction is z_b."""
    roll, turn = 0.5 / a.arm, 0.25 / a.torque  # the rows of M_b are orthogonal: each over its square
    return ZeroMomentGains(
        governor=GovernorParameters(
            kind=governor, k_pp=1.5, k_pd=1.5, m=a.m, M=0.5, error_limit=1.0, v_down=2.0, v_up=2.5
        ),
        k_delta=5.0,
        lam=10.0,
        zeta=0.8,
        k_q=1.0,
        nu_prime=nu_prime,
        m=a.m,
        g=a.g,
        J=Vector(a.J1, a.J2, a.J3),
        d=Vector(0.0, 0.0, 1.0),
        M_pinv=(
            Vector(0.0, -roll, turn),
            Vector(roll, 0.0, -turn),
            Vector(0.0, roll, turn),
            Vector(-roll, 0.0, -turn),
        ),
        u_bar=Virtual(0.25, 0.25, 0.25, 0.25),
        f_min=0.1 * a.m * a.g,
        f_max=0.95 * 4.0 * a.T_max,
    )


@kernel
def derivative(body: Body, force: float, moment: Vector, a: Quadrotor) -> Body:
    """Rates of change of the body under a force along z_b [N] and a moment, body frame [N m]."""
    z, q, w = z_axis(body.attitude), body.attitude, body.rates
    pull = force / a.m
    return Body(
        body.velocity,
        Vector(pull * z.x, pull * z.y, pull * z.z - a.g),
        Quaternion(
            0.5 * (-q.x * w.x - q.y * w.y - q.z * w.z),
            0.5 * (q.w * w.x + q.y * w.z - q.z * w.y),
            0.5 * (q.w * w.y + q.z * w.x - q.x * w.z),
            0.5 * (q.w * w.z + q.x * w.y - q.y * w.x),
        ),
        Vector(
            (moment.x - (a.J3 - a.J2) * w.y * w.z) / a.J1,
            (moment.y - (a.J1 - a.J3) * w.x * w.z) / a.J2,
            (moment.z - (a.J2 - a.J1) * w.x * w.y) / a.J3,
        ),
    )


@kernel
def step(body: Body, u: Virtual, a: Quadrotor, dt: float) -> tuple[Body, bool]:
    """The body ``dt`` later (Runge-Kutta 4, quaternion kept unit), and whether a thrust was limited to 0..T_max.

    Args:
        body: At the beginning of the step.
        u: Thrusts of the front, left, back and right rotor [N].
        a: The quadrotor.
        dt: Step [s].
    """
    front, left = min(max(u.T1, 0.0), a.T_max), min(max(u.T2, 0.0), a.T_max)
    back, right = min(max(u.dT1, 0.0), a.T_max), min(max(u.dT2, 0.0), a.T_max)
    cut = front != u.T1 or left != u.T2 or back != u.dT1 or right != u.dT2
    force = front + left + back + right
    moment = Vector(a.arm * (left - right), a.arm * (back - front), a.torque * (front - left + back - right))
    k1 = derivative(body, force, moment, a)
    k2 = derivative(_advanced(body, k1, 0.5 * dt), force, moment, a)
    k3 = derivative(_advanced(body, k2, 0.5 * dt), force, moment, a)
    k4 = derivative(_advanced(body, k3, dt), force, moment, a)
    outer, inner = dt / 6.0, dt / 3.0
    after = _advanced(_advanced(_advanced(_advanced(body, k1, outer), k2, inner), k3, inner), k4, outer)
    return Body(after.position, after.velocity, normalised(after.attitude), after.rates), cut


@kernel
def _advanced(body: Body, rate: Body, dt: float) -> Body:
    q, k = body.attitude, rate.attitude
    return Body(
        add_scaled(body.position, rate.position, dt),
        add_scaled(body.velocity, rate.velocity, dt),
        Quaternion(q.w + dt * k.w, q.x + dt * k.x, q.y + dt * k.y, q.z + dt * k.z),
        add_scaled(body.rates, rate.rates, dt),
    )


def fly(
    attitude: Quaternion, target: Vector, q_ref: Quaternion, gains: ZeroMomentGains, a: Quadrotor, periods: int
) -> QuadrotorFlight:
    """Fly from rest at the origin to a target under the zero-moment law; it begins with the thrust of a hover.

    Args:
        attitude: At the start.
        target: World NWU [m].
        q_ref: Attitude at the end.
        gains: Gains of the law.
        a: The quadrotor.
        periods: Control periods.
    """
    flight = QuadrotorFlight(
        time=np.arange(periods, dtype=np.float64) * PERIOD,
        position=np.empty((periods, 3)),
        f_delta=np.empty((periods, 3)),
        attitude=np.empty((periods, 4)),
        is_limited=np.empty(periods),
    )
    _record_flight(flight, attitude, target, q_ref, gains, a)
    return flight


@entry
def _record_flight(
    flight: QuadrotorFlight,
    attitude: Quaternion,
    target: Vector,
    q_ref: Quaternion,
    gains: ZeroMomentGains,
    a: Quadrotor,
) -> None:
    rest = Vector(0.0, 0.0, 0.0)
    body, pointing = Body(rest, rest, attitude, rest), pointing_at(attitude, a.m * a.g, gains)
    for k in range(flight.time.shape[0]):
        p, q = body.position, body.attitude
        off = Body(subtract(p, target), body.velocity, q, body.rates)
        wanted = wanted_force(off, QUADROTOR_SPEED_LIMIT, gains)
        f_delta = subtract(scaled(rotate(pointing.attitude, gains.d), pointing.force), wanted)
        u, pointing = control(off, q_ref, QUADROTOR_SPEED_LIMIT, gains, pointing, PERIOD)
        flight.position[k, 0], flight.position[k, 1], flight.position[k, 2] = p.x, p.y, p.z
        flight.f_delta[k, 0], flight.f_delta[k, 1], flight.f_delta[k, 2] = f_delta.x, f_delta.y, f_delta.z
        flight.attitude[k, 0], flight.attitude[k, 1] = q.w, q.x
        flight.attitude[k, 2], flight.attitude[k, 3] = q.y, q.z
        flight.is_limited[k] = 0.0
        for _ in range(SUBSTEPS):
            body, was_limited = step(body, u, a, PERIOD / SUBSTEPS)
            flight.is_limited[k] = 1.0 if was_limited else flight.is_limited[k]


@entry
def force_errors(e: Array, v: Array, pointing: Array, speed: float, gains: ZeroMomentGains) -> Array:
    """|f_delta| = |R(q_d) d f - f_r| over a flight, (n,) [N].

    Args:
        e: Position errors, world, (n, 3) [m].
        v: Velocities, world, (n, 3) [m/s].
        pointing: q_d and f of the law, (n, 5).
        speed: Horizontal speed limit [m/s].
        gains: Gains of the law.
    """
    errors = np.empty(e.shape[0])
    for k in range(e.shape[0]):
        q_d = Quaternion(pointing[k, 0], pointing[k, 1], pointing[k, 2], pointing[k, 3])
        p, u = Vector(e[k, 0], e[k, 1], e[k, 2]), Vector(v[k, 0], v[k, 1], v[k, 2])
        wanted = wanted_force(Body(p, u, q_d, Vector(0.0, 0.0, 0.0)), speed, gains)
        errors[k] = norm(subtract(scaled(rotate(q_d, gains.d), pointing[k, 4]), wanted))
    return errors
