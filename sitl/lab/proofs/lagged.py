r"""The closed loop of a wing that stalls and of actuators that lag, with bounds of its Jacobian on boxes of states.

The state z has, besides the 15 of :mod:`sitl.lab.proofs.closed_loop`, how far both propellers and both elevons are off
those of the hover: in newtons, by the thrust's slope there, and deflection times the hover's thrust. They follow
their commands by the first-order lag of the set. The integral is told from where it balances the hover.

The plant is that of :mod:`sitl.model.stall`, written in numbers with bounds (:mod:`sitl.lab.proofs.bounded`): wings in
slipstreams that swirl, free wing, discs that the air crosses, thrust by inflow, gyroscopic moments.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sitl import Actuators, Airframe, Array, SitlError, Vector
from sitl.control.hover_linear import SQRT_HALF, LinearGains
from sitl.lab.proofs.bounded import Bounded, Ends, Table, larger, paired
from sitl.lab.proofs.closed_loop import SAMPLING
from sitl.lab.proofs.surfaces import AXES
from sitl.model.airframe import FIRST_ORDER, STALL, elevon_arm
from sitl.model.propeller import thrust
from sitl.model.stall import wrench as plant_wrench

LAGGED_STATES = 19
ACTUATORS = slice(15, 19)
NONLINEAR_STATES = [*range(3, 12), *range(15, 19)]  # of the state, what the plant's rates are not linear in
VARIABLES = 17  # those, and what the law takes off its commands
COMMAND_DELAY = 2.0 * SAMPLING  # from the sample of a command until the next one is in force
TANGENTS, WIDEST = 20_001, 0.15  # of the tangent of the incidence in a slipstream, about the swirl's

Three = tuple[Bounded, Bounded, Bounded]


class Blown(NamedTuple):
    """Functions of m = tan(incidence) in a slipstream: push over speed ahead, the same times m, and the flow."""

    push: Table  # C(m) (1 + m^2)^(1/2)
    force: Table  # m C(m) (1 + m^2)^(1/2)
    flow: Table  # (1 + m^2)^(1/2)

    @classmethod
    def of(cls, a: Airframe) -> Blown:
        """Looked up about what the swirl makes of the incidence."""
        m = a.swirl + np.linspace(-WIDEST, WIDEST, TANGENTS)
        sine_square = m * m / (1.0 + m * m)
        share = 1.0 / (1.0 + (sine_square * a.per_stall) ** 2)
        slope, flow = share * a.C_l + (1.0 - share) * a.C_90, np.sqrt(1.0 + m * m)
        return cls(Table(m, slope * flow), Table(m, m * slope * flow), Table(m, flow))


@dataclass(frozen=True)
class LaggedLoop:
    """Law and plant, and where they balance."""

    a: Airframe
    gains: LinearGains
    speed: float  # of both propellers in the hover [rad/s]
    lift: float  # thrust of either there [N]
    slope: float  # of the thrust by the speed there [N s]
    blown: Blown

    @classmethod
    def of(cls, a: Airframe, gains: LinearGains) -> LaggedLoop:
        """Find the hover's balance.

        Raises:
            SitlError: The set has other actuators or another level of aerodynamics, or terms that are not bounded here.
        """
        if a.aerodynamics != STALL or a.actuator_model != FIRST_ORDER or a.slip_shift > 0.0 or a.C_y0 > 0.0:
            raise SitlError("no bounds are known of this set: it needs a wing that stalls and first-order actuators")
        low, high = a.omega_min, a.omega_max
        for _ in range(100):
            middle, still = 0.5 * (low + high), Vector(0.0, 0.0, 0.0)
            force, _ = plant_wrench(still, still, Actuators(middle, middle, 0.0, 0.0), a)
            low, high = (low, middle) if force.x > a.m * a.g else (middle, high)
        return cls(a, gains, low, float(thrust(low, 0.0, a)), 2.0 * a.k_f * low + a.k_fw, Blown.of(a))

    @property
    def feedback(self) -> Array:
        """Rows that give what the law takes off its thrusts and deflections times thrust, (4, 19)."""
        return np.hstack([self.gains.K, self.gains.K_i, np.zeros((4, 4))])

    @property
    def tau(self) -> Array:
        """Time constants of the actuators, (4,) [s]."""
        return np.array([self.a.motor_tau] * 2 + [self.a.elevon_tau] * 2)

    @property
    def selection(self) -> Array:
        """The variables by the state, (17, 19)."""
        return np.vstack([np.eye(LAGGED_STATES)[NONLINEAR_STATES], self.feedback])

    def commands(self, asked: list[Bounded], inflow: Bounded) -> list[Bounded]:
        """Commands to the actuators, in the units of the state."""
        a, sent = self.a, []
        for motor in (0, 1):
            wanted = self.lift - asked[motor]
            half = (0.5 / a.k_f) * (a.k_fv * inflow + a.k_fw)
            square = (1.0 / a.k_f) * (wanted - a.k_fvv * inflow.signed_square()) + half.square()
            sent.append(self.slope * (square.sqrt() - half - self.speed))
        for motor, elevon in ((0, 2), (1, 3)):
            sent.append(-self.lift * (asked[elevon] * (self.lift - asked[motor]).inverse()))
        return sent

    def regular(self, x: list[Bounded]) -> tuple[list[Bounded], list[Bounded]]:
        """Rates of velocity, eps and body rates, without the free air's, and the commands.

        Args:
            x: The variables.
        """
        a, v, e, (p, q, r) = self.a, *_vectors(x)
        eta = (1.0 - (e[0].square() + e[1].square() + e[2].square())).sqrt()
        axes = _axes(eta, e)
        body: Three = (_dot(axes[0], v), _dot(axes[1], v), _dot(axes[2], v))
        moving, spinning = self._accelerations(axes, *self._propelled(body, (p, q, r), x[9:13]))
        turning = [
            0.5 * (eta * p + e[1] * r - e[2] * q),
            0.5 * (eta * q + e[2] * p - e[0] * r),
            0.5 * (eta * r + e[0] * q - e[1] * p),
        ]
        gyroscopic = [(a.J3 - a.J2) / a.J1 * (q * r), (a.J1 - a.J3) / a.J2 * (p * r), (a.J2 - a.J1) / a.J3 * (p * q)]
        spinning = [one - other for one, other in zip(spinning, gyroscopic, strict=True)]
        return [*moving, *turning, *spinning], self.commands(x[13:], body[0])

    def _accelerations(
        self, axes: tuple[Three, Three, Three], force: Three, moment: Three
    ) -> tuple[list[Bounded], list[Bounded]]:
        a = self.a
        moving = [_dot((axes[0][k], axes[1][k], axes[2][k]), force) * (1.0 / a.m) for k in range(3)]
        return moving, [one * (1.0 / J) for one, J in zip(moment, (a.J1, a.J2, a.J3), strict=True)]

    def _propelled(self, v: Three, w: Three, s: list[Bounded]) -> tuple[Three, Three]:
        """Force and moment of :func:`sitl.model.stall.wrench`, of propellers and slipstreams."""
        a = self.a
        w1, w2 = (one * (1.0 / self.slope) + self.speed for one in s[:2])
        across = v[1].square() + v[2].square()
        T1, T2 = (self._thrust(one, v[0], across) for one in (w1, w2))
        left, right = self._blown_wing(v, w, T1, s[2], a.a_y), self._blown_wing(v, w, T2, s[3], -a.a_y)
        spin = -a.J_p * (w1 - w2)
        aside, down = v[1] + a.p_x * w[2], v[2] - a.p_x * w[1]
        y = -a.k_h * ((w1 + w2) * aside)
        hubs = [-a.k_h * (one * (down + sign * a.p_y * w[0])) for one, sign in ((w1, 1.0), (w2, -1.0))]
        both = hubs[0] + hubs[1]
        by_air = self._torque_by_air(w1, v[0]) - self._torque_by_air(w2, v[0])
        force = (T1 + T2 + left[0] + right[0], y, left[1] + right[1] + both)
        moment = (
            a.k_m * (w1.square() - w2.square()) + by_air + left[2] + right[2] + a.p_y * (hubs[0] - hubs[1]),
            left[3] + right[3] - w[2] * spin - a.p_x * both,
            left[4] + right[4] - a.p_y * (T1 - T2) + w[1] * spin + a.p_x * y,
        )
        return force, moment

    def _thrust(self, speed: Bounded, inflow: Bounded, across: Bounded) -> Bounded:
        a = self.a
        T = a.k_f * speed.square() + a.k_fv * (speed * inflow) + a.k_fvv * inflow.signed_square() + a.k_fw * speed
        jet = (2.0 / (a.rho * a.S_p)) * T
        return T + a.k_fc * (across * jet * (jet + inflow.square() + across).inverse())

    def _torque_by_air(self, speed: Bounded, inflow: Bounded) -> Bounded:
        """Of a propeller that is not unloaded."""
        return self.a.k_mv * (speed * inflow) + self.a.k_mvv * inflow.signed_square()

    def _blown_wing(self, v: Three, w: Three, T: Bounded, deflected: Bounded, y: float) -> tuple[Bounded, ...]:
        """F_x, F_z, M_x, M_y and M_z of the part of the half wing at y that lies in the slipstream.

        Its two halves meet the air at the tangents s + n and s - n: the swirl's and that of the motion along the
        normal. All forces go with the square of one speed, and with sums and differences of functions of those.
        """
        a, ahead, normal, blown = self.a, v[0] - y * w[2], v[2] + y * w[0], self.blown
        square = ahead.signed_square() + (2.0 / (a.rho * a.S_p)) * T
        per_square = square.inverse()
        slower = 1.0 - ahead.signed_square() * per_square
        aside = (1.0 + v[1].square() * per_square).sqrt().inverse()
        stream, speed = square.sqrt(), (square + v[1].square()).sqrt()
        middle = (-a.swirl) * (larger(-slower, -(slower.sqrt())) * aside)
        way = normal * speed.inverse()
        half = 0.25 * a.rho * a.S_ratio * a.S_p
        push = half * (speed * paired(blown.push, middle, way, 1.0))
        force = half * ((square + v[1].square()) * paired(blown.force, middle, way, -1.0))
        flow = half * (speed * paired(blown.flow, middle, way, 1.0))
        sine, cosine = _turn(deflected * (1.0 / self.lift))
        flap_arm = float(elevon_arm(a))
        wing_arm = (a.Delta_r - a.xi_f * flap_arm) / (1.0 - a.xi_f)
        wing = (a.xi_f - 1.0) * (force + wing_arm * (push * w[1]))
        flap = -a.xi_f * (sine * (stream * push) + cosine * (force + flap_arm * (push * w[1])))
        across, axial = flap * cosine, flap * sine - a.C_d0 * (flow * stream)
        return axial, wing + across, y * (wing + across), wing_arm * wing + flap_arm * across, -y * axial


def _vectors(x: list[Bounded]) -> tuple[Three, Three, Three]:
    """Velocity, eps and rates."""
    return (x[0], x[1], x[2]), (x[3], x[4] + -SQRT_HALF, x[5]), (x[6], x[7], x[8])


def _turn(delta: Bounded) -> tuple[Bounded, Bounded]:
    """Sine and cosine of a deflection, by the plant's series."""
    square = delta.square()
    sine = delta * (1.0 - square * (1.0 / 6.0 - square * (1.0 / 120.0)))
    return sine, 1.0 - square * (0.5 - square * (1.0 / 24.0))


def _dot(a: tuple[Bounded, ...], b: tuple[Bounded, ...]) -> Bounded:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _axes(w: Bounded, e: Three) -> tuple[Three, Three, Three]:
    """Body axes in the world."""
    x, y, z = e
    xx, yy, zz = x.square(), y.square(), z.square()
    xy, xz, yz, wx, wy, wz = x * y, x * z, y * z, w * x, w * y, w * z
    return (
        (1.0 - 2.0 * (yy + zz), 2.0 * (xy + wz), 2.0 * (xz - wy)),
        (2.0 * (xy - wz), 1.0 - 2.0 * (xx + zz), 2.0 * (yz + wx)),
        (2.0 * (xz + wy), 2.0 * (yz - wx), 1.0 - 2.0 * (xx + yy)),
    )


class LargestMotion(NamedTuple):
    """The greatest on a set."""

    speed: float  # [m/s]
    spin: float  # [rad/s]
    turn: float  # change of a vector of length 1 by the attitude


class Bounds(NamedTuple):
    """Of the Jacobians by the variables on boxes: rows are the 9 rates that are not linear, then the 4 commands."""

    slope: Ends  # (n, 13, 17)
    bend: Ends  # how that changes with the variables, (n, 13, 17, 17)


def bounds(loop: LaggedLoop, low: Array, high: Array) -> Bounds:
    """Bounds on boxes of the variables, (n, 17)."""
    x = [Bounded.variable(low[:, k], high[:, k], k, VARIABLES) for k in range(VARIABLES)]
    rates, sent = loop.regular(x)
    both = [*rates, *sent]
    slope, bend = (
        [np.stack([getattr(one, name)[side] for one in both], axis=1) for side in (0, 1)] for name in ("slope", "bend")
    )
    return Bounds((slope[0], slope[1]), (bend[0], bend[1]))


def free_air(a: Airframe, most: LargestMotion, deflection: float) -> list[tuple[float, float, Array]]:
    """Rates that the air outside the slipstreams makes of (v, w), (6, 6): least and greatest shares of matrices.

    Each surface pushes against the velocity of its centre of pressure by a share of the speed there, as drag and
    damping do: a matrix of rank one per surface times that share.

    Args:
        a: The airframe.
        most: On the set.
        deflection: Of either elevon [rad].
    """
    half = 0.5 * a.rho * (0.5 * a.S - a.S_ratio * a.S_p) * (most.speed + a.a_y * most.spin)
    push, d = half * max(a.C_l, a.C_90), deflection
    flap_arm = float(elevon_arm(a))
    wing_arm = (a.Delta_r - a.xi_f * flap_arm) / (1.0 - a.xi_f)
    fixed: list[tuple[float, Array]] = []
    loose = np.zeros((6, 6))
    for y in (a.a_y, -a.a_y):
        wing, flap = (np.array((0.0, 0.0, 1.0, y, arm, 0.0)) for arm in (wing_arm, flap_arm))
        along = np.array((1.0, 0.0, 0.0, 0.0, 0.0, -y))
        fixed += [
            ((1.0 - a.xi_f) * push, np.outer(wing, wing)),
            (a.xi_f * push, np.outer(flap, flap)),
            (half * a.C_d0, np.outer(along, along)),
        ]
        # The shift of the centre of pressure, and what a deflection turns.
        shift = np.array((0.0, 0.0, 0.0, 0.0, a.cp_shift, 0.0))
        turned = np.array((d, 0.0, 0.5 * d * d, 0.5 * d * d * a.a_y, a.cp_shift + 0.5 * d * d * flap_arm, d * a.a_y))
        for share, row, off in (((1.0 - a.xi_f) * push, wing, shift), (a.xi_f * push, flap, turned)):
            crossed = np.outer(np.abs(row), off)
            loose += share * (crossed + crossed.T + np.outer(off, off))
    for axis, length, by in ((4, a.c, a.C_mq), (5, a.b, a.C_nr)):
        unit = np.zeros((6, 6))
        unit[axis, axis] = 1.0
        fixed.append((0.25 * a.rho * a.S * length**2 * by * most.speed, unit))
    R, tilted = np.eye(6), np.zeros((6, 6))
    R[:3, :3], tilted[:3, :3] = AXES, most.turn
    per = 1.0 / np.array((a.m, a.m, a.m, a.J1, a.J2, a.J3))[:, None]
    size, terms = np.abs(R) + tilted, []
    loose = size @ loose @ size.T
    for share, G in fixed:
        terms.append((-share, 0.0, per * (R @ G @ R.T)))
        loose += share * (tilted @ np.abs(G) @ size.T + np.abs(R) @ np.abs(G) @ tilted.T)
    for i, j in zip(*np.nonzero(loose), strict=True):
        unit = np.zeros((6, 6))
        unit[i, j] = 1.0
        bound = float((per * loose)[i, j])
        terms.append((-bound, bound, unit))
    return terms


def whole(loop: LaggedLoop, by_variables: Array) -> Array:
    """Rates of the state that are linear in slopes by the variables, (n, 13, 17), without the rest: (n, 19, 19)."""
    made = np.zeros((len(by_variables), LAGGED_STATES, LAGGED_STATES))
    by_state = by_variables @ loop.selection
    made[:, 3:12], made[:, ACTUATORS] = by_state[:, :9], by_state[:, 9:] / loop.tau[:, None]
    return made


def linear_rest(loop: LaggedLoop) -> Array:
    """Rates of the state that are linear, (19, 19)."""
    made, lead = np.zeros((LAGGED_STATES, LAGGED_STATES)), loop.gains.lead
    made[0:3, 3:6] = np.eye(3)
    made[12:15, 0:3], made[12:15, 3:6] = np.eye(3), lead * np.eye(3)
    made[ACTUATORS, ACTUATORS] = -np.diag(1.0 / loop.tau)
    return made
