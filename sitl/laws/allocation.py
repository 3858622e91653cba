"""From virtual commands (T1, T2, d1 T1, d2 T2) to motor speeds and elevon deflections."""

import math

from numba import njit

from sitl.kernels.parameters import Airframe, Array


@njit(cache=True)
def allocate(u: Array, a: Airframe, command: Array) -> None:
    """Actuator commands that realise ``u`` as far as the limits allow, written into ``command`` (4,).

    Both thrusts are moved together so that their difference, the yaw moment, survives a limit; only a
    difference wider than the whole range is cut. Deflections are what the elevons need at the thrust they get.

    Args:
        u: T1, T2 [N], d1 T1, d2 T2 [N rad], (4,).
        a: The airframe.
        command: Receives w1, w2 [rad/s], d1, d2 [rad].
    """
    low, high = a.k_f * a.omega_min**2, a.k_f * a.omega_max**2
    differ = min(max(u[0] - u[1], low - high), high - low)
    mean = min(max(0.5 * (u[0] + u[1]), low + 0.5 * abs(differ)), high - 0.5 * abs(differ))
    for i in range(2):
        T = mean + 0.5 * differ if i == 0 else mean - 0.5 * differ
        command[i] = math.sqrt(T / a.k_f)
        command[2 + i] = min(max(u[2 + i] / T, -a.delta_max), a.delta_max)
