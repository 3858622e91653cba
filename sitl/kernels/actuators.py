"""Motors and elevons between command and effect (report, "Saturation des commandes")."""

import math

from numba import njit

from sitl.kernels.parameters import FIRST_ORDER, Airframe, Array
from sitl.kernels.state import ACTUATOR

AT_REST = 1e-9


@njit(cache=True)
def advance(plant: Array, command: Array, armed: bool, dt: float, a: Airframe) -> int:
    """Move the actuators towards their commands for ``dt`` seconds.

    Args:
        plant: Plant state, changed in place.
        command: w1, w2 [rad/s], delta1, delta2 [rad], (4,); beyond a limit it stops at the limit.
        armed: Stopped motors spin down to zero, running ones not below omega_min.
        dt: [s]
        a: The airframe.

    Returns:
        Bits of DARKO_LIMIT: 1, 2, 4, 8 for a position limit of motor left, right, elevon left, right; times 16
        for their rate limits.
    """
    flags = 0
    for i in range(4):
        if i < 2:
            low, high = (a.omega_min, a.omega_max) if armed else (0.0, a.omega_max)
            wanted = command[i] if armed else 0.0
            rate, tau = a.omega_rate, a.motor_tau
        else:
            low, high, wanted = -a.delta_max, a.delta_max, command[i]
            rate, tau = a.delta_rate, a.elevon_tau
        now = plant[ACTUATOR + i]
        if wanted <= low or wanted >= high:
            wanted = min(max(wanted, low), high)
            flags |= (1 << i) if armed or i >= 2 else 0  # a stopped motor is at no limit
        if a.actuator_model == FIRST_ORDER:
            change = (wanted - now) * (1.0 - math.exp(-dt / tau))
        else:
            change = wanted - now
            if abs(change) > rate * dt + AT_REST:
                change = math.copysign(rate * dt, change)
                flags |= 16 << i
        plant[ACTUATOR + i] = now + change
    return flags
