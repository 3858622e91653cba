r"""A sublevel set of V = x' S x that the linear hover law provably never leaves (report, sections 3.1 and 5.1).

The closed loop x' = (A - B K) x + r(x) is written as x' = (A - B K + M) x, where M depends on the attitude, the
rates and the airspeed only, and V' < 0 follows where

.. math:: W - (S M + M' S) \succ 0, \qquad W = -(A - B K)' S - S (A - B K)

holds for every M the set allows. The attitude is covered by boxes, which are split until each is proved: on a box M is
affine in (d1, e2, d3) but for terms of second order, which interval arithmetic bounds; rates and airspeed enter
as the corners of what {V <= c} leaves of them once the attitude's share is taken.

With q = q_bar ⊗ (d0, d1, d2, d3) and e = eps - eps_bar, the attitude's coordinates are d1 = (e1 + e3) / sqrt2,
e2, d3 = (e3 - e1) / sqrt2, and kappa = 1 - d0, d2 = sqrt2 e2 - kappa.

What is in: every term of the plant in still air (rotation, quaternion kinematics, gyroscopic moment, all of the
airspeed's forces and moments), the full allocation. What is assumed: actuators that follow at once and a law in
continuous time, no wind, no ground, no integral, exact parameters, eigenvalues exact to 1e-9.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

import numpy as np
from numba import njit

from sitl.design import linearise
from sitl.design.closed_loop import (
    ATTITUDE,
    RATES,
    ROOT,
    AttitudeBoxes,
    Interval,
    aerodynamics,
    controlled,
    coordinates,
    entry_matrix,
    gyro_matrices,
    row_matrix,
    scaled,
    tilt_matrices,
    turning,
)
from sitl.errors import SitlError
from sitl.model.airframe import Airframe, Array
from sitl.kernels.rigid_body import derivative
from sitl.kernels.state import ACTUATOR, ANCHOR, SIZE, Q
from sitl.laws.allocation import allocate
from sitl.laws.hover_linear import HALF, LinearGains, control

MARGIN = 1e-6  # what the smallest eigenvalue must exceed [1/s]: far above what rounding can do
MOST_BOXES = 2_000  # at one level of splitting; a set that needs more counts as not proved
GRID = 8  # boxes per axis to begin with
DEPTH = 12  # how often a box is split at most
PRECISION = 0.05  # of the level, relative
FARTHEST = 100.0  # of V where it is looked for a rise
NOTHING = 1e-5  # a level below this is none
ALOFT = 1000.0  # out of the ground's reach [m]
POSITION, VELOCITY = slice(0, 3), slice(3, 6)


class Certificate(NamedTuple):
    """Levels of V below which something is proved; the set is proved up to the smallest."""

    decrease: float  # V' < 0 below it, as far as the other three hold
    saturation: float  # no actuator meets a position limit below it
    reach: float  # the position error is not shortened below it
    chart: float  # the nose cannot turn through the attitudes that x does not tell apart below it

    @property
    def level(self) -> float:
        """The certified level: {V <= level} with eta > 0 is invariant and in the region of attraction."""
        return min(self)


def certify(a: Airframe, gains: LinearGains, *, precision: float = PRECISION) -> Certificate:
    """The largest sublevel set of V that can be proved, by bisection.

    Args:
        a: The airframe.
        gains: A law without integral, and the S of its V.
        precision: Of the level, relative, > 0.

    Raises:
        SitlError: If the law has an integral, or its V proves nothing.
    """
    proof = _Proof.of(a, gains)
    saturation, reach, chart = saturation_level(a, gains), _reach_level(gains), chart_level(gains)
    high = min(saturation, reach, chart)
    low = high
    while not proof.holds(low):
        low, high = 0.25 * low, low
        if low < NOTHING:
            raise SitlError("no sublevel set of V can be proved: its decrease about the hover is too small")
    while high > (1.0 + precision) * low:
        middle = math.sqrt(low * high)
        low, high = (middle, high) if proof.holds(middle) else (low, middle)
    return Certificate(low, saturation, reach, chart)


def saturation_level(a: Airframe, gains: LinearGains) -> float:
    """Smallest V at which the law can ask an actuator for its position limit.

    Every limit is a half-space: |d1| <= delta_max is |u3| <= delta_max u1. Of c' x <= bound, the ellipsoid
    touches the plane at V = bound^2 / (c' S^-1 c).
    """
    low, high = a.k_f * a.omega_min**2, a.k_f * a.omega_max**2
    planes = []
    for motor, elevon in ((0, 2), (1, 3)):
        T, K_T, K_d = gains.u_bar[motor], gains.K[motor], gains.K[elevon]
        planes += [(K_T, T - low), (-K_T, high - T)]
        planes += [(a.delta_max * K_T + sign * K_d, a.delta_max * T) for sign in (-1.0, 1.0)]
    return float(min(bound * bound / (normal @ np.linalg.solve(gains.S, normal)) for normal, bound in planes))


def radii(gains: LinearGains, level: float) -> tuple[float, float, float, float]:
    """What {V <= level} holds in any direction when all else is zero: position [m], speed, turn [rad], rates.

    A turn by theta has |eps - eps_bar| <= 2 sin(theta / 4), at most theta / 2.
    """
    p, v, e, w = (
        math.sqrt(level / np.linalg.eigvalsh(gains.S[part, part])[-1]) for part in (POSITION, VELOCITY, ATTITUDE, RATES)
    )
    return p, v, 4.0 * math.asin(min(1.0, 0.5 * e)), w


def greatest_deflection(gains: LinearGains, level: float) -> float:
    """The largest elevon angle that the law can ask for on {V <= level}; infinite where a thrust may vanish [rad]."""
    most = 0.0
    for motor, elevon in ((0, 2), (1, 3)):
        rows = gains.K[[motor, elevon]]
        (TT, Td), (_, dd) = level * rows @ np.linalg.solve(gains.S, rows.T)
        room = gains.u_bar[motor] ** 2 - TT
        if room <= 0.0:
            return math.inf
        most = max(most, (abs(Td) + math.sqrt(Td * Td + room * dd)) / room)
    return most


def _reach_level(gains: LinearGains) -> float:
    """Smallest V at which the position error can be longer than the law's reach."""
    if math.isinf(gains.reach):
        return math.inf
    return float(gains.reach**2 / np.linalg.eigvalsh(np.linalg.inv(gains.S)[POSITION, POSITION]).max())


def chart_level(gains: LinearGains) -> float:
    r"""Smallest V at which eta = 0, |eps| = 1.

    x holds eps alone, so two attitudes share each x, and with the sign that the law takes both can be meant: turned
    over its back until the nose points straight down, q = (-1, 0, -1, 0)/sqrt2, the vehicle has the x of the hover,
    and V = 0. Below this level the two are apart. The minimum of (n - eps_bar)' S_e (n - eps_bar) over the sphere
    equals the maximum of its dual, every value of which is a lower bound.
    """
    S_e = _marginal(gains.S, ATTITUDE)
    values, vectors = np.linalg.eigh(S_e)
    upright = np.array([0.0, -HALF, 0.0])
    pull = vectors.T @ S_e @ upright

    def dual(shift: float) -> float:
        return float(shift + upright @ S_e @ upright - np.sum(pull**2 / (values - shift)))

    low, high = values[0] - 2.0 * float(np.linalg.norm(pull)) - 1.0, float(values[0]) * (1.0 - 1e-9)
    for _ in range(200):
        left, right = low + (high - low) / 3.0, high - (high - low) / 3.0
        low, high = (low, right) if dual(left) > dual(right) else (left, high)
    return dual(low)


def _marginal(S: Array, part: slice) -> Array:
    """The quadratic form min over the other entries of x' S x."""
    return np.asarray(np.linalg.inv(np.linalg.inv(S)[part, part]))


@njit(cache=True)
def lyapunov_rate(x: Array, gains: LinearGains, a: Airframe) -> float:
    """V' on the full plant in still air, actuators at what the allocation commands [1/s]; NaN for |eps| > 1.

    Args:
        x: Deviation in the heading frame with eta > 0, (12,).
        gains: Gains of the law.
        a: The airframe.
    """
    plant, dx, u = np.empty(ANCHOR), np.empty(ACTUATOR), np.empty(4)
    plant[:Q] = x[:6]
    plant[2] += ALOFT
    plant[Q + 1 : Q + 4] = x[6:9]
    plant[Q + 2] -= HALF
    eta = 1.0 - plant[Q + 1] ** 2 - plant[Q + 2] ** 2 - plant[Q + 3] ** 2
    if eta < 0.0:
        return math.nan
    plant[Q] = math.sqrt(eta)
    plant[Q + 4 : ACTUATOR] = x[9:]
    control(x, np.zeros(3), 0.0, gains, u)
    allocate(u, a, plant[ACTUATOR:])
    derivative(plant, np.full(SIZE, math.nan), np.zeros(3), a, dx)
    rate = 0.0
    for row in range(12):
        for column in range(12):
            rate += 2.0 * x[row] * gains.S[row, column] * dx[column if column < Q else column + 1]
    return rate


def first_rise(a: Airframe, gains: LinearGains, *, searches: int = 6, seed: int = 1) -> float:
    """A V at which V' = 0 somewhere, found by descent over directions: no certificate of this V can be larger.

    Args:
        a: The airframe.
        gains: The law.
        searches: How many descents, from the best of random directions.
        seed: Of the directions.
    """
    from scipy.optimize import minimize  # noqa: PLC0415 - half a second that only this search needs

    to_x = np.linalg.inv(np.linalg.cholesky(gains.S))

    def rise(y: Array) -> float:
        return _rise_along(y / np.linalg.norm(y) @ to_x, gains, a)

    directions = np.random.default_rng(seed).standard_normal((300, 12))
    best = sorted(directions, key=rise)[:searches]
    options = {"maxiter": 2000, "adaptive": True, "fatol": 1e-4, "xatol": 1e-3}
    return float(min(minimize(rise, y, method="Nelder-Mead", options=options).fun for y in best))


@njit(cache=True)
def _rise_along(x: Array, gains: LinearGains, a: Airframe) -> float:
    """The V from which on V' is no longer negative along a ray, to 1 %; infinite if there is none on the chart."""
    level = 1e-3
    while level < FARTHEST:
        rate = lyapunov_rate(math.sqrt(level) * x, gains, a)
        if not rate < 0.0:
            return math.inf if math.isnan(rate) else level
        level *= 1.01
    return math.inf


Terms = list[tuple[Interval, Array]]


@dataclass(frozen=True)
class _Proof:
    """The closed loop in the coordinates y = L' x, where V = |y|^2 and every matrix is symmetric, (12, 12)."""

    a: Airframe
    gains: LinearGains
    L: Array
    W: Array
    tilt: Array  # (3, 12, 12): what of M + M' is linear in f
    gyro: Array  # (3, 12, 12): what of it is linear in the rates
    aero: tuple[Array, Array, Array]  # (6, 6): (f / m, tau / J) per h of (v_b, w); still, per d1 + d2, per d1 - d2
    S_f: Array  # (3, 3): what V is at least at an f
    mean: Array  # (6, 3): (v, w) at the least V of an f
    spread: Array  # (6, 6): (v, w) lie within sqrt(c - f' S_f f) of the mean in the norm of its inverse

    @classmethod
    def of(cls, a: Airframe, gains: LinearGains) -> _Proof:
        """Prepare the proof for a law.

        Raises:
            SitlError: If the law has an integral or V does not fall along its linear model.
        """
        if gains.K_i.any():
            raise SitlError("a law with an integral has three states more than V: certify it without")
        A, B = linearise.hover(a)
        L = np.asarray(np.linalg.cholesky(gains.S), dtype=np.float64)
        W = -scaled(A - B @ gains.K, L)
        if np.linalg.eigvalsh(W).min() <= MARGIN:
            raise SitlError("V does not fall along the linear closed loop: these gains and this S are no pair")
        C = np.linalg.inv(gains.S)
        T = coordinates()
        C_ff, C_zf = T @ C @ T.T, np.vstack([C[VELOCITY], C[RATES]]) @ T.T
        C_zz = C[np.ix_([3, 4, 5, 9, 10, 11], [3, 4, 5, 9, 10, 11])]
        S_f = np.asarray(np.linalg.inv(C_ff), dtype=np.float64)
        mean = C_zf @ S_f
        return cls(
            a, gains, L, W,
            np.stack([scaled(M, L) for M in tilt_matrices(a, gains)]),
            np.stack([scaled(M, L) for M in gyro_matrices(a)]),
            aerodynamics(a), S_f, mean, C_zz - mean @ C_zf.T,
        )  # fmt: skip

    def holds(self, level: float) -> bool:
        """Whether V' < 0 is proved on {V <= level} without the hover itself."""
        half = np.sqrt(level * np.diag(np.linalg.inv(self.S_f)))
        middles = (2.0 * np.arange(GRID) + 1.0) / GRID - 1.0
        centre = half * np.stack(np.meshgrid(middles, middles, middles), axis=-1).reshape(-1, 3)
        half = np.broadcast_to(half / GRID, centre.shape)
        deflection = min(self.a.delta_max, greatest_deflection(self.gains, level))
        for depth in range(DEPTH):
            least = np.einsum("ni,ij,nj->n", centre, self.S_f, centre)
            budget = level - np.maximum(least - 2.0 * np.abs(centre @ self.S_f * half).sum(1), 0.0)
            inside = budget >= 0.0
            centre, half, budget, least = centre[inside], half[inside], budget[inside], least[inside]
            if centre.shape[0] == 0:
                return True
            if centre.shape[0] > MOST_BOXES:
                return False
            eigenvalue, slack = self._boxes(centre, half, budget, deflection)
            if ((eigenvalue < 0.0) & (least <= level)).any():
                return False  # not even at the middle: no splitting would help
            left = eigenvalue - slack <= MARGIN
            centre, half = _split(centre[left], half[left], depth % 3)
        return False

    def _boxes(self, centre: Array, half: Array, budget: Array, deflection: float) -> tuple[Array, Array]:
        """Smallest eigenvalue at the middle of each box, and what the box may take off it, infinite beyond eta = 0."""
        attitude = AttitudeBoxes(centre - half, centre + half)
        middle = self.W - np.einsum("nj,jkl->nkl", centre, self.tilt)
        slack = half @ np.linalg.norm(self.tilt, 2, axis=(1, 2))
        middle, slack = _take_off(self._remainder(attitude), middle, slack)
        rates, rate_half = centre @ self.mean[3:].T, half @ np.abs(self.mean[3:]).T
        rate_half = rate_half + np.sqrt(budget[:, None] * np.diag(self.spread)[3:])
        winds = self._winds(attitude, self._airspeed(centre, half, budget), deflection)
        smallest = np.full(len(centre), math.inf)
        for corner in product((-1.0, 1.0), repeat=3):
            turning = middle - np.einsum("nj,jkl->nkl", rates + corner * rate_half, self.gyro)
            for wind, wind_slack in winds:
                values = np.linalg.eigvalsh(turning + wind)[:, 0]
                smallest = np.minimum(smallest, values - wind_slack)
        return smallest, np.where(attitude.upright, slack, math.inf)

    def _winds(self, at: AttitudeBoxes, h: Array, deflection: float) -> list[tuple[Array, Array]]:
        """Corners of what the airspeed adds, (n, 12, 12), each with its slack, (n,).

        They are h = 0, and h at its bound with (d1 + d2, d1 - d2) at the corners of |d1|, |d2| <= deflection.
        """
        nothing = np.zeros((len(h), 12, 12)), np.zeros(len(h))
        (still, slack), *elevons = (_take_off(self._air(at, G), *nothing) for G in self.aero)
        winds = [nothing]
        for M, M_slack in elevons:
            d, width = 2.0 * deflection * h[:, None, None], h * (slack + 2.0 * deflection * M_slack)
            winds += [(h[:, None, None] * still + sign * d * M, width) for sign in (-1.0, 1.0)]
        return winds

    def _airspeed(self, centre: Array, half: Array, budget: Array) -> Array:
        """Upper bound of h = rho S eta / 2 on each box [kg/s]."""
        weight = np.diag([1.0, 1.0, 1.0, *[math.sqrt(self.a.mu) * self.a.c] * 3])
        mean = weight @ self.mean
        most = np.linalg.norm(centre @ mean.T, axis=1) + half @ np.linalg.norm(mean, axis=0)
        most += np.sqrt(budget * np.linalg.eigvalsh(weight @ self.spread @ weight).max())
        return np.asarray(0.5 * self.a.rho * self.a.S * most)

    def _remainder(self, at: AttitudeBoxes) -> Terms:
        """Second and higher order of M in f: gravity, rotation of the controlled force, kinematics."""
        c1, ce, c3 = coordinates()
        g, (tx, tz) = self.a.g, controlled(self.a, self.gains)
        falling = (at.kappa - 2.0 * ROOT * at.e2) * at.phi
        terms: list[tuple[Interval, Array]] = [
            (at.kappa, row_matrix(4, -2.0 * g * (c1 + c3))),
            (falling * at.d1, row_matrix(5, -2.0 * g * c1)),
            (falling * at.d3, row_matrix(5, -2.0 * g * c3)),
            (falling * at.e2, row_matrix(5, -4.0 * g * ce)),
            (at.kappa, -HALF * turning(np.eye(3))),
        ]
        for column, force in ((at.nose, tx), (at.normal, tz)):
            x, y, z = column
            terms += [(-z, row_matrix(3, force)), (y, row_matrix(4, force)), (x, row_matrix(5, force))]
        return [(value, scaled(M, self.L)) for value, M in terms]

    def _air(self, at: AttitudeBoxes, G: Array) -> Terms:
        """M per h of forces and moments G (v_b, w), velocities in the world."""
        nothing = Interval(np.zeros_like(at.kappa.low), np.zeros_like(at.kappa.low))
        terms: list[tuple[Interval, Array]] = []
        for i in range(3):
            for j in range(3):
                force, by_rate, moment = nothing, nothing, nothing
                for k in range(3):
                    by_rate = by_rate + G[k, 3 + j] * at.axes[k][i]
                    moment = moment + G[3 + i, k] * at.axes[k][j]
                    for n in range(3):
                        force = force + G[k, n] * (at.axes[k][i] * at.axes[n][j])
                constant = nothing + G[3 + i, 3 + j]
                places = ((force, 3 + i, 3 + j), (by_rate, 3 + i, 9 + j), (moment, 9 + i, 3 + j))
                terms += [(value, entry_matrix(*place)) for value, *place in (*places, (constant, 9 + i, 9 + j))]
        return [(value, scaled(M, self.L)) for value, M in terms]


def _norm(M: Array) -> float:
    return float(np.linalg.norm(M, 2))


def _take_off(terms: Terms, middle: Array, slack: Array) -> tuple[Array, Array]:
    """Subtract the terms' middles; their half widths become slack."""
    for value, M in terms:
        if M.any():
            middle = middle - 0.5 * (value.low + value.high)[:, None, None] * M
            slack = slack + 0.5 * (value.high - value.low) * _norm(M)
    return middle, slack


def _split(centre: Array, half: Array, axis: int) -> tuple[Array, Array]:
    """Each box halved along an axis."""
    shift = np.zeros_like(half)
    shift[:, axis] = 0.5 * half[:, axis]
    return np.vstack([centre - shift, centre + shift]), np.vstack([half - shift, half - shift])
