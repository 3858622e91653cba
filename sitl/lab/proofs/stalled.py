r"""Contribution to M of the wing of :mod:`sitl.model.stall`, beyond the linear loop, on states near the hover.

A surface of a half wing at y with its centre of pressure at l behind the centre of mass feels c (v_b, w), with
c = (0, 0, 1, y, l, 0), and pushes back along the same c; its drag and the thrust's axis have b = (1, 0, 0, 0, 0, -y).
So the air is a sum of fixed matrices of rank one (:mod:`sitl.lab.proofs.surfaces`), each times a share that the speeds
and thrusts of the set bound. The linear loop has the push at the hover, p_0 = rho S_ratio S_p u_0 C_l / 2 per half
wing; what is left are

- the pushes of both half wings less p_0. Their mean is bounded apart from half of their difference, which only uneven
  thrusts, turning and unequal incidences make, and which rolls the vehicle by the motion along the wing's normal. Both
  factors of that product are linear in the state, so that each may count as the share of the other's matrix: half of
  it is counted this way, half that way, as the extreme of one factor seldom meets the other's;
- what deflected elevons make along x_b, a part of their push and a drag: again by mean and half difference;
- shift of the centre of pressure, drag, damping, the rotors' gyroscopic moment, the torque's change by inflow;
- elevons in the stream: u_s |u| in place of 2 T / (rho S_p), sin cos of the deflection.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

import numpy as np

from sitl import Airframe, Array
from sitl.control.hover_linear import LinearGains
from sitl.lab.proofs.closed_loop import (
    ATTITUDE_ROWS,
    DELAY,
    SAMPLING,
    VELOCITY_ROWS,
    AttitudeBoxes,
    Channels,
    Interval,
    Terms,
    channels,
    elevon_effect,
    row_matrix,
    size,
)
from sitl.lab.proofs.surfaces import (
    drags,
    elevon_drag,
    hover_push,
    in_world,
    main_parts,
    per_mass,
    surface_drag,
    surfaces,
    turned,
)
from sitl.model.airframe import STALL

MAX_DRIFT = 2.0  # that the bounds of the thrust by inflow are of [m/s]
# What `Proof.greatest_rates` allows on a set, so that it may be taken for granted here:
MAX_ACCELERATION = 1.5  # rate of the inflow [g]
MAX_THRUST_RATE = 9.0  # of either thrust that is asked for [N/s]
MAX_UNEVEN_RATE = 7.5  # of half their difference [N/s]
UNEVEN = 0.5  # of the product of uneven thrusts and motion, what counts as the motion's share of the thrusts
SLIGHT = 0.5  # of squares: (a + b)^2 <= (1 + SLIGHT) a^2 + (1 + 1 / SLIGHT) b^2


def thrust_slope(a: Airframe) -> float:
    """The most that a thrust changes by the inflow [N s/m]; 0 for a set without a propeller table."""
    return abs(a.k_fv) * a.omega_max + 2.0 * abs(a.k_fvv) * MAX_DRIFT


class Commands(NamedTuple):
    """Bounds of what a law asks for on a set; of a pair also of its mean and of half its difference."""

    swing: float  # of either thrust, over that of the hover
    swing_together: float
    swing_apart: float
    deflection: float  # of either elevon [rad]
    deflection_together: float
    deflection_apart: float


class Main(NamedTuple):
    """A large part of M that the air makes beyond the linear loop: a share of a matrix, and how that turns."""

    share: Interval
    M: Array  # at the hover attitude
    turned: Terms  # what an attitude changes of it


@dataclass(frozen=True)
class Stalled:
    """The air on a set, where thrusts and deflections are within bounds."""

    a: Airframe
    gains: LinearGains
    least: float  # thrust of either propeller [N]
    most: float
    mean: tuple[float, float]  # of both: the least and the most
    apart: float  # half of their difference at most
    asked: float  # of it what the law asks for now, and what they may be off that
    off: float
    deflection: float  # at most [rad]
    together: float  # mean of both deflections at most
    opposed: float  # half of their difference at most

    @classmethod
    def on(cls, a: Airframe, gains: LinearGains, asked: Commands) -> Stalled | None:
        """Bounds where the law's commands are within theirs.

        Returns:
            None for a set with another level of aerodynamics.
        """
        if a.aerodynamics != STALL:
            return None
        T, late = gains.u_bar.T1, thrust_slope(a) * DELAY * MAX_ACCELERATION * a.g
        # Two actuators are on their ways between the same two commands, but one may be there before the other.
        ahead, turning = 0.5 * SAMPLING * MAX_THRUST_RATE, 0.5 * SAMPLING * a.delta_rate
        d, apart = min(asked.deflection, a.delta_max), asked.swing_apart * T
        return cls(
            a,
            gains,
            least=(1.0 - asked.swing) * T - late,
            most=(1.0 + asked.swing) * T + late,
            mean=((1.0 - asked.swing_together) * T - late - ahead, (1.0 + asked.swing_together) * T + late + ahead),
            apart=apart + late + ahead,
            asked=apart,
            off=DELAY * MAX_UNEVEN_RATE + late + ahead,
            deflection=d,
            together=min(asked.deflection_together + turning, d),
            opposed=min(asked.deflection_apart + turning, d),
        )

    def is_within(self, speed: float) -> bool:
        """Whether the bounds are of this speed: no propeller unloads [m/s]."""
        return self.least > 0.0 and speed < min(MAX_DRIFT, self.a.advance_knot * self._slowest())

    def _slowest(self) -> float:
        """The slowest propeller [rad/s]."""
        return math.sqrt(max(self.least - thrust_slope(self.a) * MAX_DRIFT, 0.0) / self.a.k_f)

    def _streams(self, local: Array) -> tuple[Interval, Interval, Interval]:
        """Push of the slipstream's part [kg/s], of the free one, and the elevons' effectiveness, by the local speed."""
        a, per_thrust = self.a, 2.0 / (self.a.rho * self.a.S_p)
        low = np.sqrt(np.maximum(per_thrust * self.least - local**2, 1e-6))
        high = np.sqrt(per_thrust * self.most + local**2)
        slope = self._slope(local)
        wet = 0.5 * a.rho * a.S_ratio * a.S_p * a.C_l
        free = self._free_area() * local * max(a.C_l, a.C_90)
        off, d = local**2 / (per_thrust * self.least), self.deflection
        least_turned = (1.0 - d * d / 6.0) * (1.0 - 0.5 * d * d)
        grip = Interval((1.0 - off) * slope.low * least_turned, (1.0 + off) * slope.high)
        return (
            Interval(wet * low * slope.low, wet * high * slope.high),
            Interval(np.zeros_like(free), free),
            grip,
        )

    def _slope(self, local: Array) -> Interval:
        """Of the lift in the slipstream, over that of attached flow."""
        a, per_thrust = self.a, 2.0 / (self.a.rho * self.a.S_p)
        low = np.sqrt(np.maximum(per_thrust * self.least - local**2, 1e-6))
        beyond = np.minimum(local / low, 1.0) ** 2 * a.per_stall
        attached = 1.0 / (1.0 + beyond**2)
        slope = attached + (1.0 - attached) * a.C_90 / a.C_l
        return Interval(np.minimum(slope, 1.0), np.maximum(slope, 1.0))

    def _free_area(self) -> float:
        """Half of density times the area of a half wing outside the slipstream [kg/m]."""
        a = self.a
        return 0.5 * a.rho * (0.5 * a.S - a.S_ratio * a.S_p)

    def _pushes(self, speed: Array, spin: Array) -> tuple[Interval, Interval]:
        """Mean of both half wings' pushes, and half of their difference less what ``_shared`` is of [kg/s]."""
        a, per_thrust = self.a, 2.0 / (self.a.rho * self.a.S_p)
        arm = a.a_y * spin
        local = speed + arm
        slope, wet = self._slope(local), 0.5 * a.rho * a.S_ratio * a.S_p * a.C_l
        # Squares of both streams are mean +- uneven; a sum of roots is concave.
        least, most = per_thrust * self.mean[0] - local**2, per_thrust * self.mean[1] + local**2
        uneven = per_thrust * self.apart + 2.0 * local * arm
        slowest = np.sqrt(np.maximum(least + uneven, 1e-6)) + np.sqrt(np.maximum(least - uneven, 1e-6))
        fastest = 2.0 * np.sqrt(most)
        steep, flat = wet * slope.high / slowest, wet * slope.low / fastest
        shared = self._shared()
        left = np.maximum(np.abs(steep * per_thrust - shared), np.abs(flat * per_thrust - shared))
        half = left * self.asked + steep * (per_thrust * self.off + 2.0 * local * arm)
        half = half + 0.25 * wet * (slope.high - slope.low) * fastest
        area, greatest = self._free_area(), max(a.C_l, a.C_90)
        # Slope by the flow's direction: the derivative of the attached share is at most 1.0653 per_stall^0.5.
        steepest = math.hypot(greatest, 1.0653 * math.sqrt(a.per_stall) * abs(a.C_l - a.C_90))
        half = half + area * np.minimum(steepest * arm, 0.5 * greatest * local)
        low = wet * slope.low * 0.5 * slowest
        high = wet * slope.high * 0.5 * fastest + area * greatest * np.hypot(speed, arm)
        return Interval(low, high), Interval(-half, half)

    def _shared(self) -> float:
        """Half of the pushes' difference, by half of that of the thrusts, that is taken for the motion's [kg/(N s)]."""
        T = self.gains.u_bar.T1
        return UNEVEN * 0.5 * hover_push(self.a, T) / T

    def effectiveness(self, speed: float, spin: float) -> float:
        """Of an elevon at most, over that at rest."""
        return float(self._streams(np.array([speed + self.a.a_y * spin]))[2].high[0])

    def main_terms(self, speed: Array, spin: Array, normal: Interval, at: AttitudeBoxes | None = None) -> list[Main]:
        """The largest, and how they turn with the attitude.

        They are the mean and half the difference of the pushes, uneven thrusts by the motion along the wing's normal,
        then the mean and half the difference of the deflections for what they make along x_b: a deflected elevon has a
        part of its push there, at the push of the hover, and a drag.

        Args:
            speed: At most on each box [m/s].
            spin: Likewise [rad/s].
            normal: Of ``normal_motion`` [m/s].
            at: The boxes, if it is asked how they turn.
        """
        ones = np.ones_like(speed)
        mean, half = self._pushes(speed, spin)
        shares = [mean + -hover_push(self.a, self.gains.u_bar.T1), half, self._shared() * normal]
        shares += [Interval(-most_of_it * ones, most_of_it * ones) for most_of_it in (self.together, self.opposed)]
        return [
            Main(share, part.upright(), [] if at is None else part.turned(at))
            for share, part in zip(shares, main_parts(self.a, self.gains), strict=True)
        ]

    def _uneven(self, at: AttitudeBoxes) -> Terms:
        """Rest of the part of uneven thrusts that counts as the motion's: its force, and its change with attitude."""
        whole = main_parts(self.a, self.gains)[1].by_motion
        most_of_it = np.full_like(at.kappa.low, self._shared() * self.asked)
        share, force, n = Interval(-most_of_it, most_of_it), whole.copy(), size(self.gains)
        force[3] = 0.0
        return [(share, in_world(force, n)), *((share * change, part) for change, part in turned(at, whole, n))]

    def extremes(self, speed: float, spin: float, normal: float) -> list[Array]:
        """M at corners of the main terms, one of each pair of mirror images."""
        along = Interval(np.array([-normal]), np.array([normal]))
        terms = self.main_terms(np.array([speed]), np.array([spin]), along)
        ends = [[t.share.low[0] * t.M, t.share.high[0] * t.M] for t in terms]
        ends[1] = ends[1][1:]
        return [np.asarray(sum(corner)) for corner in product(*ends)]

    def terms(self, at: AttitudeBoxes, speed: Array, spin: Array) -> Terms:
        """The rest of it, and what a turned body changes of the push at the hover; bounds per box.

        Args:
            at: The boxes.
            speed: At most on each [m/s].
            spin: Likewise [rad/s].
        """
        n, a = size(self.gains), self.a
        wetted, free, grip = self._streams(speed + a.a_y * spin)
        terms: Terms = []
        for share, G in self._shares(wetted, free, speed, spin):
            M = per_mass(a, G)
            terms.append((share, in_world(M, n)))
            terms += [(share * change, part) for change, part in turned(at, M, n)]
        whole = hover_push(a, self.gains.u_bar.T1) * main_parts(a, self.gains)[0].by_motion
        terms += self._uneven(at)
        return [*_merged(terms), *turned(at, whole, n), *self._elevons(at, grip + -1.0)]

    def _shares(self, wetted: Interval, free: Interval, speed: Array, spin: Array) -> list[tuple[Interval, Array]]:
        """Forces and moments by (v_b, w): shares, and the matrices that they are of."""
        a, d = self.a, self.deflection
        local, both = speed + a.a_y * spin, wetted + free
        zero, base = np.zeros_like(local), hover_push(a, self.gains.u_bar.T1)
        sine, cosine = d, 1.0 - 0.5 * d * d
        # Of a centre of pressure that is shifted: the slipstream's is as far as its flow is detached.
        beyond = np.minimum(local**2 / np.maximum(2.0 * self.least / (a.rho * a.S_p) - local**2, 1e-6), 1.0)
        detached = (a.per_stall * beyond) ** 2 * np.sqrt(beyond)
        pushed = self._free_area() * local * _detached_slope(a)
        shifted = (1.0 - a.xi_f) * a.cp_shift * (pushed + wetted.high * np.minimum(detached, 1.0))
        drag = 0.25 * a.rho * a.S * a.C_d0 * local
        least_turned = (1.0 - d * d / 6.0) * (1.0 - 0.5 * d * d)
        bend = a.xi_f * d * np.maximum(np.abs(both.high - base), np.abs(both.low * least_turned - base))
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
                (Interval(-bend, bend), surface_drag(a, y)),
            ]
        by_speed = 2.0 * a.k_f * self._slowest() - abs(a.k_fv) * MAX_DRIFT
        differ = 2.0 * self.apart / by_speed if by_speed > 0.0 else a.omega_max
        rotors = np.full_like(local, a.J_p * differ)
        torque = np.full_like(local, abs(a.k_mv - a.k_m / a.k_f * a.k_fv) * differ)
        h = 0.25 * a.rho * a.S * speed
        return [
            *made,
            ((2.0 / a.C_l * a.C_y0) * (both + -base), -np.outer(e[1], e[1])),
            (Interval(zero, h * a.c**2 * a.C_mq), -np.outer(e[4], e[4])),
            (Interval(zero, h * a.b**2 * a.C_nr), -np.outer(e[5], e[5])),
            (Interval(-rotors, rotors), np.outer(e[4], e[5]) - np.outer(e[5], e[4])),
            (Interval(-torque, torque), np.outer(e[3], e[0])),
        ]

    def _elevons(self, at: AttitudeBoxes, more: Interval) -> Terms:
        """Elevons that are more or less effective than at rest, and that share of their drag."""
        terms: Terms = []
        most = self.deflection * np.maximum(np.abs(more.low), np.abs(more.high))
        dragged = Interval(-most, most)
        for elevon in (0, 1):
            (turn, drag), (M, force) = drags(self.a, self.gains, elevon), elevon_effect(self.a, self.gains, elevon)
            terms += [(more, M), (dragged, turn)]
            for i in range(3):
                terms += [
                    (more * at.axes[2][i], row_matrix(3 + i, force)),
                    (dragged * at.axes[0][i], row_matrix(3 + i, drag)),
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


def _detached_slope(a: Airframe) -> float:
    """The most that a slope and the detached share of the same flow multiply to [1/rad]."""
    # (C_90 + s (C_l - C_90)) (1 - s) over the attached share s.
    rise = a.C_l - a.C_90
    share = max(0.0, 0.5 * (rise - a.C_90) / rise) if rise > 0.0 else 0.0
    return (a.C_90 + share * rise) * (1.0 - share)


def _merged(terms: Terms) -> Terms:
    """The same terms, those of one matrix as one."""
    found: dict[bytes, tuple[Interval, Array]] = {}
    for share, M in terms:
        key = M.tobytes()
        found[key] = (found[key][0] + share, M) if key in found else (share, M)
    return list(found.values())
