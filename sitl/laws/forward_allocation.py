"""From a force along the nose and a moment to motors and elevons, in an air stream.

The airspeed model is inverted in closed form, damping and the wing's own moment included. What the limits do not
allow is given up in this order, last first: yaw (the thrusts' difference) is kept before pitch, pitch before roll, of
which a share is always kept; and the sum of the thrusts gives way to all of them: it is even *raised* where the
elevons need more slipstream, since a tail-sitter that cannot raise its nose does not come to a stop.
"""

import math

import numpy as np
from numba import njit

from sitl.kernels.aerodynamics import damping
from sitl.model.airframe import Airframe, Array
from sitl.laws.allocation import BOOST, PITCH, ROLL, ROUNDING, THRUST, YAW

ROLL_SHARE = 0.15  # of the elevons' travel, kept for roll whatever pitch asks [-]
RESERVE = 0.9  # share of the travel that pitch may use before thrust is raised [-]
LEAST = 0.15  # effectiveness below which an elevon is not divided by [N/rad]


@njit(cache=True)
def invert(force: float, moment: Array, v_b: Array, w: Array, thrusts: Array, a: Airframe, command: Array) -> int:
    """Actuator commands for an axial force and a moment, written into ``command`` (4,).

    Args:
        force: Wanted along x_b, the wing's axial drag not counted [N].
        moment: Wanted, body frame, (3,) [N m].
        v_b: Velocity relative to the air, body frame, (3,) [m/s].
        w: Body rates, (3,) [rad/s].
        thrusts: What the propellers give now, left and right, (2,) [N].
        a: The airframe as the law knows it.
        command: Receives w1, w2 [rad/s], d1, d2 [rad].

    Returns:
        DARKO_GIVEN_UP bits.
    """
    speed_2 = v_b[0] ** 2 + v_b[1] ** 2 + v_b[2] ** 2
    h = 0.5 * a.rho * a.S * math.sqrt(speed_2 + a.mu * a.c * a.c * (w[0] ** 2 + w[1] ** 2 + w[2] ** 2))
    Lx, Ly, Lz = damping(w[0], w[1], w[2], 0.0, h, a)
    arm = a.Delta_r * a.xi_m / a.xi_f
    differ = -(moment[2] - Lz) / (a.p_y - a.S_ratio * a.a_y * a.C_d0)
    lift = -(moment[1] - Ly + h * a.Delta_r * a.C_l * v_b[2]) / arm  # E1 + E2
    twist = (a.k_m / a.k_f * differ - moment[0] + Lx) / a.a_y  # E1 - E2

    total = (force + h * a.C_d0 * v_b[0]) / (1.0 - a.S_ratio * a.C_d0)
    per_thrust, stream = a.S_ratio * a.C_l * a.xi_f, 0.5 * a.C_l * a.xi_f * h * v_b[0]
    needed = (abs(lift) / (RESERVE * a.delta_max) - 2.0 * stream) / per_thrust
    low, high = a.k_f * a.omega_min**2, a.k_f * a.omega_max**2
    given_up = BOOST if needed > max(total, 2.0 * low) else 0
    total = max(total, needed)
    kept = min(max(differ, low - high), high - low)
    mean = min(max(0.5 * total, low + 0.5 * abs(kept)), high - 0.5 * abs(kept))
    given_up |= YAW if abs(kept - differ) > ROUNDING else 0
    # Less than idle cannot be had; a glide that asks for it gives up nothing worth a word.
    given_up |= THRUST if 2.0 * mean < total - ROUNDING else 0
    command[0], command[1] = math.sqrt((mean + 0.5 * kept) / a.k_f), math.sqrt((mean - 0.5 * kept) / a.k_f)
    g1, g2 = max(per_thrust * thrusts[0] + stream, LEAST), max(per_thrust * thrusts[1] + stream, LEAST)
    return given_up | _elevons(lift, twist, g1, g2, a.delta_max, command)


@njit(cache=True)
def _elevons(lift: float, twist: float, g1: float, g2: float, limit: float, command: Array) -> int:
    """Deflections of E1 + E2 = lift and E1 - E2 = twist; pitch first, with a share kept for roll."""
    pitch, roll = lift / (g1 + g2), twist / (g1 + g2)
    roll_room = max(limit - abs(pitch), ROLL_SHARE * limit)
    kept_roll = min(max(roll, -roll_room), roll_room)
    pitch_room = limit - min(abs(kept_roll), ROLL_SHARE * limit)
    kept_pitch = min(max(pitch, -pitch_room), pitch_room)
    # Unequal slipstreams turn a symmetric deflection into roll: each side is divided by its own effectiveness.
    half = 0.5 * (g1 + g2)
    command[2] = min(max((kept_pitch + kept_roll) * half / g1, -limit), limit)
    command[3] = min(max((kept_pitch - kept_roll) * half / g2, -limit), limit)
    given_up = PITCH if abs(kept_pitch - pitch) > ROUNDING else 0
    return given_up | (ROLL if abs(kept_roll - roll) > ROUNDING else 0)


@njit(cache=True)
def thrusts_of(plant_speeds: Array, a: Airframe) -> Array:
    """Thrust of each propeller at its speed [rad/s], (2,) [N]."""
    return np.array((a.k_f * plant_speeds[0] ** 2, a.k_f * plant_speeds[1] ** 2))
