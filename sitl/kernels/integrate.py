"""One step of the plant: actuators exactly, rigid body by Runge-Kutta 4, quaternion kept unit."""

import math

import numpy as np
from numba import njit

from sitl.kernels import actuators
from sitl.kernels.ground import move_anchors
from sitl.kernels.parameters import Airframe, Array
from sitl.kernels.rigid_body import derivative
from sitl.kernels.state import ACTUATOR, Q

RIGID = ACTUATOR  # the rigid state is all that comes before the actuators


@njit(cache=True)
def plant_step(plant: Array, command: Array, wind: Array, armed: bool, a: Airframe, dt: float) -> int:
    """Advance the plant by ``dt`` in place.

    Args:
        plant: Plant state, laid out by :mod:`sitl.kernels.state`, (SIZE,).
        command: w1, w2 [rad/s], delta1, delta2 [rad], (4,).
        wind: Velocity of the air over the step, world NWU, (3,) [m/s].
        armed: Whether the motors may turn.
        a: The airframe.
        dt: Step [s]; 1 ms is the product's, stable against the ground's springs.

    Returns:
        Bits of DARKO_LIMIT that were active.
    """
    flags = actuators.advance(plant, command, armed, dt, a)
    k = np.empty((4, RIGID))
    x = np.empty(RIGID)
    derivative(plant, plant, wind, a, k[0])
    for stage in range(1, 4):
        h = dt if stage == 3 else 0.5 * dt
        for i in range(RIGID):
            x[i] = plant[i] + h * k[stage - 1, i]
        derivative(x, plant, wind, a, k[stage])
    for i in range(RIGID):
        plant[i] += dt / 6.0 * (k[0, i] + 2.0 * k[1, i] + 2.0 * k[2, i] + k[3, i])
    n = math.sqrt(plant[Q] ** 2 + plant[Q + 1] ** 2 + plant[Q + 2] ** 2 + plant[Q + 3] ** 2)
    for i in range(Q, Q + 4):
        plant[i] /= n
    move_anchors(plant, a)
    return flags
