r"""What the wing of :mod:`sitl.model.stall` leaves in M besides the linear loop, on a set of states near the hover.

A surface of a half wing at y with its centre of pressure at l behind the centre of mass feels c (v_b, w), with
c = (0, 0, 1, y, l, 0), and pushes back along the same c; its drag and the thrust's axis have b = (1, 0, 0, 0, 0, -y).
So the air is a sum of fixed matrices of rank one, each times a share that the speeds and thrusts of the set bound. The
linear loop has the push at the hover, p_0 = rho S_ratio S_p u_0 C_l / 2 per half wing; what is left are

- the push of both parts less p_0, and what a deflected elevon's normal takes off it;
- shift of the centre of pressure, drag, damping, the rotors' gyroscopic moment, the torque's change by inflow;
- elevons in the stream: u_s |u| in place of 2 T / (rho S_p), sin cos of the deflection, the drag of a deflected one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sitl.control.hover_linear import LinearGains
from sitl.design.closed_loop import (
    ATTITUDE_ROWS,
    RATE_ROWS,
    VELOCITY_ROWS,
    AttitudeBoxes,
    Interval,
    Terms,
    elevon_effect,
    entry_matrix,
    feedback,
    row_matrix,
    size,
)
from sitl.design.delay import DELAY, Channels, channels
from sitl.model.airframe import STALL, Airframe, Array
from sitl.model.hover_model import inertia

MAX_DRIFT = 2.0  # that the bounds of the thrust by inflow are of [m/s]
MAX_ACCELERATION = 4.0  # of the vehicle near the hover: weight, less than twice as much thrust, wing [g]
SLIGHT = 0.5  # of squares: (a + b)^2 <= (1 + SLIGHT) a^2 + (1 + 1 / SLIGHT) b^2
MOVING = [3, 4, 5, 9, 10, 11]  # (v, w) in the state
AXES = np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])  # R(q_bar)


def thrust_slope(a: Airframe) -> float:
    """The most that a thrust changes by the inflow [N s/m]; 0 for a set without a propeller table."""
    return abs(a.k_fv) * a.omega_max + 2.0 * abs(a.k_fvv) * MAX_DRIFT


def surfaces(a: Airframe, y: float) -> tuple[Array, Array]:
    """Rows c of the fixed surface and of the elevon of a half wing, attached, (6,) each."""
    elevon = a.Delta_r * a.xi_m / a.xi_f
    wing = (a.Delta_r - a.xi_f * elevon) / (1.0 - a.xi_f)
    return np.array((0.0, 0.0, 1.0, y, wing, 0.0)), np.array((0.0, 0.0, 1.0, y, elevon, 0.0))


def in_world(G: Array, n: int) -> Array:
    """M of G (v_b, w) at the hover attitude, (n, n)."""
    turned = np.eye(6)
    turned[:3, :3] = AXES
    M = np.zeros((n, n))
    M[np.ix_(MOVING, MOVING)] = turned @ G @ turned.T
    return M


def hover_push(a: Airframe, T: float) -> float:
    """p_0 of a half wing at a thrust [kg/s]."""
    return 0.5 * a.rho * a.S_ratio * a.S_p * a.C_l * math.sqrt(2.0 * T / (a.rho * a.S_p))


def per_mass(a: Airframe, G: Array) -> Array:
    """Of forces and moments (6, 6) the accelerations."""
    return np.asarray(G / np.concatenate((np.full(3, a.m), inertia(a)))[:, None])


def elevon_drag(a: Airframe) -> Array:
    """What one of delta^2 T of either elevon does to the state's rate, (12, 2)."""
    lift, made = a.S_ratio * a.C_l * a.xi_f, np.zeros((12, 2))
    made[5] = -lift / a.m
    made[11] = lift * a.a_y / a.J3 * np.array((1.0, -1.0))
    return made


@dataclass(frozen=True)
class Stalled:
    """The air on a set, where thrusts and deflections are within bounds."""

    a: Airframe
    gains: LinearGains
    least: float  # thrust of either propeller [N]
    most: float
    deflection: float  # at most [rad]

    @classmethod
    def on(cls, a: Airframe, gains: LinearGains, swing: float, deflection: float) -> Stalled | None:
        """Bounds where the law's thrusts swing by a share and its deflections stay within [rad].

        Returns:
            None for a set with another level of aerodynamics.
        """
        if a.aerodynamics != STALL:
            return None
        T, late = gains.u_bar.T1, thrust_slope(a) * DELAY * MAX_ACCELERATION * a.g
        return cls(a, gains, (1.0 - swing) * T - late, (1.0 + swing) * T + late, min(deflection, a.delta_max))

    def is_within(self, speed: float) -> bool:
        """Whether the bounds are of this speed: no propeller unloads [m/s]."""
        return self.least > 0.0 and speed < min(MAX_DRIFT, self.a.advance_knot * self._speeds()[0])

    def _speeds(self) -> tuple[float, float]:
        """The slowest and the fastest propeller [rad/s]."""
        a, by_inflow = self.a, thrust_slope(self.a) * MAX_DRIFT
        low, high = (max(T, 0.0) / a.k_f for T in (self.least - by_inflow, self.most + by_inflow))
        return math.sqrt(low), min(math.sqrt(high), a.omega_max)

    def _streams(self, local: Array) -> tuple[Interval, Interval, Interval]:
        """Push of the slipstream's part [kg/s], of the free one, and the elevons' effectiveness, by the local speed."""
        a, per_thrust = self.a, 2.0 / (self.a.rho * self.a.S_p)
        low = np.sqrt(np.maximum(per_thrust * self.least - local**2, 1e-6))
        high = np.sqrt(per_thrust * self.most + local**2)
        beyond = np.minimum(local / low, 1.0) ** 2 * a.per_stall
        attached = 1.0 / (1.0 + beyond**2)
        slope = attached + (1.0 - attached) * a.C_90 / a.C_l
        wet = 0.5 * a.rho * a.S_ratio * a.S_p * a.C_l
        free = 0.5 * a.rho * (0.5 * a.S - a.S_ratio * a.S_p) * local * max(a.C_l, a.C_90)
        off, d = local**2 / (per_thrust * self.least), self.deflection
        turned = (1.0 - d * d / 6.0) * (1.0 - 0.5 * d * d)
        grip = Interval((1.0 - off) * np.minimum(slope, 1.0) * turned, (1.0 + off) * np.maximum(slope, 1.0))
        wetted = Interval(wet * low * np.minimum(slope, 1.0), wet * high * np.maximum(slope, 1.0))
        return wetted, Interval(np.zeros_like(free), free), grip

    def effectiveness(self, speed: float, spin: float) -> float:
        """Of an elevon at most, over that at rest."""
        return float(self._streams(np.array([speed + self.a.a_y * spin]))[2].high[0])

    def main_terms(self, speed: Array, spin: Array) -> Terms:
        """Of what M has of the air beyond the linear loop the largest, as in ``terms``.

        They are the push of the left and the right half wing, and what a deflected elevon makes of its own along x_b.
        """
        a, n = self.a, size(self.gains)
        wetted, free, _ = self._streams(speed + a.a_y * spin)
        push, bend = wetted + free + -hover_push(a, self.gains.u_bar.T1), self._bend(wetted + free)
        sides = (a.a_y, -a.a_y)
        terms = [(push, in_world(per_mass(a, surfaces_push(a, y, -1.0)), n)) for y in sides]
        return terms + [(bend, in_world(per_mass(a, surface_drag(a, y)), n)) for y in sides]

    def _bend(self, push: Interval) -> Interval:
        """Share of an elevon's normal force that is along x_b where it is deflected."""
        most = self.a.xi_f * self.deflection * push.high
        return Interval(-most, most)

    def extremes(self, speed: float, spin: float) -> list[Array]:
        """M of both pushes at their greatest, and of one there, the other at its least, elevons up or down."""
        terms = self.main_terms(np.array([speed]), np.array([spin]))
        (push, left), (_, right), (bend, up), (_, down) = terms
        sides = [push.high[0] * left + end[0] * right for end in (push.high, push.low)]
        return [sides[0], *(sides[1] + bend.high[0] * (s * up + r * down) for s in (-1.0, 1.0) for r in (-1.0, 1.0))]

    def terms(self, at: AttitudeBoxes, speed: Array, spin: Array) -> Terms:
        """The rest of it, and what a turned body changes; speeds [m/s] and rates [rad/s] are bounded, per box."""
        n = size(self.gains)
        wetted, free, grip = self._streams(speed + self.a.a_y * spin)
        shares = [(share, per_mass(self.a, G)) for share, G in self._shares(wetted, free, speed, spin)]
        terms: Terms = [(share, in_world(G, n)) for share, G in shares]
        sides = [per_mass(self.a, surfaces_push(self.a, y, -1.0)) for y in (self.a.a_y, -self.a.a_y)]
        bent = [per_mass(self.a, surface_drag(self.a, y)) for y in (self.a.a_y, -self.a.a_y)]
        pushed, bend = wetted + free, self._bend(wetted + free)
        terms += _turned(at, [*((pushed, G) for G in sides), *((bend, G) for G in bent), *shares], n)
        return terms + self._elevons(at, grip + -1.0, grip)

    def _shares(self, wetted: Interval, free: Interval, speed: Array, spin: Array) -> list[tuple[Interval, Array]]:
        """Forces and moments by (v_b, w): shares, and the matrices that they are of."""
        a, d = self.a, self.deflection
        local, both = speed + a.a_y * spin, wetted + free
        zero = np.zeros_like(local)
        sine, cosine = d, 1.0 - 0.5 * d * d
        # Of a centre of pressure that is shifted: the slipstream's is as far as its flow is detached.
        beyond = np.minimum(local**2 / np.maximum(2.0 * self.least / (a.rho * a.S_p) - local**2, 1e-6), 1.0)
        detached = (a.per_stall * beyond) ** 2 * np.sqrt(beyond)
        shifted = (1.0 - a.xi_f) * a.cp_shift * (free.high + wetted.high * np.minimum(detached, 1.0))
        drag = 0.25 * a.rho * a.S * a.C_d0 * local
        made = []
        e = np.eye(6)
        for y in (a.a_y, -a.a_y):
            b = np.array((1.0, 0.0, 0.0, 0.0, 0.0, -y))
            wing, flap = surfaces(a, y)
            made += [
                (Interval(zero, a.xi_f * (1.0 - cosine**2) * both.high), np.outer(flap, flap)),
                (Interval(zero, shifted), -(np.outer(e[4], wing) + np.outer(wing, e[4]))),
                (Interval(zero, a.cp_shift * shifted), -np.outer(e[4], e[4])),
                (Interval(zero, drag + a.xi_f * sine**2 * free.high), -np.outer(b, b)),
                (Interval(-a.xi_f * sine * free.high, a.xi_f * sine * free.high), np.outer(flap, b)),
                (Interval(-drag, drag), np.outer(b, e[2] + y * e[3])),
                (Interval(-drag, drag), np.outer(b, e[1])),
            ]
        slow, fast = self._speeds()
        rotors = np.full_like(local, a.J_p * (fast - slow))
        torque = np.full_like(local, abs(a.k_mv - a.k_m / a.k_f * a.k_fv) * (fast - slow))
        h = 0.25 * a.rho * a.S * speed
        return [
            *made,
            ((2.0 / a.C_l * a.C_y0) * (both + -hover_push(a, self.gains.u_bar.T1)), -np.outer(e[1], e[1])),
            (Interval(zero, h * a.c**2 * a.C_mq), -np.outer(e[4], e[4])),
            (Interval(zero, h * a.b**2 * a.C_nr), -np.outer(e[5], e[5])),
            (Interval(-rotors, rotors), np.outer(e[4], e[5]) - np.outer(e[5], e[4])),
            (Interval(-torque, torque), np.outer(e[3], e[0])),
        ]

    def _elevons(self, at: AttitudeBoxes, more: Interval, grip: Interval) -> Terms:
        """Elevons that are more or less effective than at rest, and their drag."""
        n, terms, d = size(self.gains), [], self.deflection
        dragged = Interval(-d * grip.high, d * grip.high)
        for elevon in (0, 1):
            M, force = elevon_effect(self.a, self.gains, elevon)
            asked, drags = -feedback(self.gains)[2 + elevon], elevon_drag(self.a)[:, elevon]
            turn = np.zeros((n, n))
            turn[RATE_ROWS] = np.outer(drags[RATE_ROWS], asked)
            terms += [(more, M), (dragged, turn)]
            for i in range(3):
                terms += [
                    (more * at.axes[2][i], row_matrix(3 + i, force)),
                    (dragged * at.axes[0][i], row_matrix(3 + i, drags[5] * asked)),
                ]
        return terms

    def channels(self, ratio: float, speed: float, spin: float, eta: float) -> Channels:
        """Errors of late commands: those of thrusts and elevons, drag of the elevons, and thrust by a late inflow.

        Args:
            ratio: Of two thrusts DELAY apart at most, at one inflow.
            speed: At most [m/s].
            spin: Likewise [rad/s].
            eta: At least.
        """
        a, d, n = self.a, self.deflection, size(self.gains)
        late = thrust_slope(a)
        ratio *= 1.0 + 2.0 * late * DELAY * MAX_ACCELERATION * a.g / self.least
        more = self.effectiveness(speed, spin)
        at = channels(a, self.gains, ratio, d, more)
        B, drags = at.columns[:, :6], np.vstack([elevon_drag(a), np.zeros((n - 12, 2))])
        columns = np.hstack([B, drags, drags, B[:, :4], drags, at.columns[:, 6:]])
        # The inflow's rate is nose v' + nose' v, and |nose'| at most the rates, |w| <= 2 |eps'| / eta.
        rows = np.zeros((6, n))
        rows[:3, VELOCITY_ROWS] = math.sqrt(1.0 + SLIGHT) * np.eye(3)
        rows[3:, ATTITUDE_ROWS] = math.sqrt(1.0 + 1.0 / SLIGHT) * (2.0 * speed / eta) * np.eye(3)
        first = len(at.rows)
        row = np.concatenate([at.row[:6], at.row[2:6], np.full(6, first), at.row[6:]])
        factors = np.concatenate(
            [
                at.factors[:6],
                d * at.factors[2:6],
                late * np.repeat((1.0, more * d, more * d * d), 2),
                at.factors[6:],
            ]
        )
        also = np.zeros((len(row), first + 6))
        also[10:16, first + 1 :] = 1.0
        delays = np.concatenate([np.full(16, DELAY), at.delays[6:]])
        force = np.linalg.norm(columns[VELOCITY_ROWS], axis=0)
        return Channels(columns, force, np.vstack([at.rows, rows]), row, delays, factors, also)


def surfaces_push(a: Airframe, y: float, sign: float = 1.0) -> Array:
    """Forces and moments by (v_b, w) of one of push on a half wing, (6, 6)."""
    wing, flap = surfaces(a, y)
    return sign * ((1.0 - a.xi_f) * np.outer(wing, wing) + a.xi_f * np.outer(flap, flap))


def surface_drag(a: Airframe, y: float) -> Array:
    """Forces and moments by (v_b, w), along x_b, of one of an elevon's normal force on a half wing, (6, 6)."""
    return np.outer((1.0, 0.0, 0.0, 0.0, 0.0, -y), surfaces(a, y)[1])


def _turned(at: AttitudeBoxes, shares: list[tuple[Interval, Array]], n: int) -> Terms:
    """What a turned body changes of matrices of (v_b, w), each times its share."""
    nothing = Interval(np.zeros_like(at.kappa.low), np.zeros_like(at.kappa.low))
    places: dict[tuple[int, int], Interval] = {}
    for share, G in shares:
        whole = in_world(G, n)
        changes = [((3 + i, 3 + j), _both(at, G, i, j)) for i in range(3) for j in range(3)]
        changes += [((3 + i, 9 + j), _one(at, G[:3, 3 + j], i)) for i in range(3) for j in range(3)]
        changes += [((9 + i, 3 + j), _one(at, G[3 + i, :3], j)) for i in range(3) for j in range(3)]
        for place, value in changes:
            if value is not None:
                places[place] = places.get(place, nothing) + share * (value + -whole[place])
    return [(value, entry_matrix(*place, n)) for place, value in places.items()]


def _both(at: AttitudeBoxes, G: Array, i: int, j: int) -> Interval | None:
    parts = [G[k, m] * (at.axes[k][i] * at.axes[m][j]) for k in range(3) for m in range(3) if G[k, m]]
    return _total(parts)


def _one(at: AttitudeBoxes, g: Array, i: int) -> Interval | None:
    return _total([g[k] * at.axes[k][i] for k in range(3) if g[k]])


def _total(parts: list[Interval]) -> Interval | None:
    if not parts:
        return None
    whole = parts[0]
    for part in parts[1:]:
        whole = whole + part
    return whole
