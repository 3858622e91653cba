"""Flights as the authors' public source code simulates them: its plant, its laws and gains, its switch of laws.

The code is ``FlorianSan/stage_drone`` (commit 8ce2a8fd), its laws those of the report's sections 3.1, 3.2 and 4.1 and
of the thesis' chapter 3. The plant is the kernel that flies with the slips of the code that its figures show; thrusts
and elevons stop at their limits, the elevons' rate is limited, nothing lags; the laws run without a clock.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from sitl import Actuators, Airframe, Array, Body, Quaternion, Vector
from sitl.compiled import entry, subroutine
from sitl.control.hover_linear import SQRT_HALF
from sitl.design.lqr import hover_thrust, lqr
from sitl.lab.reproduction.equations.as_typed import (
    ALL_SLIPS,
    DRY_SHARE,
    Slip,
    forward_matrices,
    one_b_short,
    trim_state,
    typed_hover_linearisation,
    typed_moment_matrix,
    typed_trim,
)
from sitl.model.aerodynamics import wrench
from sitl.model.arithmetic import clipped
from sitl.model.phi_theory import damping, effective_speed
from sitl.model.quaternions import conjugate, multiply, normalised, rotate, rotate_inverse
from sitl.model.vectors import add_scaled, cross, scaled, subtract

PLANT_SLIPS = frozenset({Slip.AREA, Slip.ONE_NUMBER, Slip.DAMPING})  # those of the code that its flights show
DESIGN_SLIPS = frozenset({Slip.YAW_ARM, Slip.ROLL, Slip.STILL_ETA})  # of the linear model that its gains are made of
ELEVON_RATE = 5.0 * math.pi / 3.0  # ELEVON_RATE_CHANGE of the code, 60 deg in 0.2 s [rad/s]
STEP = 0.001  # of Runge-Kutta, and of the limited elevons [s]
SMALL_STEP = 1e-5  # step of the directional derivative [s]
HOVER_ATTITUDE = Quaternion(SQRT_HALF, 0.0, -SQRT_HALF, 0.0)
# Gains k_ap, k_ad, k_pp, k_pd, k_delta of the files that simulate the hover alone, and of those that switch laws.
HOVER_CODE_GAINS = (0.08, 0.1, 0.5, 1.2, 1.0)  # modele_darko_complet/generateContolleur.m; printed in the thesis
SWITCH_CODE_GAINS = (2.0, 2.0, 1.0, 1.0, 1.0)  # switch_hovering_vol/generateContolleur_hover.m
ERROR_REACH = 3.0  # thesis, chapter 3 [m]
DISTANT_LAW, NEAR_LAW = 1, 0  # the law of the distance and the linear hover law
CODE_STATES = 18  # p, v, q, w, and the zero-moment law's own q_d and f
MAX_JUMPS = 16
NEVER = math.inf  # as a level of V, or a rate that does not limit


class CodePlant(NamedTuple):
    """The plant of the public code."""

    a: Airframe  # in the slipstream
    air: Airframe  # in the free stream
    short: Airframe  # whose damping is that of the free stream, one B short
    one_number: bool  # delta T, too, where the free stream asks for delta
    short_damping: bool
    elevon_rate: float  # [rad/s]; NEVER: no limit


class HoverGains(NamedTuple):
    """u = u_bar - K x, and V = x' S x."""

    K: Array  # (4, 12)
    S: Array  # (12, 12)
    thrust: float  # of each motor in the hover [N]


class ZeroMomentCode(NamedTuple):
    """Gains of the hierarchical law as the public code has it, with nu' and the rates' error taken without turning."""

    k_ap: float  # [N m]
    k_ad: float  # [N m s]
    k_pp: float  # [N/m]
    k_pd: float  # [N s/m]
    k_delta: float  # [1/s]
    reach: float  # at which each axis of the position error stops [m]
    M_pinv: Array  # (4, 3)
    share: float  # thrust of each motor per unit of force along the nose


class CruiseGains(NamedTuple):
    """The linear forward law at the printed trim: u = u_trim - K (x - x_trim), x = (p_z, v, eps, w)."""

    K: Array  # (4, 10)
    x: Array  # (10,)
    u: Array  # (4,)


class Laws(NamedTuple):
    """The laws of a flight and the levels of V at which they hand over."""

    hover: HoverGains
    zero_moment: ZeroMomentCode
    cruise: CruiseGains
    cruises: bool  # the law of the distance is the forward one
    enter: float  # V at or below which the hover law takes over
    leave: float  # V at or above which it hands back


class Setting(NamedTuple):
    """Everything that a step of a flight does not change."""

    mode: int  # DISTANT_LAW or NEAR_LAW
    target: Vector  # world NWU [m]
    plant: CodePlant
    laws: Laws


class Route(NamedTuple):
    """Targets in turn."""

    targets: Array  # (n, 3) world NWU [m]
    until: Array  # times up to which each is flown to, (n,) [s]
    every: int  # steps per sample


class CodeFlight(NamedTuple):
    """A flight, one row per sample."""

    time: Array  # (n,) [s]
    state: Array  # (n, 18) p, v world NWU, q, body rates, q_d, f
    thrust: Array  # (n, 2) left, right [N]
    deflection: Array  # (n, 2) [rad]
    V: Array  # (n,)
    mode: Array  # (n,) DISTANT_LAW or NEAR_LAW
    jumps: Array  # times at which the law changes, (k,) [s]


def code_plant(a: Airframe, slips: frozenset[Slip] = PLANT_SLIPS, *, elevon_rate: float = ELEVON_RATE) -> CodePlant:
    """The plant of the public code.

    Args:
        a: The airframe.
        slips: Of the code; without any it is the kernel that flies.
        elevon_rate: Of the elevons at most [rad/s].
    """
    air = a._replace(S=(1.0 + DRY_SHARE) * a.S) if Slip.AREA in slips else a
    return CodePlant(a, air, one_b_short(air), Slip.ONE_NUMBER in slips, Slip.DAMPING in slips, elevon_rate)


def hover_gains(a: Airframe, slips: frozenset[Slip] = DESIGN_SLIPS) -> HoverGains:
    """LQR with Q = I, R = I on the hover's linear model."""
    K, S = lqr(*typed_hover_linearisation(a, slips), np.eye(12), np.eye(4))
    return HoverGains(np.ascontiguousarray(K), np.ascontiguousarray(S), hover_thrust(a).T1)


def zero_moment_code(a: Airframe, gains: tuple[float, float, float, float, float], reach: float) -> ZeroMomentCode:
    """The hierarchical law.

    Args:
        a: The airframe.
        gains: k_ap [N m], k_ad [N m s], k_pp [N/m], k_pd [N s/m], k_delta [1/s].
        reach: At which each axis of the position error stops [m].
    """
    M_pinv = np.ascontiguousarray(np.linalg.pinv(typed_moment_matrix(a, frozenset())))
    return ZeroMomentCode(*gains, reach, M_pinv, 0.5 / (1.0 - a.S_ratio * a.C_d0))


def cruise_gains(a: Airframe) -> CruiseGains:
    """LQR with Q = I, R = I at the printed 5 m/s, with the slips of the printed matrices."""
    theta, thrust, product = typed_trim(a, ALL_SLIPS)
    K, _ = lqr(*forward_matrices(a, ALL_SLIPS), np.eye(10), np.eye(4))
    return CruiseGains(
        np.ascontiguousarray(K), trim_state(theta)[:10].copy(), np.array([thrust, thrust, product, product])
    )


def laws_of(
    a: Airframe,
    gains: tuple[float, float, float, float, float] = HOVER_CODE_GAINS,
    *,
    reach: float = ERROR_REACH,
    enter: float = -NEVER,
    leave: float = NEVER,
    slips: frozenset[Slip] = DESIGN_SLIPS,
    cruises: bool = False,
) -> Laws:
    """The laws of a flight; without levels of V the first one flies on.

    Args:
        a: The airframe.
        gains: Of the hierarchical law, see :func:`zero_moment_code`.
        reach: Of its position error [m].
        enter: V at or below which the hover law takes over.
        leave: V at or above which it hands back.
        slips: Of the hover's linear model.
        cruises: The law of the distance is the linear forward one.
    """
    hover, zero = hover_gains(a, slips), zero_moment_code(a, gains, reach)
    return Laws(hover, zero, cruise_gains(a), cruises, enter, leave)


def fly(
    plant: CodePlant,
    laws: Laws,
    targets: tuple[tuple[float, float, float], ...],
    *,
    until: tuple[float, ...],
    attitude: Quaternion = HOVER_ATTITUDE,
    mode: int = DISTANT_LAW,
    sample: float = 0.02,
) -> CodeFlight:
    """Fly from rest at the origin.

    Args:
        plant: The plant.
        laws: The laws.
        targets: In turn, world NWU [m].
        until: Times up to which each is the target [s].
        attitude: At the start.
        mode: Law at the start.
        sample: Time between rows [s].
    """
    every = max(1, round(sample / STEP))
    count = round(until[-1] / STEP) // every + 1
    flight = CodeFlight(
        time=np.arange(count, dtype=np.float64) * (every * STEP),
        state=np.zeros((count, CODE_STATES)),
        thrust=np.zeros((count, 2)),
        deflection=np.zeros((count, 2)),
        V=np.zeros(count),
        mode=np.zeros(count),
        jumps=np.full(MAX_JUMPS, np.nan),
    )
    z = np.zeros(CODE_STATES)
    z[6:10], z[13:17], z[17] = attitude, HOVER_ATTITUDE, plant.a.m * plant.a.g
    route = Route(np.array(targets, dtype=np.float64), np.array(until), every)
    taken = _record(flight, z, mode, route, plant, laws)
    return flight._replace(jumps=flight.jumps[:taken])


@entry
def _record(flight: CodeFlight, z: Array, mode: int, route: Route, plant: CodePlant, laws: Laws) -> int:
    """Fly and fill the rows; the number of jumps."""
    leg, taken, elevons, began = 0, 0, np.zeros(2), False
    for k in range((flight.time.shape[0] - 1) * route.every + 1):
        if leg + 1 < route.targets.shape[0] and k * STEP >= route.until[leg] - 0.5 * STEP:
            leg += 1
        target = Vector(route.targets[leg, 0], route.targets[leg, 1], route.targets[leg, 2])
        V = quadratic(z, target, laws.hover.S)
        due = laws.enter >= V if mode == DISTANT_LAW else laws.leave <= V
        if due and taken < MAX_JUMPS:
            flight.jumps[taken] = k * STEP
            mode, taken = 1 - mode, taken + 1
        now = Setting(mode, target, plant, laws)
        _move(elevons, _limited(_command(z, now)[0], plant.a), plant, began)
        began = True
        if k % route.every == 0:
            _store(flight, k // route.every, z, V, now, elevons)
        k1 = _derivative(z, now, elevons)
        k2 = _derivative(z + 0.5 * STEP * k1, now, elevons)
        k3 = _derivative(z + 0.5 * STEP * k2, now, elevons)
        k4 = _derivative(z + STEP * k3, now, elevons)
        z = z + STEP / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        _normalise(z)
    return taken


@subroutine
def _move(elevons: Array, wanted: tuple[float, float, float, float], plant: CodePlant, began: bool) -> None:
    """Turn the elevons towards what is commanded, as a rate limiter does; they begin there."""
    most = plant.elevon_rate * STEP if began else NEVER
    for i in range(2):
        elevons[i] += clipped(wanted[2 + i] - elevons[i], -most, most)


@subroutine
def _normalise(z: Array) -> None:
    for at in (6, 13):
        size = math.sqrt(z[at] ** 2 + z[at + 1] ** 2 + z[at + 2] ** 2 + z[at + 3] ** 2)
        for i in range(at, at + 4):
            z[i] /= size


@subroutine
def _store(flight: CodeFlight, row: int, z: Array, V: float, now: Setting, elevons: Array) -> None:
    flight.state[row] = z
    flight.V[row], flight.mode[row] = V, now.mode
    flight.thrust[row, 0], flight.thrust[row, 1], _, _ = _limited(_command(z, now)[0], now.plant.a)
    flight.deflection[row] = elevons


@subroutine
def _limited(u: Array, a: Airframe) -> tuple[float, float, float, float]:
    """Thrusts [N] and deflections [rad] within the actuators' limits."""
    low, high = a.k_f * a.omega_min * a.omega_min, a.k_f * a.omega_max * a.omega_max
    T1, T2 = clipped(u[0], low, high), clipped(u[1], low, high)
    return T1, T2, clipped(u[2] / T1, -a.delta_max, a.delta_max), clipped(u[3] / T2, -a.delta_max, a.delta_max)


@subroutine
def deviation(z: Array, target: Vector) -> Array:
    """The vector (p - p_e, v, eps - eps_bar, w), (12,)."""
    x = np.empty(12)
    x[0], x[1], x[2] = z[0] - target.x, z[1] - target.y, z[2] - target.z
    x[3:6], x[6:9], x[9:12] = z[3:6], z[7:10], z[10:13]
    x[7] += SQRT_HALF
    return x


@subroutine
def quadratic(z: Array, target: Vector, S: Array) -> float:
    """V = x' S x."""
    x = deviation(z, target)
    return float(np.dot(x, np.dot(S, x)))


@subroutine
def _command(z: Array, now: Setting) -> tuple[Array, Vector, float]:
    """The input (T1, T2, delta1 T1, delta2 T2), and the motion of q_d and f."""
    laws = now.laws
    u, w_d, f_dot = zero_moment(z, now.target, now.plant.a, laws.zero_moment)
    if now.mode == NEAR_LAW:
        u = -np.dot(laws.hover.K, deviation(z, now.target))
        u[0] += laws.hover.thrust
        u[1] += laws.hover.thrust
    elif laws.cruises:
        x = np.empty(10)
        x[0:4], x[4:7], x[7:10] = z[2:6], z[7:10], z[10:13]
        u = laws.cruise.u - np.dot(laws.cruise.K, x - laws.cruise.x)
    return u, w_d, f_dot


@subroutine
def _derivative(z: Array, now: Setting, elevons: Array) -> Array:
    plant, a = now.plant, now.plant.a
    q, w = _quaternion(z, 6), _vector(z, 10)
    u, w_d, f_dot = _command(z, now)
    T1, T2, d1, d2 = _limited(u, a)
    if plant.elevon_rate < NEVER:
        d1, d2 = elevons[0], elevons[1]
    v_b = rotate_inverse(q, _vector(z, 3))
    F, M = code_wrench(v_b, w, Actuators(T1, T2, d1, d2), plant)
    pull = rotate(q, F)
    spin = cross(w, Vector(a.J1 * w.x, a.J2 * w.y, a.J3 * w.z))
    out = np.empty(CODE_STATES)
    out[0:3] = z[3:6]
    out[3], out[4], out[5] = pull.x / a.m, pull.y / a.m, pull.z / a.m - a.g
    _store_turn(out, 6, q, w)
    out[10], out[11], out[12] = (M.x - spin.x) / a.J1, (M.y - spin.y) / a.J2, (M.z - spin.z) / a.J3
    _store_turn(out, 13, _quaternion(z, 13), w_d)
    out[17] = f_dot
    return out


@subroutine
def code_wrench(v_b: Vector, w: Vector, thrust_and_elevon: Actuators, plant: CodePlant) -> tuple[Vector, Vector]:
    """Force [N] and moment [N m] in the body frame, of thrusts [N] in place of the motors' speeds and of elevons."""
    T1, T2, d1, d2 = thrust_and_elevon
    still, a = Vector(0.0, 0.0, 0.0), plant.a
    F, M = wrench(still, still, Actuators(math.sqrt(T1 / a.k_f), math.sqrt(T2 / a.k_f), d1, d2), a)
    e1, e2 = (T1 * d1, T2 * d2) if plant.one_number else (d1, d2)
    F_air, M_air = wrench(v_b, w, Actuators(0.0, 0.0, e1, e2), plant.air)
    F, M = add_scaled(F, F_air, 1.0), add_scaled(M, M_air, 1.0)
    if plant.short_damping:
        h = 0.5 * plant.air.rho * plant.air.S * effective_speed(v_b, w, plant.air)
        M = add_scaled(M, subtract(damping(w, 0.0, h, plant.short), damping(w, 0.0, h, plant.air)), 1.0)
    return F, M


@subroutine
def zero_moment(z: Array, target: Vector, a: Airframe, law: ZeroMomentCode) -> tuple[Array, Vector, float]:
    """The hierarchical law: u, omega_d [rad/s] and f' [N/s].

    The rates' error is w - omega_d, although omega_d is told in the frame of q_d: so the code has it.
    """
    p, v, q, w = subtract(_vector(z, 0), target), _vector(z, 3), _quaternion(z, 6), _vector(z, 10)
    q_d, f = _quaternion(z, 13), z[17]
    w_d, f_dot = _steer(Body(p, v, q, w), q_d, f, a, law)
    pull = scaled(rotate(q, Vector(1.0, 0.0, 0.0)), f / a.m)
    later = add_scaled(v, Vector(pull.x, pull.y, pull.z - a.g), SMALL_STEP)
    ahead = Body(add_scaled(p, v, SMALL_STEP), later, _turned(q, w), w)
    w_d_1, _ = _steer(ahead, _turned(q_d, w_d), f + SMALL_STEP * f_dot, a, law)
    follow = scaled(subtract(w_d_1, w_d), 1.0 / SMALL_STEP)
    off, J = multiply(conjugate(q_d), q), Vector(a.J1, a.J2, a.J3)
    spin, side = cross(w, Vector(J.x * w.x, J.y * w.y, J.z * w.z)), 1.0 if off.w >= 0.0 else -1.0
    torque = np.array(
        (
            -law.k_ap * side * off.x - law.k_ad * (w.x - w_d.x) + spin.x + J.x * follow.x,
            -law.k_ap * side * off.y - law.k_ad * (w.y - w_d.y) + spin.y + J.y * follow.y,
            -law.k_ap * side * off.z - law.k_ad * (w.z - w_d.z) + spin.z + J.z * follow.z,
        )
    )
    u = np.dot(law.M_pinv, torque)
    u[0] += law.share * f
    u[1] += law.share * f
    return u, w_d, f_dot


@subroutine
def _steer(body: Body, q_d: Quaternion, f: float, a: Airframe, law: ZeroMomentCode) -> tuple[Vector, float]:
    """omega_d and f' of nu' (report, appendix D), its k_pd^2 / m^2 with one m, as typed there."""
    p, v, q, _ = body
    nose, x = Vector(1.0, 0.0, 0.0), law.reach
    e = Vector(clipped(p.x, -x, x), clipped(p.y, -x, x), clipped(p.z, -x, x))
    wanted = add_scaled(add_scaled(Vector(0.0, 0.0, a.m * a.g), e, -law.k_pp), v, -law.k_pd)
    along = scaled(rotate(q_d, nose), f)
    by_mass = law.k_pd / a.m
    nu = add_scaled(scaled(e, law.k_pp * by_mass), v, law.k_pd * by_mass - law.k_pp)
    nu = add_scaled(nu, subtract(along, wanted), -by_mass - law.k_delta)
    nu = add_scaled(nu, subtract(scaled(rotate(q, nose), f), along), -by_mass)
    pull = rotate_inverse(q_d, nu)
    return scaled(cross(nose, pull), 1.0 / f), pull.x


@subroutine
def _turned(q: Quaternion, w: Vector) -> Quaternion:
    half = 0.5 * SMALL_STEP
    return normalised(multiply(q, Quaternion(1.0, half * w.x, half * w.y, half * w.z)))


@subroutine
def _store_turn(out: Array, at: int, q: Quaternion, w: Vector) -> None:
    """Kinematics q' = q ⊗ (0, w) / 2."""
    turn = multiply(q, Quaternion(0.0, w.x, w.y, w.z))
    out[at], out[at + 1], out[at + 2], out[at + 3] = 0.5 * turn.w, 0.5 * turn.x, 0.5 * turn.y, 0.5 * turn.z


@subroutine
def _vector(z: Array, at: int) -> Vector:
    return Vector(z[at], z[at + 1], z[at + 2])


@subroutine
def _quaternion(z: Array, at: int) -> Quaternion:
    return Quaternion(z[at], z[at + 1], z[at + 2], z[at + 3])


class SteadyClimb(NamedTuple):
    """Straight flight at one speed along the nose."""

    pitch: float  # of the sequence heading, lean, pitch; nose up negative [rad]
    motor: float  # [rad/s]
    elevon: float  # [rad]
    speed: float  # [m/s]


def steady_climb(plant: CodePlant, direction: Array, nose_speed: float, heading: float) -> SteadyClimb:
    """The climb on a straight path with a heading that need not be the path's: the wing knows no side force.

    Args:
        plant: The plant.
        direction: Of the path, world NWU, (3,).
        nose_speed: Along the nose, v_bx [m/s].
        heading: Of the nose [rad].
    """
    from scipy.optimize import fsolve  # noqa: PLC0415 - a second that only designs need

    a, along = plant.a, np.asarray(direction) / np.linalg.norm(direction)

    def residual(z: Array) -> tuple[float, float, float, float]:
        q = _heading_then_pitch(heading, z[0])
        v_b = rotate_inverse(q, Vector(*(z[3] * along).tolist()))
        F, M = code_wrench(v_b, Vector(0.0, 0.0, 0.0), Actuators(z[1], z[1], z[2], z[2]), plant)
        weight = rotate_inverse(q, Vector(0.0, 0.0, a.m * a.g))
        return F.x - weight.x, F.z - weight.z, M.y, v_b.x - nose_speed

    pitch, thrust, elevon, speed = fsolve(residual, [-0.8, 2.1, 0.1, 1.2 * nose_speed])
    return SteadyClimb(float(pitch), math.sqrt(float(thrust) / a.k_f), float(elevon), float(speed))


def _heading_then_pitch(heading: float, pitch: float) -> Quaternion:
    turn = Quaternion(math.cos(0.5 * heading), 0.0, 0.0, math.sin(0.5 * heading))
    return multiply(turn, Quaternion(math.cos(0.5 * pitch), 0.0, math.sin(0.5 * pitch), 0.0))
