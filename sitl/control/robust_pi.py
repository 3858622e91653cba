r"""The law that flew: structured proportional-integral output feedback with roll-off, after F. Sansou (thesis 2024).

It hovers before a wind wall, and measures neither the wind nor how far the wing has to lean into it: integrals find the
tilt that holds the place. In the heading frame of :mod:`sitl.control.hover_linear`,

.. math::
    x = (p - p_c,\; v,\; \varepsilon_1,\; \varepsilon_3,\; \omega), \quad
    \dot x_c = H x, \quad
    u = u_{eq} + \Sigma x_c + F(z) K x, \quad
    F(z) = \frac{n_1 z^{-1} + n_2 z^{-2}}{1 + d_1 z^{-1} + d_2 z^{-2}}

with u = (T1, T2 [N], delta1, delta2 [rad]); Sigma adds the first integral to both thrusts and the second to both
elevons, F is one biquad per output. The pitch, eps_2, is not fed back: the equilibrium's is not known. The biquads are
those of a loop at 500 Hz. :mod:`sitl.design.robust_pi_gains` has the numbers, with their source, signs and frames. As
in the source there is no anti-windup; what is commanded beyond a limit stops at it.

The set-point p_c moves to the reference at a bounded speed, as its pilot moved it, and the heading turns to the
reference's at a bounded rate; else a far target would saturate the elevons.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sitl.compiled import kernel
from sitl.control.allocation import PITCH, ROLL, THRUST, YAW
from sitl.control.estimate import Estimate
from sitl.control.hover_linear import HoverError, error
from sitl.control.indi import facing
from sitl.control.reference import Reference
from sitl.model.airframe import Airframe, Array
from sitl.model.arithmetic import clipped, wrapped
from sitl.model.state import Actuators
from sitl.model.vectors import Vector, add, shortened, subtract


class RobustPiGains(NamedTuple):
    """Gains of the law, in the frames NWU and FLU; the columns of K and H are the entries of x."""

    K: Array  # (4, 11)
    H: Array  # (2, 11)
    ahead: Array  # n_1, n_2 of the biquads, (2,)
    back: Array  # d_1, d_2 of the biquads, (2,)
    thrust: float  # u_eq of a motor [N]
    k_f: float  # motors turn at sqrt(T / k_f) [N s2]
    set_point_speed: float  # of p_c, at most [m/s]
    turn_rate: float  # of the heading, at most [rad/s]


class Outputs(NamedTuple):
    """One value for each actuator."""

    left_thrust: float  # [N]
    right_thrust: float  # [N]
    left_elevon: float  # [rad]
    right_elevon: float  # [rad]


class RobustPiState(NamedTuple):
    """The law's state."""

    set_point: Vector  # p_c, world NWU [m]
    heading: float  # that is held [rad]
    thrust: float  # integral, of each motor [N]
    elevon: float  # integral, of each elevon [rad]
    recent: Outputs  # inner values of the biquads, of the last tick
    older: Outputs  # and of the one before


@kernel
def start(estimate: Estimate, gains: RobustPiGains) -> RobustPiState:
    """Jump map on entering the law: the set-point where the vehicle is, the integrals carry what is commanded."""
    now, none = estimate.actuators, Outputs(0.0, 0.0, 0.0, 0.0)
    squares = now.left_motor * now.left_motor + now.right_motor * now.right_motor
    return RobustPiState(
        set_point=estimate.position,
        heading=facing(estimate),
        thrust=0.5 * gains.k_f * squares - gains.thrust,
        elevon=0.5 * (now.left_elevon + now.right_elevon),
        recent=none,
        older=none,
    )


@kernel
def step(
    estimate: Estimate, reference: Reference, gains: RobustPiGains, a: Airframe, robust_pi: RobustPiState, dt: float
) -> tuple[Actuators, int, RobustPiState]:
    """One tick: actuator commands, DARKO_SATURATION bits, and the state after it.

    Args:
        estimate: What the vehicle believes of itself.
        reference: A position to hover at, and a heading.
        gains: Gains of the law.
        a: The airframe as the law knows it: its limits.
        robust_pi: The law's state.
        dt: Tick [s]; the biquads are those of 2 ms.
    """
    reach = min(reference.speed, gains.set_point_speed) * dt
    way = shortened(subtract(reference.position, robust_pi.set_point), reach)
    set_point = add(robust_pi.set_point, way)
    turn = clipped(wrapped(reference.heading - robust_pi.heading), -gains.turn_rate * dt, gains.turn_rate * dt)
    heading = robust_pi.heading + turn
    x = error(estimate, set_point, heading)
    thrust = robust_pi.thrust + dt * _row(0, x, gains.H)
    elevon = robust_pi.elevon + dt * _row(1, x, gains.H)
    recent, older = robust_pi.recent, robust_pi.older
    inner = Outputs(
        _inner(_row(0, x, gains.K), recent.left_thrust, older.left_thrust, gains),
        _inner(_row(1, x, gains.K), recent.right_thrust, older.right_thrust, gains),
        _inner(_row(2, x, gains.K), recent.left_elevon, older.left_elevon, gains),
        _inner(_row(3, x, gains.K), recent.right_elevon, older.right_elevon, gains),
    )
    filtered = Outputs(
        _filtered(recent.left_thrust, older.left_thrust, gains),
        _filtered(recent.right_thrust, older.right_thrust, gains),
        _filtered(recent.left_elevon, older.left_elevon, gains),
        _filtered(recent.right_elevon, older.right_elevon, gains),
    )
    command = Actuators(
        _motor(gains.thrust + thrust + filtered.left_thrust, gains),
        _motor(gains.thrust + thrust + filtered.right_thrust, gains),
        elevon + filtered.left_elevon,
        elevon + filtered.right_elevon,
    )
    return command, _saturation(command, a), RobustPiState(set_point, heading, thrust, elevon, inner, recent)


@kernel
def _row(row: int, x: HoverError, gain: Array) -> float:
    """A row of K x or H x."""
    p, v, e, w = x.position, x.velocity, x.tilt, x.rates
    moving = (gain[row, 0] * p.x + gain[row, 1] * p.y + gain[row, 2] * p.z) + (
        gain[row, 3] * v.x + gain[row, 4] * v.y + gain[row, 5] * v.z
    )
    turning = (gain[row, 6] * e.x + gain[row, 7] * e.z) + (
        gain[row, 8] * w.x + gain[row, 9] * w.y + gain[row, 10] * w.z
    )
    value: float = moving + turning
    return value


@kernel
def _inner(value: float, recent: float, older: float, gains: RobustPiGains) -> float:
    """The biquad's inner value of this tick (direct form II)."""
    inner: float = value - gains.back[0] * recent - gains.back[1] * older
    return inner


@kernel
def _filtered(recent: float, older: float, gains: RobustPiGains) -> float:
    """The output of a biquad, which what comes in now does not reach yet."""
    output: float = gains.ahead[0] * recent + gains.ahead[1] * older
    return output


@kernel
def _motor(thrust: float, gains: RobustPiGains) -> float:
    return math.sqrt(max(thrust, 0.0) / gains.k_f)


@kernel
def _saturation(command: Actuators, a: Airframe) -> int:
    """The axes whose actuators are asked for more than they can."""
    slowest, fastest = min(command.left_motor, command.right_motor), max(command.left_motor, command.right_motor)
    bits = THRUST | YAW if slowest < a.omega_min or fastest > a.omega_max else 0
    beyond = max(abs(command.left_elevon), abs(command.right_elevon)) > a.delta_max
    return bits | PITCH | ROLL if beyond else bits
