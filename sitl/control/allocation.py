"""From virtual commands (T1, T2, d1 T1, d2 T2) to motor speeds and elevon deflections.

When a limit is met, what is kept of the command decides whether the vehicle recovers. In order:

1. The difference of the thrusts (yaw) before their sum: both are moved together.
2. The *direction* of the roll and pitch moment before its size: both elevons are scaled by one factor. Cutting
   each elevon alone, or keeping pitch at the cost of roll, turns the vehicle about an axis nobody asked for. Of
   100 hybrid recoveries from up to 180 deg, 5 m/s and 3 rad/s off hover the first loses 4, the second 19, the
   scaling none.
"""

from typing import NamedTuple

from sitl.compiled import kernel
from sitl.model.airframe import Airframe
from sitl.model.arithmetic import clipped
from sitl.model.propeller import speed_for, thrust
from sitl.model.state import Actuators

THRUST, YAW, PITCH, ROLL, BOOST = 1, 2, 4, 8, 16  # DARKO_SATURATION bits
MOMENT = PITCH | ROLL  # scaled down together
ROUNDING = 1e-9  # of a command that is met [N]


class Virtual(NamedTuple):
    """Virtual commands, in which the hover model is linear."""

    T1: float  # thrust of the left motor [N]
    T2: float  # thrust of the right motor [N]
    dT1: float  # deflection of the left elevon times its thrust [N rad]
    dT2: float  # deflection of the right elevon times its thrust [N rad]


@kernel
def allocate(u: Virtual, a: Airframe, inflow: float = 0.0) -> tuple[Actuators, int]:
    """Actuator commands that realise ``u`` as far as the limits allow, and the DARKO_SATURATION bits (0: all of it).

    Deflections are what the elevons need at the thrust they get; ``inflow`` is the air along the nose [m/s].
    """
    low, high = thrust(a.omega_min, inflow, a), thrust(a.omega_max, inflow, a)
    differ = clipped(u.T1 - u.T2, low - high, high - low)
    mean = clipped(0.5 * (u.T1 + u.T2), low + 0.5 * abs(differ), high - 0.5 * abs(differ))
    T1, T2 = mean + 0.5 * differ, mean - 0.5 * differ
    # Of a slipstream; a windmilling propeller makes none.
    least = a.k_f * (a.omega_min * a.omega_min) + a.k_fw * a.omega_min
    d1, d2 = u.dT1 / max(T1, least), u.dT2 / max(T2, least)
    largest = max(abs(d1), abs(d2))
    scale = a.delta_max / max(largest, a.delta_max)
    saturation = THRUST if abs(u.T1 + u.T2 - T1 - T2) > ROUNDING else 0
    saturation |= YAW if abs(u.T1 - u.T2 - differ) > ROUNDING else 0
    saturation |= MOMENT if largest > a.delta_max else 0
    return Actuators(speed_for(T1, inflow, a), speed_for(T2, inflow, a), scale * d1, scale * d2), saturation
