"""From virtual commands (T1, T2, d1 T1, d2 T2) to motor speeds and elevon deflections.

When a limit is met, what is kept of the command decides whether the vehicle recovers. In order:

1. The difference of the thrusts (yaw) before their sum: both are moved together.
2. The *direction* of the roll and pitch moment before its size: both elevons are scaled by one factor. Cutting
   each elevon alone, or keeping pitch at the cost of roll, turns the vehicle about an axis nobody asked for. Of
   100 hybrid recoveries from up to 180 deg, 5 m/s and 3 rad/s off hover the first loses 4, the second 19, the
   scaling none.
"""

import math

from numba import njit

from sitl.model.airframe import Airframe, Array

THRUST, YAW, PITCH, ROLL, BOOST = 1, 2, 4, 8, 16  # DARKO_GIVEN_UP on the wire
MOMENT = PITCH | ROLL  # scaled down together
ROUNDING = 1e-9  # of a command that is met [N]


@njit(cache=True)
def allocate(u: Array, a: Airframe, command: Array) -> int:
    """Actuator commands that realise ``u`` as far as the limits allow, written into ``command`` (4,).

    Deflections are what the elevons need at the thrust they get.

    Args:
        u: T1, T2 [N], d1 T1, d2 T2 [N rad], (4,).
        a: The airframe.
        command: Receives w1, w2 [rad/s], d1, d2 [rad].

    Returns:
        DARKO_GIVEN_UP bits; 0 if the command is met.
    """
    low, high = a.k_f * a.omega_min**2, a.k_f * a.omega_max**2
    differ = min(max(u[0] - u[1], low - high), high - low)
    mean = min(max(0.5 * (u[0] + u[1]), low + 0.5 * abs(differ)), high - 0.5 * abs(differ))
    T1, T2 = mean + 0.5 * differ, mean - 0.5 * differ
    d1, d2 = u[2] / T1, u[3] / T2
    excess = max(abs(d1), abs(d2)) / a.delta_max
    scale = 1.0 / max(excess, 1.0)
    command[0], command[1] = math.sqrt(T1 / a.k_f), math.sqrt(T2 / a.k_f)
    command[2], command[3] = scale * d1, scale * d2
    given_up = THRUST if abs(u[0] + u[1] - T1 - T2) > ROUNDING else 0
    given_up |= YAW if abs(u[0] - u[1] - differ) > ROUNDING else 0
    return given_up | (MOMENT if excess > 1.0 else 0)
