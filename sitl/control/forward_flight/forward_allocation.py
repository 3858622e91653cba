"""From a force along the nose and a moment to motors and elevons, in an air stream.

The model gives force and moment of the actuators as they are, and their slopes by each actuator: the effectiveness. The
change that is wanted is divided by them (no matrix is inverted), so any aerodynamics will do. At the limits the
priority is yaw (the thrusts' difference), pitch, roll, of which a share is always kept, and then the sum of the
thrusts. That sum is even *raised* where the elevons need more slipstream, since a tail-sitter that cannot raise its
nose does not come to a stop.
"""

from typing import NamedTuple

from sitl.compiled import kernel
from sitl.control.allocation import BOOST, PITCH, ROLL, ROUNDING, THRUST, YAW
from sitl.model.aerodynamics import Slopes, thrusts
from sitl.model.airframe import Airframe, elevon_arm, slipstream_slope
from sitl.model.arithmetic import clipped
from sitl.model.propeller import speed_for, thrust
from sitl.model.state import Actuators
from sitl.model.vectors import Vector

ROLL_SHARE = 0.15  # of the elevons' travel, kept for roll whatever pitch asks [-]
RESERVE = 0.9  # share of the travel that pitch may use before thrust is raised [-]
MIN_EFFECT = 0.15  # an elevon is not divided by a smaller effectiveness [N/rad]


class ModelPoint(NamedTuple):
    """Force and moment by the model of the actuators as they are, and its slopes there."""

    force: Vector  # body frame [N]
    moment: Vector  # body frame [N m]
    stream: Slopes  # of the forces in the present stream and slipstreams
    inflow: float  # air along the nose [m/s]
    actuators: Actuators


@kernel
def invert(force: float, moment: Vector, present: ModelPoint, a: Airframe) -> tuple[Actuators, int]:
    """Actuator commands for an axial force and a moment, and the DARKO_SATURATION bits.

    Args:
        force: Wanted along x_b [N].
        moment: Wanted, body frame [N m].
        present: What the model makes of the actuators as they are.
        a: The airframe as the law knows it.
    """
    F, M, stream, inflow, now = present
    T1, T2 = thrusts(now, inflow, a)
    E1, E2 = stream.left_elevon * now.left_elevon, stream.right_elevon * now.right_elevon
    given = 1.0 - a.S_ratio * a.C_d0
    differ = T1 - T2 - (moment.z - M.z) / (a.p_y - a.S_ratio * a.a_y * a.C_d0)
    lift = E1 + E2 - (moment.y - M.y) / elevon_arm(a)  # E1 + E2
    twist = E1 - E2 + (a.k_m / a.k_f * (differ - (T1 - T2)) - (moment.x - M.x)) / a.a_y  # E1 - E2

    total = T1 + T2 + (force - F.x) / given
    per_thrust = a.S_ratio * slipstream_slope(a) * a.xi_f
    free = stream.left_elevon + stream.right_elevon - per_thrust * (T1 + T2)  # what the elevons have without thrust
    needed = (abs(lift) / (RESERVE * a.delta_max) - free) / per_thrust
    low, high = thrust(a.omega_min, inflow, a), thrust(a.omega_max, inflow, a)
    saturation = BOOST if needed > max(total, 2.0 * low) else 0
    total = max(total, needed)
    kept = clipped(differ, low - high, high - low)
    mean = clipped(0.5 * total, low + 0.5 * abs(kept), high - 0.5 * abs(kept))
    saturation |= YAW if abs(kept - differ) > ROUNDING else 0
    # Thrust below idle is not available; a glide that asks for it is not reported as saturation.
    saturation |= THRUST if 2.0 * mean < total - ROUNDING else 0
    left, right = speed_for(mean + 0.5 * kept, inflow, a), speed_for(mean - 0.5 * kept, inflow, a)
    d1, d2, missing = _elevons(lift, twist, stream.left_elevon, stream.right_elevon, a.delta_max)
    return Actuators(left, right, d1, d2), saturation | missing


@kernel
def _elevons(lift: float, twist: float, left: float, right: float, limit: float) -> tuple[float, float, int]:
    """Deflections of E1 + E2 = lift and E1 - E2 = twist; pitch first, with a share kept for roll.

    Args:
        lift: E1 + E2 [N].
        twist: E1 - E2 [N].
        left: Slope of the left elevon's force [N/rad].
        right: Of the right one's [N/rad].
        limit: Of a deflection [rad].

    Returns:
        Both deflections, and the bits of what they do not give.
    """
    g1, g2 = max(left, MIN_EFFECT), max(right, MIN_EFFECT)
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
    E1, E2 = left * d1, right * d2
    saturation = PITCH if abs(E1 + E2 - lift) > ROUNDING else 0
    saturation |= ROLL if abs(E1 - E2 - twist) > ROUNDING else 0
    return d1, d2, saturation
