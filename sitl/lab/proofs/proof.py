"""Whether V falls everywhere on a sublevel set of itself: boxes of attitudes, split until each is proved.

See :mod:`sitl.lab.proofs.region` for what is proved, and
:mod:`sitl.lab.proofs.closed_loop` for the matrices.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sitl import Airframe, Array, SitlError
from sitl.control.hover_linear import SQRT_HALF, LinearGains
from sitl.design.linearise import Air, aerodynamics
from sitl.lab.proofs.closed_loop import (
    DELAY,
    RATE_ROWS,
    ROOT,
    VELOCITY_ROWS,
    AttitudeBoxes,
    Channels,
    Interval,
    Lift,
    Terms,
    channels,
    controlled,
    coordinates,
    elevon_effect,
    entry_matrix,
    feedback,
    gyro_matrices,
    lift,
    linear_loop,
    lyapunov_matrix,
    most,
    plain_lift,
    row_matrix,
    scaled,
    size,
    tilt_matrices,
    turning,
)
from sitl.lab.proofs.stalled import (
    MAX_ACCELERATION,
    MAX_DRIFT,
    MAX_THRUST_RATE,
    MAX_UNEVEN_RATE,
    Commands,
    Stalled,
    thrust_slope,
)
from sitl.lab.proofs.surfaces import MOVING, normal_motion

MARGIN = 1e-6  # what the smallest eigenvalue must exceed [1/s]: far above what rounding can do
MIRRORED = 1e-8  # relative difference of mirror images that is rounding


def greatest_deflection(gains: LinearGains, level: float) -> float:
    """The largest elevon angle that the law can ask for on {V <= level}; infinite where a thrust may vanish [rad]."""
    greatest, K, P = 0.0, feedback(gains), lyapunov_matrix(gains)
    for motor, elevon in ((0, 2), (1, 3)):
        rows = K[[motor, elevon]]
        (TT, Td), (_, dd) = level * rows @ np.linalg.solve(P, rows.T)
        room = gains.u_bar[motor] ** 2 - TT
        if room <= 0.0:
            return math.inf
        greatest = max(greatest, (abs(Td) + math.sqrt(Td * Td + room * dd)) / room)
    return greatest


def thrust_swing(gains: LinearGains, level: float) -> float:
    """The largest change of a thrust that the law asks for on {V <= level}, over that of the hover."""
    K, P = feedback(gains)[:2], lyapunov_matrix(gains)
    return float(np.sqrt(level * np.diag(K @ np.linalg.solve(P, K.T))).max()) / min(gains.u_bar[:2])


def commands(gains: LinearGains, level: float) -> Commands:
    """Bounds of what the law asks for on {V <= level}."""
    K, P, T = feedback(gains), lyapunov_matrix(gains), min(gains.u_bar[:2])
    rows = 0.5 * np.vstack([K[0] + K[1], K[0] - K[1], K[2] + K[3], K[2] - K[3]])
    together, apart, mean, half = np.sqrt(level * np.diag(rows @ np.linalg.solve(P, rows.T)))
    swing, deflection = thrust_swing(gains, level), greatest_deflection(gains, level)
    # With thrusts t +- s and deflections d +- e those of the products are t d + s e +- (t e + s d).
    room = T - together
    if not (room > 0.0 and deflection < math.inf):
        return Commands(swing, together / T, apart / T, deflection, deflection, deflection)
    mean, half = (mean + apart * deflection) / room, (half + apart * deflection) / room
    return Commands(swing, together / T, apart / T, deflection, float(mean), float(half))


@dataclass(frozen=True)
class Proof:
    """The closed loop in the coordinates y = L' x, where V = |y|^2."""

    a: Airframe
    gains: LinearGains
    L: Array
    F: Array  # (n, n): the linear closed loop, as it is
    aero: Air
    S_f: Array  # (3, 3): what V is at least at an f
    mean: Array  # (6, 3): (v, w) at the least V of an f
    spread: Array  # (6, 6): (v, w) lie within sqrt(c - f' S_f f) of the mean in the norm of its inverse
    sampled: bool  # whether commands are late; if not they are in force at once

    @classmethod
    def of(cls, a: Airframe, gains: LinearGains, *, sampled: bool = True) -> Proof:
        """Prepare the proof for a law.

        Raises:
            SitlError: If V does not fall along the linear model.
        """
        P, F, n = lyapunov_matrix(gains), linear_loop(a, gains), size(gains)
        if np.linalg.eigvalsh(P).min() <= 0.0:
            raise SitlError("V is not positive: of a law with an integral it must hold the integral, too")
        L = np.asarray(np.linalg.cholesky(P), dtype=np.float64)
        if np.linalg.eigvalsh(-scaled(F, L)).min() <= MARGIN:
            raise SitlError("V does not fall along the linear closed loop: these gains and this S are no pair")
        C = np.linalg.inv(P)
        T, moving = coordinates(n), [3, 4, 5, 9, 10, 11]
        C_ff, C_zf = T @ C @ T.T, C[moving] @ T.T
        S_f = np.asarray(np.linalg.inv(C_ff), dtype=np.float64)
        mean = C_zf @ S_f
        spread = C[np.ix_(moving, moving)] - mean @ C_zf.T
        return cls(a, gains, L, F, aerodynamics(a), S_f, mean, spread, sampled)

    def lift(self, level: float) -> Lift | None:
        """The matrix that must be positive on {V <= level}; None where the delay leaves nothing of it."""
        if not self.sampled:
            return plain_lift(self.F, self.L)
        at = self.channels(level)
        if at is None:
            return None
        turn = 2.0 * math.sin(0.5 * min(self.greatest_turn(level), math.pi))
        if (stalled := self.stalled(level)) is None:
            return lift(self.F, self.L, at, turn)
        extremes = stalled.extremes(*self.greatest_motion(level), self.greatest_normal(level))
        return lift(self.F, self.L, at, turn, extremes)

    def channels(self, level: float) -> Channels | None:
        """Delays of the commands on {V <= level}; None where a thrust may vanish."""
        swing, deflection = thrust_swing(self.gains, level), greatest_deflection(self.gains, level)
        if not (swing < 1.0 and deflection < math.inf):
            return None
        slowest = math.sqrt((1.0 - swing) * min(self.gains.u_bar[:2]) / self.a.k_f)
        ratio, h = (1.0 + DELAY * self.a.omega_rate / slowest) ** 2, self.greatest_stream(level)
        if (stalled := self.stalled(level)) is not None:
            speed, spin = self.greatest_motion(level)
            eta = math.cos(min(0.25 * math.pi + 0.5 * self.greatest_turn(level), 0.499 * math.pi))
            return stalled.channels(ratio, speed, spin, eta) if stalled.is_within(speed) else None
        return channels(self.a, self.gains, ratio, deflection, 1.0 + self.effectiveness(level) * h * h)

    def stalled(self, level: float) -> Stalled | None:
        """The air on {V <= level} where its wing stalls; None for another level of aerodynamics."""
        return Stalled.on(self.a, self.gains, commands(self.gains, level))

    def greatest_motion(self, level: float) -> tuple[float, float]:
        """The largest speed [m/s] and rate [rad/s] on {V <= level}."""
        C = np.linalg.inv(self.L @ self.L.T)
        speed, spin = (math.sqrt(level * np.linalg.eigvalsh(C[part, part])[-1]) for part in (VELOCITY_ROWS, RATE_ROWS))
        return speed, spin

    def greatest_normal(self, level: float) -> float:
        """The largest speed along the hovering wing's normal on {V <= level} [m/s]."""
        row = normal_motion(self.a)
        return math.sqrt(level * row @ np.linalg.inv(self.L @ self.L.T)[np.ix_(MOVING, MOVING)] @ row)

    def is_mirrored(self) -> bool:
        """Whether law and V are their own mirror images about the vehicle's plane of symmetry, as the plant is."""
        flips = np.array([1.0, -1.0, 1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0])[
            : len(self.L)
        ]
        pairs = (self.F, self.L @ self.L.T)
        return all(np.abs(M - flips[:, None] * M * flips).max() <= MIRRORED * np.abs(M).max() for M in pairs)

    def greatest_turn(self, level: float) -> float:
        """The largest angle from the hover attitude on {V <= level} [rad]."""
        off = math.sqrt(level * np.linalg.eigvalsh(np.linalg.inv(self.S_f)).max())
        return 4.0 * math.asin(min(1.0, 0.5 * off))

    def greatest_stream(self, level: float) -> float:
        """The largest h = rho S eta / 2 on {V <= level} [kg/s]."""
        a = self.a
        weight = np.diag([1.0, 1.0, 1.0, *[math.sqrt(a.mu) * a.c] * 3])
        whole = weight @ (self.spread + self.mean @ np.linalg.solve(self.S_f, self.mean.T)) @ weight
        return float(0.5 * a.rho * a.S * math.sqrt(level * np.linalg.eigvalsh(whole).max()))

    def greatest_rates(self, level: float) -> tuple[float, float] | None:
        """Bounds of the commands' rates on {V <= level}: motors [rad/s2] and elevons [rad/s]; None where unbounded."""
        swing, deflection = thrust_swing(self.gains, level), greatest_deflection(self.gains, level)
        at = self.channels(level)
        if at is None:
            return None
        thrust = (1.0 - swing) * min(self.gains.u_bar[:2])
        # Of T1, T2, d1 T1, d2 T2; and T d' = (d T)' - d T', the elevons at their largest angles.
        crossed = np.vstack([sign * deflection * at.rows[:2] for sign in (-1.0, 1.0)])
        first = 4 if len(self.L) == 12 else 7
        inflow = at.rows[first:]
        uneven = 0.5 * (at.rows[0] - at.rows[1])[None]
        rows, own = np.vstack([at.rows[:4], inflow, uneven, crossed + np.tile(at.rows[2:4], (2, 1))]), 4 + len(inflow)
        rates = self.greatest_changes(level, rows)
        # Each error is at most its factor and delay times its rate, and adds to all rates.
        count = int((at.row < 4).sum() + (at.row >= first).sum())
        columns = at.columns[:, :count]
        direct = np.abs(rows @ columns) + np.linalg.norm(rows[:, VELOCITY_ROWS], axis=1)[:, None] * at.force[:count]
        by_rate = np.zeros((len(rows), own))
        for channel in range(count):
            late, row = direct[:, channel] * at.delays[channel] * at.factors[channel], at.row[channel]
            if row < 4:
                by_rate[:, row] += late
            else:
                by_rate[:, 4:] += late[:, None]
        if np.abs(np.linalg.eigvals(by_rate[:own])).max() >= 1.0:
            return None
        rates += by_rate @ np.linalg.solve(np.eye(own) - by_rate[:own], rates[:own])
        if len(inflow) and not self._as_taken(rates[:2].max(), rates[own], rates[4:own]):
            return None
        slope = thrust_slope(self.a)
        motor = rates[:2].max() + slope * rates[4:own].sum()
        blown = max(self.a.k_f * (thrust - slope * MAX_DRIFT), 0.0)
        per_speed = max(2.0 * math.sqrt(blown) - abs(self.a.k_fv) * MAX_DRIFT, 1e-9)
        return float(motor / per_speed), float(rates[own + 1 :].max() / thrust)

    def _as_taken(self, thrust: float, uneven: float, inflow: Array) -> bool:
        """Whether the rates of thrusts and inflow are within what the air was bounded with."""
        by_inflow = float(np.linalg.norm(inflow)) <= MAX_ACCELERATION * self.a.g
        return by_inflow and thrust <= MAX_THRUST_RATE and uneven <= MAX_UNEVEN_RATE

    def greatest_changes(self, level: float, rows: Array) -> Array:
        """Bounds of |row x'| on {V <= level}, for linear functions of the state's rate, without errors, (c,)."""
        n, to_x = len(self.L), np.linalg.inv(self.L).T
        f = np.sqrt(level * np.diag(np.linalg.inv(self.S_f)))[None]
        at, w = AttitudeBoxes(-f, f), np.sqrt(level * np.diag(to_x @ to_x.T)[RATE_ROWS])
        h, stalled = self.greatest_stream(level), self.stalled(level)
        if stalled is not None:
            h = 0.0
        kappa, elevons = self.effectiveness(level) * h * h, [elevon_effect(self.a, self.gains, k) for k in (0, 1)]
        affine = [
            *(bound * M for bound, M in zip(f[0], tilt_matrices(self.a, self.gains), strict=True)),
            *(bound * M for bound, M in zip(w, gyro_matrices(self.a, n), strict=True)),
            *(kappa * M for M, _ in elevons),
        ]
        # The norm is convex, so the corners of what is affine suffice.
        whole = (rows @ self.F @ to_x)[None]
        for M in affine:
            part = rows @ M @ to_x
            whole = np.concatenate((whole + part, whole - part))
        greatest = np.linalg.norm(whole, axis=2).max(axis=0)
        rest = [(most(value)[0], M) for value, M in self.remainder(at)]
        rest += [(kappa * most(at.axes[2][i])[0], row_matrix(3 + i, force)) for i in range(3) for _, force in elevons]
        if stalled is not None:
            speed, spin, along = (
                np.array([bound]) for bound in (*self.greatest_motion(level), self.greatest_normal(level))
            )
            mains = stalled.main_terms(speed, spin, Interval(-along, along), at)
            rest += [(most(share)[0], M) for share, M in stalled.terms(at, speed, spin)]
            rest += [(most(main.share)[0], main.M) for main in mains]
            rest += [(most(main.share * change)[0], M) for main in mains for change, M in main.turned]
        greatest += sum(bound * np.linalg.norm(rows @ M @ to_x, axis=1) for bound, M in rest)
        return np.asarray(math.sqrt(level) * greatest + h * self._blown(level, rows, to_x @ to_x.T))

    def _blown(self, level: float, rows: Array, C: Array) -> Array:
        """Bounds of what the airspeed adds to |row x'|, per h, (c,): a turned velocity is as long."""
        speed, turning = (
            math.sqrt(level * np.linalg.eigvalsh(C[part, part])[-1]) for part in (VELOCITY_ROWS, RATE_ROWS)
        )
        d = 2.0 * min(self.a.delta_max, greatest_deflection(self.gains, level))
        pull, turn = np.linalg.norm(rows[:, VELOCITY_ROWS], axis=1), rows[:, RATE_ROWS]
        total = np.zeros(len(rows))
        for G, share in zip(self.aero, (1.0, d, d), strict=True):
            for columns, size_of in ((slice(0, 3), speed), (slice(3, 6), turning)):
                effect = pull * np.linalg.norm(G[:3, columns], 2) + np.linalg.norm(turn @ G[3:, columns], axis=1)
                total += share * size_of * effect
        return total

    def effectiveness(self, level: float) -> float:
        """The most that an elevon in the own stream is more effective, over h^2."""
        # kappa = h v_bx / (2 X T), and no velocity is more than 2 h / (rho S).
        thrust = (1.0 - thrust_swing(self.gains, level)) * min(self.gains.u_bar[:2])
        return 1.0 / (self.a.rho * self.a.S * self.a.S_ratio * thrust)

    def remainder(self, at: AttitudeBoxes) -> Terms:
        """Second and higher order of M in f: gravity, rotation of the controlled force, kinematics."""
        n = len(self.L)
        c1, ce, c3 = coordinates(n)
        g, (tx, tz) = self.a.g, controlled(self.a, self.gains)
        falling = (at.kappa - 2.0 * ROOT * at.e2) * at.phi
        terms: list[tuple[Interval, Array]] = [
            (at.kappa, row_matrix(4, -2.0 * g * (c1 + c3))),
            (falling * at.d1, row_matrix(5, -2.0 * g * c1)),
            (falling * at.d3, row_matrix(5, -2.0 * g * c3)),
            (falling * at.e2, row_matrix(5, -4.0 * g * ce)),
            (at.kappa, -SQRT_HALF * turning(np.eye(3), n)),
        ]
        for column, force in ((at.nose, tx), (at.normal, tz)):
            x, y, z = column
            terms += [(-z, row_matrix(3, force)), (y, row_matrix(4, force)), (x, row_matrix(5, force))]
        return terms

    def air(self, at: AttitudeBoxes, G: Array) -> Terms:
        """M per h of forces and moments G (v_b, w), velocities in the world."""
        n = len(self.L)
        nothing = Interval(np.zeros_like(at.kappa.low), np.zeros_like(at.kappa.low))
        terms: list[tuple[Interval, Array]] = []
        for i in range(3):
            for j in range(3):
                force, by_rate, moment = nothing, nothing, nothing
                for k in range(3):
                    by_rate = by_rate + G[k, 3 + j] * at.axes[k][i]
                    moment = moment + G[3 + i, k] * at.axes[k][j]
                    for m in range(3):
                        force = force + G[k, m] * (at.axes[k][i] * at.axes[m][j])
                constant = nothing + G[3 + i, 3 + j]
                places = ((force, 3 + i, 3 + j), (by_rate, 3 + i, 9 + j), (moment, 9 + i, 3 + j))
                terms += [(value, entry_matrix(k, m, n)) for value, k, m in (*places, (constant, 9 + i, 9 + j))]
        return terms
