"""The kernel that flies with the report's slips switched on, one by one: its printed matrices were computed with them.

Every function calls :func:`sitl.model.aerodynamics.wrench` and changes of its result what the slips in ``slips``
change; without any it is the kernel. The report's public source code, which its section 5.3 cites, has all but the
last of them in its text. x is (p_z, v, eps, w, eta), (11,); u is (T1, T2, D1, D2), where D is a deflection or, with
``Slip.ONE_NUMBER``, also delta T.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from enum import Enum

import numpy as np

from sitl import Actuators, Airframe, Array, Vector
from sitl.design import linearise
from sitl.design.lqr import hover_thrust
from sitl.model.aerodynamics import inertia, wrench
from sitl.model.phi_theory import damping, effective_speed

# The matrices that the report prints, digit by digit.


DIGIT = 0.005  # half a unit of the last printed digit

# Section 3.1.2: A of (p, v, eps, w) at the hover is printed in symbols; these are what it multiplies.
_TILT, _TURN = math.sqrt(2.0), math.sqrt(2.0) / 4.0
PRINTED_TILT = np.array([[0.0, 2.0 * _TILT, 0.0], [-_TILT, 0.0, _TILT], [0.0, -_TILT, 0.0]])  # times g
PRINTED_TURN = np.array([[_TURN, 0.0, -_TURN], [0.0, _TURN, 0.0], [_TURN, 0.0, _TURN]])
# Section 3.1.3: the LQR gain; its seventh column belongs to the quaternion's scalar.
PRINTED_GAIN = np.array(
    [
        [0.08, -0.71, 0.70, 0.14, -1.04, 0.92, 0.00, 5.75, -1.29, -5.69, 0.05, 0.00, -0.81],
        [0.08, 0.71, 0.70, 0.14, 1.04, 0.92, 0.00, -5.75, -1.29, 5.69, -0.05, 0.00, 0.81],
        [-0.70, -0.05, 0.08, -1.13, -0.07, 0.09, 0.00, -0.11, -15.32, -0.88, -0.71, -1.41, -0.06],
        [-0.70, 0.05, 0.08, -1.13, 0.07, 0.09, 0.00, 0.11, -15.32, 0.88, 0.71, -1.41, 0.06],
    ]
)
# Section 4.1: the linear model at 5 m/s.
PRINTED_A = np.array(
    [
        [0, 0, 0, 1, 0, 0, 0, 0, 0, 0],
        [0, -2.56, 0, 1.58, 0, 53.84, 0, 0, 0, 0],
        [0, 0, 0, 0, -16.76, 0, 10.20, -0.05, 0, -0.12],
        [0, 1.30, 0, -0.83, 0, -20.06, 0, 0, 0, 0],
        [0, 0, 0, 0, 0, 0, 0, 0.43, 0, -0.26],
        [0, 0, 0, 0, 0, -0.27, 0, 0, 0.43, 0],
        [0, 0, 0, 0, 0, 0, 0, 0.26, 0, 0.43],
        [0, 0, 0, 0, 0, 0, 0, -3.42, 0, 0.17],
        [0, 4.77, 0, -5.87, 0, -90.65, 0, 0, -7.77, 0],
        [0, 0, 0, 0, 0, 0, 0, -0.98, 0, 0.41],
    ]
)
PRINTED_B = np.array(
    [
        [0, 0, 0, 0],
        [0.92, 0.92, 2.31, 2.31],
        [0, 0, 0, 0],
        [1.79, 1.79, -1.21, -1.21],
        [0, 0, 0, 0],
        [0, 0, 0, 0],
        [0, 0, 0, 0],
        [7.33, -7.33, -68.36, 68.36],
        [0, 0, -11.60, -11.60],
        [-25.58, 25.58, -0.18, 0.18],
    ]
)

# Section 3.2: the pseudo-inverse of M_b.
PRINTED_INVERSE = np.array([[0, 0, -3.23], [0, 0, 3.23], [-4.51, -27.75, -1.49], [4.51, -27.75, 1.49]])
PRINTED_START = np.array([0.90, 0.19, 0.36, 0.15])  # section 3.2.2: the quaternion of roll 10, pitch -45, yaw 25 deg


PRINTED_SPEED = 5.0  # of the printed forward trim [m/s]
DRY_SHARE = 0.15  # wing area outside the slipstream over the one inside, in the report's source code


class Slip(Enum):
    """A slip of the report; the value says what it does."""

    AREA = "the free stream acts on S = 1.15 S_wet, of which only S_wet = 0.0743 m2 is printed"
    ONE_NUMBER = "one number stands for delta T in the slipstream and for delta in the free stream"
    YAW_ARM = "the motors' arm p_y alone for yaw"
    ROLL = "roll by a_y C_l xi_m, without S/4S_p and with xi_m for xi_f"
    AIR_ARM = "[a_i]x with the other sign in the free stream"
    DAMPING = "damping B Phi(mw) w, one B short"
    STILL_ETA = "the quaternion's eta held still where eps moves"
    SIMULINK_NORM = "Simulink's quaternion normalisation, gain 1/2"


ALL_SLIPS = frozenset(Slip)
HOVER_SLIPS = frozenset({Slip.YAW_ARM, Slip.ROLL, Slip.STILL_ETA})  # of section 3.1
A_SLIPS = frozenset({Slip.AREA, Slip.ONE_NUMBER, Slip.DAMPING, Slip.STILL_ETA, Slip.SIMULINK_NORM})  # of section 4.1
B_SLIPS = frozenset({Slip.AREA, Slip.ONE_NUMBER, Slip.YAW_ARM, Slip.ROLL, Slip.AIR_ARM})
ZERO_VECTOR = np.zeros(3)


def cross_matrix(v: Array) -> Array:
    """[v]× of a vector."""
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


def kernel_wrench(v_b: Array, w: Array, T: Array, deflections: Array, a: Airframe) -> tuple[Array, Array]:
    """Force and moment of the kernel that flies, for thrusts [N] and deflections [rad]."""
    left, right = np.sqrt(np.maximum(T, 0.0) / a.k_f).tolist()
    actuators = Actuators(left, right, *(float(x) for x in deflections))
    F, M = wrench(Vector(*v_b.tolist()), Vector(*w.tolist()), actuators, a)
    return np.array(F), np.array(M)


def typed_forces(
    v_b: Array, w: Array, T: Array, D: Array, a: Airframe, slips: frozenset[Slip] = ALL_SLIPS
) -> tuple[Array, Array]:
    """Force and moment of the kernel, the slipstream's and the free stream's parts each with its slips."""
    nothing = np.zeros(2)
    air = a._replace(S=(1.0 + DRY_SHARE) * a.S) if Slip.AREA in slips else a
    blown = D / T if Slip.ONE_NUMBER in slips else D
    F_blown, M_blown = kernel_wrench(ZERO_VECTOR, ZERO_VECTOR, T, blown, a)
    F_air, M_air = kernel_wrench(v_b, w, nothing, D, air)
    M = M_blown + M_air
    if Slip.YAW_ARM in slips:
        M[2] -= a.S_ratio * a.a_y * a.C_d0 * (T[0] - T[1])
    if Slip.ROLL in slips:
        by_elevons = M_blown[0] - kernel_wrench(ZERO_VECTOR, ZERO_VECTOR, T, nothing, a)[1][0]
        M[0] += by_elevons * (a.xi_m / (a.S_ratio * a.xi_f) - 1.0)
    if Slip.AIR_ARM in slips:
        by_elevons = M_air - kernel_wrench(v_b, w, nothing, nothing, air)[1]
        M[[0, 2]] -= 2.0 * by_elevons[[0, 2]] - 2.0 * _elevon_damping(v_b, w, D, air)[[0, 2]]
    if Slip.DAMPING in slips:
        M += _damping(v_b, w, nothing, one_b_short(air)) - _damping(v_b, w, nothing, air)
    return F_blown + F_air, M


def _elevon_damping(v_b: Array, w: Array, D: Array, a: Airframe) -> Array:
    return _damping(v_b, w, D, a) - _damping(v_b, w, np.zeros(2), a)


def _damping(v_b: Array, w: Array, D: Array, a: Airframe) -> Array:
    rates = Vector(*w.tolist())
    h = 0.5 * a.rho * a.S * effective_speed(Vector(*v_b.tolist()), rates, a)
    return np.array(damping(rates, float(D.sum()), h, a))


def one_b_short(a: Airframe) -> Airframe:
    """Coefficients with which B Phi(mw) B w is B Phi(mw) w."""
    by_span = {name: getattr(a, name) / a.b for name in ("C_lp", "C_lr", "C_mp", "C_mr", "C_np", "C_nr")}
    by_chord = {name: getattr(a, name) / a.c for name in ("C_lq", "C_mq", "C_nq")}
    return a._replace(**by_span, **by_chord)


def typed_moment_matrix(a: Airframe, slips: frozenset[Slip] = HOVER_SLIPS) -> Array:
    """M_b of section 2.2.1 out of the kernel at rest, (3, 4), of (T1, T2, delta1 T1, delta2 T2)."""
    return _input_matrices(a, slips)[1]


def typed_force_matrix(a: Airframe) -> Array:
    """F_b of section 2.2.1 out of the kernel at rest, (3, 4)."""
    return _input_matrices(a, frozenset())[0]


def _input_matrices(a: Airframe, slips: frozenset[Slip]) -> tuple[Array, Array]:
    slips = slips - {Slip.ONE_NUMBER}
    columns = []
    for side in np.eye(2):
        plain = np.concatenate(typed_forces(ZERO_VECTOR, ZERO_VECTOR, side, np.zeros(2), a, slips))
        turned = np.concatenate(typed_forces(ZERO_VECTOR, ZERO_VECTOR, side, side, a, slips))
        columns.append((plain, turned - plain))
    both = np.array([columns[0][0], columns[1][0], columns[0][1], columns[1][1]]).T
    return both[:3], both[3:]


def typed_hover_linearisation(a: Airframe, slips: frozenset[Slip] = HOVER_SLIPS) -> tuple[Array, Array]:
    """A (12, 12) and B (12, 4) at the hover of the plant that flies, by differences, with the slips of 3.1.2."""
    T = hover_thrust(a).T1
    A, B = linearise.differences(
        a, linearise.StraightFlight(0.0, 0.0, 0.5 * math.pi, T, 0.0), Slip.STILL_ETA not in slips
    )
    B[:, 2:] /= T
    B[9:12] = typed_moment_matrix(a, slips) / inertia(a)[:, None]
    return A, B


def typed_derivative(x: Array, u: Array, a: Airframe, slips: frozenset[Slip] = ALL_SLIPS) -> Array:
    """d/dt of (p_z, v, eps, w), (10,)."""
    v, eps, w = x[1:4], x[4:7], x[7:10]
    eta = x[10] if Slip.STILL_ETA in slips else math.sqrt(1.0 - eps @ eps)
    R = np.eye(3) + 2.0 * eta * cross_matrix(eps) + 2.0 * cross_matrix(eps) @ cross_matrix(eps)
    F, M = typed_forces(R.T @ v, w, u[:2], u[2:], a, slips)
    J = inertia(a)
    eps_dot = 0.5 * (eta * w + np.cross(eps, w))
    if Slip.SIMULINK_NORM in slips:
        eps_dot = eps_dot + 0.5 * (1.0 - x[10] ** 2 - eps @ eps) * eps
    return np.concatenate(([v[2]], R @ F / a.m - [0.0, 0.0, a.g], eps_dot, (M - np.cross(w, J * w)) / J))


def typed_trim(a: Airframe, slips: frozenset[Slip] = ALL_SLIPS) -> tuple[float, float, float]:
    """Angle theta [rad], thrust T per motor [N] and D of level flight at the printed 5 m/s."""
    from scipy.optimize import fsolve  # noqa: PLC0415 - a second that only designs need

    def residual(z: Array) -> tuple[float, float, float]:
        f = typed_derivative(trim_state(z[0]), np.array([z[1], z[1], z[2], z[2]]), a, slips)
        return float(f[1]), float(f[3]), float(f[8])

    theta, thrust, product = fsolve(residual, [math.radians(60.0), 2.0, 0.9 if Slip.ONE_NUMBER in slips else 0.4])
    return float(theta), float(thrust), float(product)


def forward_matrices(a: Airframe, slips: frozenset[Slip] = ALL_SLIPS) -> tuple[Array, Array]:
    """A (10, 10) and B (10, 4) of section 4.1."""
    theta, thrust, product = typed_trim(a, slips)
    x, u = trim_state(theta), np.array([thrust, thrust, product, product])
    return (
        jacobian(lambda x: typed_derivative(x, u, a, slips), x, 10),
        jacobian(lambda u: typed_derivative(x, u, a, slips), u, 4),
    )


def steady_climb(a: Airframe, speed: float, path: float, slips: frozenset[Slip] = frozenset()) -> tuple[float, float]:
    """Nose above the horizon [rad] and propeller speed [rad/s] of steady straight flight.

    Args:
        a: The airframe.
        speed: Along the nose, v_bx [m/s].
        path: Angle of the path above the horizon [rad].
        slips: Of the report.
    """
    from scipy.optimize import fsolve  # noqa: PLC0415

    def residual(z: Array) -> tuple[float, float, float]:
        v_b = speed * np.array([1.0, 0.0, -math.tan(z[0] - path)])
        F, M = typed_forces(v_b, ZERO_VECTOR, np.array([z[1], z[1]]), np.array([z[2], z[2]]), a, slips)
        weight = a.m * a.g
        return F[0] - weight * math.sin(z[0]), F[2] - weight * math.cos(z[0]), M[1]

    theta, thrust, _ = fsolve(residual, [path + 0.07, 2.2, 0.1])
    return float(theta), math.sqrt(max(float(thrust), 0.0) / a.k_f)


def trim_state(theta: float) -> Array:
    """State of level flight north at PRINTED_SPEED, nose up by theta."""
    x = np.zeros(11)
    x[1], x[5], x[10] = PRINTED_SPEED, -math.sin(theta / 2.0), math.cos(theta / 2.0)
    return x


def jacobian(f: Callable[[Array], Array], x: Array, n: int) -> Array:
    """Central differences over the first n entries of x."""
    columns = []
    for k in range(n):
        step = np.zeros_like(x)
        step[k] = 1e-6
        columns.append((f(x + step) - f(x - step)) / 2e-6)
    return np.array(columns).T
