"""Whether V falls everywhere on a sublevel set of itself: boxes of attitudes, split until each is proved.

See :mod:`sitl.design.region` for what is proved, and :mod:`sitl.design.closed_loop` for the matrices.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import product

import numpy as np

from sitl.control.hover_linear import SQRT_HALF, LinearGains
from sitl.design import linearise
from sitl.design.closed_loop import (
    RATE_ROWS,
    ROOT,
    VELOCITY_ROWS,
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

MARGIN = 1e-6  # what the smallest eigenvalue must exceed [1/s]: far above what rounding can do
MAX_BOXES = 2_000  # at one level of splitting; a set that needs more counts as not proved
FIRST_BOXES = 8  # boxes per axis to begin with
DEPTH = 12  # how often a box is split at most


def greatest_deflection(gains: LinearGains, level: float) -> float:
    """The largest elevon angle that the law can ask for on {V <= level}; infinite where a thrust may vanish [rad]."""
    greatest = 0.0
    for motor, elevon in ((0, 2), (1, 3)):
        rows = gains.K[[motor, elevon]]
        (TT, Td), (_, dd) = level * rows @ np.linalg.solve(gains.S, rows.T)
        room = gains.u_bar[motor] ** 2 - TT
        if room <= 0.0:
            return math.inf
        greatest = max(greatest, (abs(Td) + math.sqrt(Td * Td + room * dd)) / room)
    return greatest


Terms = list[tuple[Interval, Array]]


@dataclass(frozen=True)
class Proof:
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
    def of(cls, a: Airframe, gains: LinearGains) -> Proof:
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
        C_ff, C_zf = T @ C @ T.T, np.vstack([C[VELOCITY_ROWS], C[RATE_ROWS]]) @ T.T
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
        middles = (2.0 * np.arange(FIRST_BOXES) + 1.0) / FIRST_BOXES - 1.0
        centre = half * np.stack(np.meshgrid(middles, middles, middles), axis=-1).reshape(-1, 3)
        half = np.broadcast_to(half / FIRST_BOXES, centre.shape)
        deflection = min(self.a.delta_max, greatest_deflection(self.gains, level))
        for depth in range(DEPTH):
            least = np.einsum("ni,ij,nj->n", centre, self.S_f, centre)
            budget = level - np.maximum(least - 2.0 * np.abs(centre @ self.S_f * half).sum(1), 0.0)
            inside = budget >= 0.0
            centre, half, budget, least = centre[inside], half[inside], budget[inside], least[inside]
            if centre.shape[0] == 0:
                return True
            if centre.shape[0] > MAX_BOXES:
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
        middle, slack = take_off(self._remainder(attitude), middle, slack)
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
        (still, slack), *elevons = (take_off(self._air(at, G), *nothing) for G in self.aero)
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
            (at.kappa, -SQRT_HALF * turning(np.eye(3))),
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


def take_off(terms: Terms, middle: Array, slack: Array) -> tuple[Array, Array]:
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
