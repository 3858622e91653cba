"""From a force along the nose and a moment to motors and elevons, in an air stream.

The airspeed model is inverted in closed form, damping and the wing's own moment included. What the limits do not
allow is given up in this order, last first: yaw (the thrusts' difference) is kept before pitch, pitch before roll, of
which a share is always kept; and the sum of the thrusts gives way to all of them: it is even *raised* where the
elevons need more slipstream, since a tail-sitter that cannot raise its nose does not come to a stop.
"""

import math

from sitl.compiled import kernel
from sitl.control.allocation import BOOST, PITCH, ROLL, ROUNDING, THRUST, YAW
from sitl.model.aerodynamics import damping, effective_speed
from sitl.model.airframe import Airframe
from sitl.model.arithmetic import clipped
from sitl.model.state import Actuators
from sitl.model.vectors import Vector

ROLL_SHARE = 0.15  # of the elevons' travel, kept for roll whatever pitch asks [-]
RESERVE = 0.9  # share of the travel that pitch may use before thrust is raised [-]
MIN_EFFECT = 0.15  # an elevon is not divided by a smaller effectiveness [N/rad]


@kernel
def invert(force: float, moment: Vector, v_b: Vector, w: Vector, now: Actuators, a: Airframe) -> tuple[Actuators, int]:
    """Actuator commands for an axial force and a moment, and the DARKO_SATURATION bits.

    Args:
        force: Wanted along x_b, the wing's axial drag not counted [N].
        moment: Wanted, body frame [N m].
        v_b: Velocity relative to the air, body frame [m/s].
        w: Body rates [rad/s].
        now: Where the actuators are: the slipstreams are those of the present thrusts.
        a: The airframe as the law knows it.
    """
    h = 0.5 * a.rho * a.S * effective_speed(v_b, w, a)
    damped = damping(w, 0.0, h, a)
    arm = a.Delta_r * a.xi_m / a.xi_f
    differ = -(moment.z - damped.z) / (a.p_y - a.S_ratio * a.a_y * a.C_d0)
    lift = -(moment.y - damped.y + h * a.Delta_r * a.C_l * v_b.z) / arm  # E1 + E2
    twist = (a.k_m / a.k_f * differ - moment.x + damped.x) / a.a_y  # E1 - E2

    total = (force + h * a.C_d0 * v_b.x) / (1.0 - a.S_ratio * a.C_d0)
    per_thrust, stream = a.S_ratio * a.C_l * a.xi_f, 0.5 * a.C_l * a.xi_f * h * v_b.x
    needed = (abs(lift) / (RESERVE * a.delta_max) - 2.0 * stream) / per_thrust
    low, high = a.k_f * (a.omega_min * a.omega_min), a.k_f * (a.omega_max * a.omega_max)
    saturation = BOOST if needed > max(total, 2.0 * low) else 0
    total = max(total, needed)
    kept = clipped(differ, low - high, high - low)
    mean = clipped(0.5 * total, low + 0.5 * abs(kept), high - 0.5 * abs(kept))
    saturation |= YAW if abs(kept - differ) > ROUNDING else 0
    # Thrust below idle is not available; a glide that asks for it is not reported as saturation.
    saturation |= THRUST if 2.0 * mean < total - ROUNDING else 0
    left, right = math.sqrt((mean + 0.5 * kept) / a.k_f), math.sqrt((mean - 0.5 * kept) / a.k_f)
    g1 = max(per_thrust * (a.k_f * (now.left_motor * now.left_motor)) + stream, MIN_EFFECT)
    g2 = max(per_thrust * (a.k_f * (now.right_motor * now.right_motor)) + stream, MIN_EFFECT)
    d1, d2, missing = _elevons(lift, twist, g1, g2, a.delta_max)
    return Actuators(left, right, d1, d2), saturation | missing


@kernel
def _elevons(lift: float, twist: float, g1: float, g2: float, limit: float) -> tuple[float, float, int]:
    """Deflections of E1 + E2 = lift and E1 - E2 = twist; pitch first, with a share kept for roll."""
    pitch, roll = lift / (g1 + g2), twist / (g1 + g2)
    share = ROLL_SHARE * limit
    roll_room = max(limit - abs(pitch), share)
    kept_roll = clipped(roll, -roll_room, roll_room)
    pitch_room = limit - min(abs(kept_roll), share)
    kept_pitch = clipped(pitch, -pitch_room, pitch_room)
    # Unequal slipstreams turn a symmetric deflection into roll: each side is divided by its own effectiveness.
    half = 0.5 * (g1 + g2)
    d1 = clipped((kept_pitch + kept_roll) * half / g1, -limit, limit)
    d2 = clipped((kept_pitch - kept_roll) * half / g2, -limit, limit)
    saturation = PITCH if abs(kept_pitch - pitch) > ROUNDING else 0
    saturation |= ROLL if abs(kept_roll - roll) > ROUNDING else 0
    return d1, d2, saturation
